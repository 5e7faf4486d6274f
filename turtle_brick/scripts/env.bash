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
# It makes rclpy, both packages of this workspace and their dependencies available in the shell.
# Where ROS 2 Jazzy is sourced already, or installed in /opt/ros/jazzy, the packages are built on
# that; elsewhere a home is made from wheels, in .ros next to the packages. The next time, only what
# has changed is built again. The status is 0 if all is ready; otherwise one sentence says why not.
#
#   PYTHON=...   the Python, 3.10 to 3.13, of a home of wheels (else python3, or the first that
#                fits of python3.13, python3.12, python3.11, python3.10)
#   TURTLE_BRICK_VIEW=...   what the launch files show the robot with: rviz, web or none (else
#                rviz, or web where there is no rviz2)
#   FASTRTPS_DEFAULT_PROFILES_FILE=...   how the nodes of a home of wheels find each other (else
#                fastdds.xml)

if [ -z "${BASH_VERSION-}" ]; then
  echo 'turtle_brick: env.bash is for bash: start one, and source it there.' >&2
  return 1
fi
if [[ ${BASH_SOURCE[0]} == "$0" ]]; then
  echo "turtle_brick: env.bash is to be sourced, not run: source $0" >&2
  exit 1
fi

_turtle_brick_env() {
  local scripts home kind python='' fits candidate
  local -a candidates
  local -; set +u  # the setup files of ROS and colcon read variables that need not be set
  scripts=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P) || return 1
  home=${scripts%/*/*}/.ros

  # Which home? A shell in a home of wheels stays in it.
  if [[ -n ${TURTLE_BRICK_HOME-} && ${VIRTUAL_ENV-} == "$TURTLE_BRICK_HOME/venv" ]]; then
    kind=pypi
  elif [[ -n ${ROS_DISTRO-} && $ROS_DISTRO != jazzy ]]; then
    echo "turtle_brick: This shell has ROS 2 $ROS_DISTRO sourced, and the packages need Jazzy:" \
      'open a shell without it.' >&2
    return 1
  elif [[ -n ${ROS_DISTRO-} ]] && python3 -c 'import rclpy' 2>/dev/null </dev/null; then
    kind=native
  elif [[ -r /opt/ros/jazzy/setup.bash ]]; then
    kind=native
    source /opt/ros/jazzy/setup.bash || return 1
    if ! python3 -c 'import rclpy' 2>/dev/null </dev/null; then
      echo "turtle_brick: The python3 on the PATH, $(type -P python3), cannot import the rclpy of" \
        '/opt/ros/jazzy: leave the conda or virtual environment that it is from.' >&2
      return 1
    fi
  else
    kind=pypi
  fi

  # Which Python?
  if [[ $kind == native ]]; then
    python=python3
  elif [[ -z ${PYTHON-} ]] && "$home/venv/bin/python" -I -c '' 2>/dev/null </dev/null; then
    python=$home/venv/bin/python
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
      echo "turtle_brick: ${PYTHON:-No python3 on the PATH} is${PYTHON:+ not} a CPython of 3.10 to" \
        '3.13: install one, for example with "sudo apt install python3 python3-venv' \
        'python3-dev", or name one in the variable PYTHON.' >&2
      return 1
    fi
  fi

  # isolated (-I) from the caller's variables and packages
  _ROS_WHEELS_BOOTSTRAP_COMPLETE=1 "$python" -I -X utf8 "$scripts/make_home.py" "$kind" \
    </dev/null || return 1

  if [[ $kind == pypi ]]; then
    source "$home/venv/local_setup.bash" || return 1
    export FASTRTPS_DEFAULT_PROFILES_FILE=${FASTRTPS_DEFAULT_PROFILES_FILE:-$scripts/fastdds.xml}
  fi
  # without IFS, since colcon's script starts Python unquoted, and a path may have blanks
  IFS='' source "$home/install/local_setup.bash" || return 1
  export TURTLE_BRICK_HOME=$home

  # A mistake in the parameter file is best told right after the edit. All else is ready.
  local status=0
  python3 -m turtle_brick.core.parameters "${scripts%/*}/config/turtle.yaml" </dev/null || status=1

  # What do the launch files show the robot with?
  if [[ -z ${TURTLE_BRICK_VIEW-} ]]; then
    local -a prefixes
    IFS=: read -ra prefixes <<<"${AMENT_PREFIX_PATH-}"
    export TURTLE_BRICK_VIEW=web
    for candidate in "${prefixes[@]}"; do
      if [[ -e $candidate/share/ament_index/resource_index/packages/rviz2 ]]; then
        TURTLE_BRICK_VIEW=rviz
      fi
    done
  fi

  if [[ $- == *i* ]]; then
    if [[ $kind == pypi ]]; then
      eval "$(register-python-argcomplete ros2)" # Tab completes, as with the real ros2
    fi
    [[ $kind == native ]] && kind='' || kind=', as Python wheels,'
    echo "turtle_brick: this shell has ROS 2 Jazzy$kind and the packages, built in $home" >&2
  fi
  return "$status"
}

if _turtle_brick_env; then
  unset -f _turtle_brick_env
else
  unset -f _turtle_brick_env
  return 1
fi
