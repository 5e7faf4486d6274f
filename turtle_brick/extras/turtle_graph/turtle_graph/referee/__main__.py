# SPDX-License-Identifier: Apache-2.0
"""
Run the referee with its own modules, whatever modules the workspace to be judged contains.

    python3 turtle_graph/referee [options] [-- COMMAND ...]

Of the sourced workspace, the referee imports only the interfaces. The options --class, --summary
and --help also work in a terminal in which ROS is not sourced.
"""

# A module with any other name could come from the workspace until the search path is set.
import os
import sys

HERE = os.path.dirname(os.path.realpath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
ROS_SETUP = os.path.realpath(os.path.join(ROOT, '../../scripts/ros.bash'))
"""Bash script that sets up the ROS environment without sourcing any workspace."""


def search_path() -> list[str]:
    """Return the search path for modules: this package, Python, ROS, and then workspaces."""
    # Each setup file prepends its own directories, so those of ROS are the last ones.
    sourced = [os.path.abspath(entry) for entry in reversed(
        os.environ.get('PYTHONPATH', '').split(os.pathsep)) if entry]
    return [ROOT, *(entry for entry in sys.path if entry not in (HERE, ROOT, *sourced)), *sourced]


if __name__ == '__main__':
    sys.path[:] = search_path()

    from importlib.util import find_spec
    from turtle_graph.programs import referee
    from turtle_graph.referee.options import parse

    if find_spec('rclpy') is None:
        options, _ = parse(sys.argv[1:])
        if 'ROS_DISTRO' not in os.environ and (options.classroom or options.summary):
            os.execvp('bash', ['bash', '-c', 'source "$1" && exec python3 "${@:2}"', 'bash',
                               ROS_SETUP, HERE, *sys.argv[1:]])
        print('referee: no ROS workspace is sourced. Source the workspace to be judged first.',
              file=sys.stderr)
        sys.exit(2)
    sys.exit(referee())
