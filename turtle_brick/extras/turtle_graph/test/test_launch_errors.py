# SPDX-License-Identifier: Apache-2.0
"""Test that the errors in the output of ros2 launch become one sentence."""

import pytest
from turtle_graph.client.launch_errors import explain_missing, launch_error

DIED = "[ERROR] [{0}]: process has died [pid 7, exit code {1}, cmd '/lib/{0} --ros-args'].\n"

IMPORT_ERROR = """[catcher-3] Traceback (most recent call last):
[arena-2] waiting
[catcher-3]   File "catcher.py", line 1, in <module>
[catcher-3]     import nonsuch
[catcher-3] ModuleNotFoundError: No module named 'nonsuch'
"""
CAUGHT = '[ERROR] [launch]: Caught exception in launch (see debug for traceback): '


@pytest.mark.parametrize('output, expected', (
    (IMPORT_ERROR + DIED.format('catcher-3', 1), 'catcher crashed: ModuleNotFoundError: No module '
     "named 'nonsuch' (the workspace and this installation of ROS do not contain nonsuch)"),
    (IMPORT_ERROR, ''),  # The catcher logged a traceback but did not exit.
    (DIED.format('arena-2', -11), 'arena crashed: exit status -11'),
    (DIED.format('arena-2', -2), ''),  # ros2 launch stopped this process.
    (f'{CAUGHT}executed command showed stderr output. Command: /bin/xacro t.urdf\n'
     'Captured stderr output:\nload_yaml() is\ndeprecated\n\n[INFO] [launch]: x\n',
     'xacro printed an error or a warning, which stops the launch: load_yaml() is deprecated'),
    (f"{CAUGHT}\"package 'rviz2' not found, searching: ['/a', '/b']\"\n",
     "package 'rviz2' not found (the workspace and this installation of ROS do not contain "
     'rviz2)'),
    (f'{CAUGHT}Caught multiple exceptions when trying to load file of format [py]:\n'
     " - ModuleNotFoundError: No module named 'turtle_brick'\n - Error: unknown format\n",
     "ModuleNotFoundError: No module named 'turtle_brick' (the workspace does not contain "
     'turtle_brick)')))
def test_the_error_of_a_launch_is_one_sentence(output, expected):
    assert explain_missing(launch_error(output)) == expected
