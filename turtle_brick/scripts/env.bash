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
# shell. If ROS 2 Jazzy is sourced or installed in /opt/ros/jazzy, the script uses this
# installation (native environment). Otherwise, the script first installs ROS from Python wheels
# into the directory .ros next to the packages (PyPI environment). When sourced again, the script
# builds only changed packages. The return status is 0 on success. Otherwise, the last line of
# output states the reason. The script uses these environment variables:
#
#   PYTHON=...   Python interpreter for the PyPI environment, 3.10 to 3.13 (default: the first
#                suitable program among python3, python3.13, python3.12, python3.11 and python3.10)
#   FASTRTPS_DEFAULT_PROFILES_FILE=...   discovery settings for the PyPI environment
#                (default: fastdds.xml)

if [ -z "${BASH_VERSION-}" ]; then
  echo 'turtle_brick: env.bash requires bash. Start bash and source env.bash there.' >&2
  return 1
fi
if [[ ${BASH_SOURCE[0]} == "$0" ]]; then
  echo "turtle_brick: env.bash must be sourced, not run. Type: source $0" >&2
  exit 1
fi

_turtle_brick_env() {
  local scripts environment kind python='' fits candidate
  local -a candidates
  local -; set +u  # the ROS and colcon setup files read unset variables
  scripts=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P) || return 1
  environment=${scripts%/*/*}/.ros

  # Choose the environment. A shell that already uses the PyPI environment continues to use it.
  if [[ -n ${VIRTUAL_ENV-} && $VIRTUAL_ENV == "${TURTLE_BRICK_ENVIRONMENT-}/venv" ]]; then
    kind=pypi
  elif [[ -n ${ROS_DISTRO-} && $ROS_DISTRO != jazzy ]]; then
    echo "turtle_brick: This shell has sourced ROS 2 $ROS_DISTRO, but this workspace requires" \
      "Jazzy. Open a new shell without sourcing ROS 2 $ROS_DISTRO." >&2
    return 1
  elif [[ -n ${ROS_DISTRO-} ]] && python3 -c 'import rclpy' 2>/dev/null </dev/null; then
    kind=native
  elif [[ -r /opt/ros/jazzy/setup.bash ]]; then
    kind=native
    source /opt/ros/jazzy/setup.bash || return 1
    if ! python3 -c 'import rclpy' 2>/dev/null </dev/null; then
      echo "turtle_brick: The python3 on the PATH, $(type -P python3), cannot import rclpy from" \
        '/opt/ros/jazzy. Deactivate the conda or virtual environment and try again.' >&2
      return 1
    fi
  else
    kind=pypi
  fi

  # Choose the Python interpreter.
  if [[ $kind == native ]]; then
    python=python3
  elif [[ -z ${PYTHON-} ]] && "$environment/venv/bin/python" -I -c '' 2>/dev/null </dev/null; then
    python=$environment/venv/bin/python
  else
    fits='import sys, sysconfig
sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13) or sys.implementation.name != "cpython"
         or bool(sysconfig.get_config_var("Py_GIL_DISABLED")))'
    candidates=("${PYTHON:-python3}")
    [[ -n ${PYTHON-} ]] || candidates+=(python3.13 python3.12 python3.11 python3.10)
    for candidate in "${candidates[@]}"; do
      if "$candidate" -I -c "$fits" 2>/dev/null </dev/null; then
        python=$candidate
        break
      fi
    done
    if [[ -z $python ]]; then
      local problem='The PATH does not contain CPython 3.10 to 3.13.'
      [[ -z ${PYTHON-} ]] || problem="$PYTHON is not CPython 3.10 to 3.13."
      echo "turtle_brick: $problem Install one, for example with \"sudo apt install python3" \
        'python3-venv python3-dev", or set the variable PYTHON to its path.' >&2
      return 1
    fi
  fi

  # -I ignores the Python environment variables and the user's packages
  _ROS_WHEELS_BOOTSTRAP_COMPLETE=1 "$python" -I -X utf8 "$scripts/make_environment.py" "$kind" \
    </dev/null || return 1

  if [[ $kind == pypi ]]; then
    source "$environment/venv/local_setup.bash" || return 1
    export FASTRTPS_DEFAULT_PROFILES_FILE=${FASTRTPS_DEFAULT_PROFILES_FILE:-$scripts/fastdds.xml}
  fi
  # an empty IFS is required because the colcon script does not quote the path to Python
  IFS='' source "$environment/install/local_setup.bash" || return 1
  export TURTLE_BRICK_ENVIRONMENT=$environment

  # Report errors in the parameter file before any node starts.
  local status=0
  python3 -m turtle_brick.core.parameters "${scripts%/*}/config/turtle.yaml" </dev/null || status=1
  xacro "${scripts%/*}/urdf/turtle.urdf.xacro" </dev/null >/dev/null || status=1

  if [[ $- == *i* ]]; then
    local source=''
    if [[ $kind == pypi ]]; then
      eval "$(register-python-argcomplete ros2)" # Tab completion
      source=' from Python wheels'
    fi
    echo "turtle_brick: Ready to use ROS 2 Jazzy$source and the packages in $environment" >&2
  fi
  return "$status"
}

if _turtle_brick_env; then
  unset -f _turtle_brick_env
else
  unset -f _turtle_brick_env
  return 1
fi
