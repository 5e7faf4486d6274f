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

# Set up a shell for ROS 2 (argument: ros) or for ROS 2 and the packages in this workspace
# (argument: packages). Only ros.bash and env.bash source this file. A user may have replaced cd
# by a function that also lists the folder, or a program by a function or an alias. Therefore, this
# file uses "builtin cd", as ROS's own setup files do, and calls programs with "command".

if [[ ${BASH_SOURCE[1]-} == "$0" ]]; then
  echo "turtle_brick: ${0##*/} must be sourced, not run. Type: source $0" >&2
  exit 1
fi

# Remove a directory and everything below it from all search paths.
_turtle_brick_remove() {
  local name entry kept
  local -a entries
  for name in AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH LD_LIBRARY_PATH PATH \
      PYTHONPATH; do
    [[ ${!name-} == *"$1"* ]] || continue
    kept=''
    IFS=: read -ra entries <<<"${!name}"
    for entry in "${entries[@]}"; do
      [[ $entry/ == "$1"/* ]] || kept+=:$entry
    done
    if [[ -n $kept ]]; then export "$name=${kept#:}"; else unset "$name"; fi
  done
}

# Print a Python interpreter that can create the PyPI environment.
_turtle_brick_python() {
  local candidate problem='The PATH does not contain CPython 3.10 to 3.13.' fits='import sys, sysconfig
sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13) or sys.implementation.name != "cpython"
         or bool(sysconfig.get_config_var("Py_GIL_DISABLED")))'
  local -a candidates=("${PYTHON:-python3}")
  [[ -n ${PYTHON-} ]] || candidates+=(python3.13 python3.12 python3.11 python3.10)
  for candidate in "${candidates[@]}"; do
    if command "$candidate" -I -c "$fits" 2>/dev/null </dev/null; then
      echo "$candidate"
      return
    fi
  done
  [[ -z ${PYTHON-} ]] || problem="$PYTHON is not CPython 3.10 to 3.13."
  echo "turtle_brick: $problem Install one, for example with \"sudo apt install python3" \
    'python3-venv python3-dev", or set the variable PYTHON to its path.' >&2
  return 1
}

_turtle_brick_set_up() {
  local scripts environment kind python=python3
  local status=0
  local -; set +u  # the ROS and colcon setup files read unset variables
  scripts=$(CDPATH='' builtin cd -- "$(command dirname -- "${BASH_SOURCE[0]}")" && pwd -P) || return 1
  environment=${scripts%/*/*}/.ros

  # Choose the environment. A shell that already uses a PyPI environment continues to use one.
  if [[ -e ${VIRTUAL_ENV-}/local_setup.bash ]]; then
    kind=pypi
  elif [[ -n ${ROS_DISTRO-} && $ROS_DISTRO != jazzy ]]; then
    echo "turtle_brick: This shell has sourced ROS 2 $ROS_DISTRO, but this workspace requires" \
      "Jazzy. Open a new shell without sourcing ROS 2 $ROS_DISTRO." >&2
    return 1
  elif [[ -n ${ROS_DISTRO-} ]] && command python3 -c 'import rclpy' 2>/dev/null </dev/null; then
    kind=native
  elif [[ -r /opt/ros/jazzy/setup.bash ]]; then
    kind=native
    source /opt/ros/jazzy/setup.bash || return 1
  else
    kind=pypi
  fi

  if [[ $kind == pypi ]]; then
    python=$environment/venv/bin/python
    if [[ -n ${PYTHON-} ]] || ! command "$python" -I -c '' 2>/dev/null </dev/null; then
      python=$(_turtle_brick_python) || return 1
    fi
  elif ! command python3 -c 'import catkin_pkg, em, lark, rclpy' 2>/dev/null </dev/null; then
    # this happens, for example, in a conda environment with the same version of Python as ROS
    echo "turtle_brick: The python3 on the PATH, $(type -P python3), lacks packages that ROS 2" \
      'Jazzy requires. Deactivate the conda or virtual environment and try again.' >&2
    return 1
  fi

  local id=${ROS_DOMAIN_ID:-0}
  if [[ ! $id =~ ^[0-9]{1,3}$ ]] || ((10#$id > 232)); then
    echo "turtle_brick: ROS_DOMAIN_ID is '$id', but must be an integer from 0 to 232." >&2
    return 1
  fi
  # ROS_LOCALHOST_ONLY=0 has no effect except for two warnings from every node
  [[ ${ROS_LOCALHOST_ONLY-} != 0 ]] || unset ROS_LOCALHOST_ONLY

  # for a native installation without the packages, there is nothing to build
  if [[ $kind == pypi || $1 == packages ]]; then
    # -I ignores the Python environment variables and the user's packages
    _ROS_WHEELS_BOOTSTRAP_COMPLETE=1 command "$python" -I -X utf8 "$scripts/make_environment" \
      "$kind" "$1" </dev/null || status=$?
    # with status 2, the shell can use ROS and the packages of the assignment
    ((status == 0 || status == 2)) || return 1
  fi

  # nodes fail if they cannot write their logs
  if [[ -z ${ROS_LOG_DIR-}${ROS_HOME-} ]] &&
      ! { [[ -n ${HOME-} ]] && command mkdir -p ~/.ros/log && [[ -w ~/.ros/log ]]; } 2>/dev/null; then
    export ROS_LOG_DIR=$environment/log/nodes
  fi

  _turtle_brick_remove "$environment/standins"
  _turtle_brick_remove "$environment/install"
  _turtle_brick_remove "$environment/venv"
  unset TURTLE_BRICK_ENVIRONMENT
  if [[ $kind == pypi ]]; then
    source "$environment/venv/local_setup.bash" || return 1
  elif [[ -d $environment/venv ]]; then
    export PYTHONPATH=${PYTHONPATH:+$PYTHONPATH:}$(printf '%s' "$environment"/venv/lib/python3*/site-packages)
  fi
  # an empty IFS is required because the colcon scripts do not quote the path to Python
  if [[ $kind == pypi || $1 == packages ]] && [[ -e $environment/standins/local_setup.bash ]]; then
    IFS='' source "$environment/standins/local_setup.bash" || return 1
  fi

  local packages=''
  if [[ $1 == packages ]]; then
    IFS='' source "$environment/install/local_setup.bash" || return 1
    export TURTLE_BRICK_ENVIRONMENT=$environment
    packages=" and the packages in $environment"
    # Report errors in the parameter file before any node starts.
    local problem folder=${scripts%/*}
    if ! command python3 -m turtle_brick_tools.check_parameters "$folder/config/turtle.yaml" </dev/null; then
      status=1
    elif ! problem=$(command xacro "$folder/urdf/turtle.urdf.xacro" \
        "params_file:=$folder/config/turtle.yaml" 2>&1 >/dev/null </dev/null); then
      echo "turtle_brick: ${problem%%when evaluating*}" >&2
      status=1
    fi
  fi

  if [[ $- == *i* ]] && ((status == 0)); then
    local source=''
    if [[ $kind == pypi ]]; then
      eval "$(command register-python-argcomplete ros2)" # Tab completion
      source=' from Python wheels'
    fi
    echo "turtle_brick: Ready to use ROS 2 Jazzy$source$packages" >&2
  fi
  return "$status"
}

# inside "if", the option errexit of the calling script has no effect
if _turtle_brick_set_up "$1"; then
  unset -f _turtle_brick_{remove,python,set_up}
else
  unset -f _turtle_brick_{remove,python,set_up}
  return 1
fi
