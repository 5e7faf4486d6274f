# SPDX-License-Identifier: Apache-2.0
"""Test that processes end with the program that started them, and that imports end quietly."""

import os
import signal
import subprocess
import sys

from installed import is_standin
from live_graph import process, TIMEOUT
import psutil
import pytest
from turtle_brick_tools.graph import executable

WAIT = 'import os, signal; print("up", os.getpid(), flush=True); signal.pause()'
"""Program that prints its process ID and waits for a signal."""

PROCESS = """
import signal, sys
from turtle_graph.client.processes import Process
with Process([sys.executable, '-c', sys.argv[1]], listener=sys.stdout.write) as process:
    signal.pause()
"""

LAUNCH = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import ExecuteProcess
service = LaunchService()
service.include_launch_description(LaunchDescription([
    ExecuteProcess(cmd=[sys.executable, '-c', sys.argv[1]], output='screen')]))
service.run()
"""


@pytest.mark.parametrize('program', [PROCESS, pytest.param(LAUNCH, marks=pytest.mark.skipif(
    not is_standin('launch'), reason='the installed launch is the real one'))])
def test_a_killed_program_leaves_no_process(domain_id, program):
    with process([sys.executable, '-c', program, WAIT], domain_id, stop=None) as running:
        child = psutil.Process(int(running.wait_for_output(r'up (\d+)', TIMEOUT)[1]))
        running.send(signal.SIGKILL)
        assert running.wait(TIMEOUT) == -signal.SIGKILL
        child.wait(TIMEOUT)


@pytest.mark.parametrize('package, name, status', [
    *(('turtle_brick', name, 0) for name in ('arena', 'catcher', 'turtle_robot')),
    *(('turtle_graph', name, -signal.SIGINT) for name in ('referee', 'viewer')),
    *(('turtle_brick_tools', name, -signal.SIGINT) for name in ('benchmark', 'demo', 'sweep'))])
def test_ctrl_c_during_the_imports_prints_no_traceback(tmp_path, package, name, status):
    for module in ('rclpy', 'numpy', 'joblib'):
        (tmp_path / f'{module}.py').write_text('import signal\nsignal.raise_signal(signal.SIGINT)')
    done = subprocess.run(
        [executable(package, name)], text=True, capture_output=True,
        env={**os.environ, 'PYTHONPATH': f'{tmp_path}:{os.environ["PYTHONPATH"]}'})
    assert (done.returncode, done.stdout, done.stderr) == (status, '', '')
