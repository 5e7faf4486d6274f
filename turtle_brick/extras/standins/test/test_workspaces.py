# SPDX-License-Identifier: Apache-2.0
"""Build, test and start a typical student workspace in the PyPI environment."""

import os
from pathlib import Path
import shlex
import shutil
import subprocess

import pytest

PACKAGE = Path(__file__).resolve().parents[3]
ROS = shlex.quote(f'{PACKAGE}/scripts/ros.bash')

pytestmark = pytest.mark.skipif(
    os.environ.get('VIRTUAL_ENV', '') != f'{PACKAGE.parent}/.ros/venv',
    reason='the PyPI environment has not been sourced')

COPYRIGHT = """from ament_copyright.main import main


def test_copyright():
    assert main() == 0
"""


def test_a_workspace_is_built_tested_and_started(tmp_path, domain_id):
    workspace = shutil.copytree(
        Path(__file__).parent / 'workspaces' / 'flat', tmp_path / 'workspace')
    (workspace / 'turtle_brick/test').mkdir()
    (workspace / 'turtle_brick/test/test_copyright.py').write_text(COPYRIGHT)

    def run(command, env):
        return subprocess.run(
            ['bash', '-c', command], cwd=workspace, env=env, text=True, check=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, timeout=300.0).stdout

    built = run(f'source {ROS} && colcon build && colcon test && colcon test-result --all',
                os.environ)
    assert 'Summary: 2 packages finished' in built
    for result in ('pytest.xml', 'xmllint.xml'):
        assert f'{result}: 1 test, 0 errors, 0 failures, 1 skipped' in built
    # In a new shell, it is sufficient to source the setup file of the workspace.
    inherited = ('HOME', 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_DOMAIN_ID', 'ROS_LOG_DIR')
    started = run(
        'source install/setup.bash; ros2 launch turtle_brick turtle_arena.launch.xml',
        {'PATH': os.defpath, **{name: os.environ[name] for name in inherited}})
    assert 'height 2.0, yaw 0.0' in started
