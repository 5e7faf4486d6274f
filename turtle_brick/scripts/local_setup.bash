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

# Set up a shell to use the virtual environment in the PyPI environment as its ROS prefix.
# make_environment copies this file into the virtual environment. setup_shell.bash and the
# setup.bash files of overlays source the copy.

# These variables could select packages from another Python or a middleware that is not installed.
unset PYTHONHOME PYTHONPATH RMW_IMPLEMENTATION
export PYTHONNOUSERSITE=1

VIRTUAL_ENV=$(CDPATH='' builtin cd -- "$(command dirname -- "${BASH_SOURCE[0]}")" && pwd -P)
export VIRTUAL_ENV AMENT_PREFIX_PATH=$VIRTUAL_ENV
export ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3

export FASTRTPS_DEFAULT_PROFILES_FILE=${FASTRTPS_DEFAULT_PROFILES_FILE:-$VIRTUAL_ENV/fastdds.xml}
export CMAKE_GENERATOR=${CMAKE_GENERATOR:-Ninja} # the wheels contain Ninja, but not make

# Without this variable, the wheels would restart every Python process to set LD_LIBRARY_PATH.
export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1

# Insert an entry at the beginning of a search path and remove older entries from this environment.
_turtle_brick_first() {
  local entry rest='' IFS=:
  local -; set -f
  for entry in ${!1-}; do
    case $entry in
      '' | "${VIRTUAL_ENV%/*}"/*) ;;
      *) rest+=:$entry ;;
    esac
  done
  export "$1=$2$rest"
}
_turtle_brick_first PATH "$VIRTUAL_ENV/bin"
_turtle_brick_first CMAKE_PREFIX_PATH "$VIRTUAL_ENV"
_turtle_brick_first LD_LIBRARY_PATH \
  "$VIRTUAL_ENV/lib$(set +f; printf ':%s' "$VIRTUAL_ENV"/lib/python3*/site-packages/ros_*.libs)"
unset -f _turtle_brick_first
hash -r
