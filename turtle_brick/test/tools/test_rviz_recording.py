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
"""The videos of rviz2: what happens in them, what they need, and that nothing is left behind."""

import contextlib
import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import pytest
from turtle_brick.core.parameters import load
from turtle_brick.tools import rviz_recording
from turtle_brick.tools.rviz_recording import SCENES
from turtle_brick.tools.simulation import drops

PROGRAMS = ('Xvfb', 'ffmpeg')


def make_program(directory: Path, name: str, script: str = '') -> None:
    """Make a program that leaves its process id beside it, and runs a script."""
    path = directory / name
    path.write_text(f'#!/bin/bash\necho $$ > {path}.pid\n{script}\n')
    path.chmod(0o755)


def test_one_brick_is_caught_and_one_is_not_with_time_to_spare():
    caught, unreachable = drops(load(), [scene.brick for scene in SCENES])
    assert caught.caught and caught.decision.margin > 0.1
    assert not unreachable.decision.reachable and unreachable.decision.margin < -0.3


@pytest.mark.parametrize('there, sentence', [
    ((), 'rviz2 and Xvfb and ffmpeg not installed here: '
     'apt-get install ros-jazzy-rviz2 xvfb ffmpeg'),
    (('ffmpeg',), 'rviz2 and Xvfb not installed here: apt-get install ros-jazzy-rviz2 xvfb'),
    (PROGRAMS, 'rviz2 not installed here: apt-get install ros-jazzy-rviz2'),
])
def test_what_is_missing_is_said_in_a_sentence(there, sentence, tmp_path, monkeypatch, capsys):
    for name in there:
        make_program(tmp_path, name)
    monkeypatch.setenv('PATH', str(tmp_path))
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    assert rviz_recording.main([str(tmp_path)]) == 1
    assert capsys.readouterr() == ('', f'record_rviz: {sentence}\n')


def recorder(directory: Path) -> subprocess.Popen:
    """Start recording, with programs that are found in a directory first."""
    output = directory / 'output'
    output.mkdir()
    return subprocess.Popen(
        [sys.executable, '-c', 'import sys; from turtle_brick.tools import rviz_recording as r; '
         'r.missing = lambda: None; sys.exit(r.main(sys.argv[1:]))', str(output)],
        env={**os.environ, 'PATH': f'{directory}:{os.environ["PATH"]}', 'TMPDIR': str(output)},
        stderr=subprocess.PIPE, text=True)


def test_a_screen_that_does_not_start_is_said(tmp_path):
    make_program(tmp_path, 'Xvfb')
    with recorder(tmp_path) as process:
        assert process.communicate(timeout=30.0)[1] == 'record_rviz: Xvfb does not start\n'
    assert process.returncode == 1
    assert not list((tmp_path / 'output').iterdir())


def wait_for_end(pid: int) -> None:
    """Wait until a process is gone, which init may have to bury."""
    deadline = time.monotonic() + 5.0
    with contextlib.suppress(ProcessLookupError):
        while time.monotonic() < deadline:
            os.kill(pid, 0)
            time.sleep(0.01)
        pytest.fail(f'the process {pid} is still there')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_leaves_nothing_behind(number, tmp_path):
    make_program(tmp_path, 'Xvfb', 'echo 7 >&$2; exec sleep 60')
    # The real one can leave nodes behind, if it is interrupted while it evaluates a Command.
    make_program(tmp_path, 'node', f'echo launched > {tmp_path}/fifo; exec sleep 60')
    make_program(tmp_path, 'ros2', 'node & exec sleep 60')
    os.mkfifo(tmp_path / 'fifo')
    with recorder(tmp_path) as process:
        assert (tmp_path / 'fifo').read_text() == 'launched\n'
        process.send_signal(number)
        assert process.communicate(timeout=30.0)[1] == ''
    assert process.returncode == 0
    for name in ('Xvfb', 'ros2', 'node'):
        wait_for_end(int((tmp_path / f'{name}.pid').read_text()))
    assert not list((tmp_path / 'output').iterdir())
