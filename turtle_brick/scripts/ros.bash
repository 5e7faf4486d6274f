# Copyright 2026 the turtle_brick developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

# Source this file in bash:  source turtle_brick/scripts/ros.bash
#
# This script makes ROS 2 Jazzy available in the shell, but not the packages in this workspace. Use
# it to build and run other workspaces. If ROS 2 Jazzy is sourced or installed in /opt/ros/jazzy,
# the script uses this installation (native environment). Otherwise, the script first installs ROS
# from Python wheels into the directory .ros next to the packages (PyPI environment). It also builds
# example_interfaces, which other workspaces may require. The return status is 0 on success.
# Otherwise, the last line of output states the reason. The script uses these environment variables:
#
#   PYTHON=...   Python interpreter for the PyPI environment, 3.10 to 3.13 (default: the first
#                suitable program among python3, python3.13, python3.12, python3.11 and python3.10)
#   FASTRTPS_DEFAULT_PROFILES_FILE=...   discovery settings for the PyPI environment
#                (default: fastdds.xml)

# These two lines are also valid in dash, fish and zsh, which print the message.
test -n "$BASH_VERSION" || echo 'turtle_brick: ros.bash requires bash. Start bash and source it there.' >&2
test -n "$BASH_VERSION" && source "$(command dirname -- "$BASH_SOURCE")/setup_shell.bash" ros
