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

# Source this file in bash:  source turtle_brick/scripts/env.bash
#
# This script builds the packages in this workspace and makes them and ROS 2 available in the
# shell. For ROS alone, source ros.bash, which describes the environment variables. When sourced
# again, the script builds only changed packages. The return status is 0 on success. Otherwise, the
# last line of output states the reason.

# These two lines are also valid in dash, fish and zsh, which print the message.
test -n "$BASH_VERSION" || echo 'turtle_brick: env.bash requires bash. Start bash and source it there.' >&2
test -n "$BASH_VERSION" && source "$(command dirname -- "$BASH_SOURCE")/setup_shell.bash" packages
