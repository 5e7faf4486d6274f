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

"""The films of the README: their bricks, and what the script says where it can not film."""

from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
import os
from pathlib import Path
import signal
import subprocess
import sys

import psutil
import pytest
from turtle_brick.core.parameters import load
from turtle_brick.physics import Phase
from turtle_brick.tools.simulation import drops

SCRIPT = Path(__file__).resolve().parents[2] / 'scripts' / 'record_rviz'


@pytest.fixture(scope='module')
def record_rviz():
    """Return the script as a module."""
    spec = spec_from_loader('record_rviz', SourceFileLoader('record_rviz', str(SCRIPT)))
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def make_program(directory, name, script=''):
    """Make a program that leaves its process id beside it, and runs a script."""
    path = directory / name
    path.write_text(f'#!/bin/bash\necho $$ > {path}.pid\n{script}\n')
    path.chmod(0o755)


def test_one_brick_is_caught_and_one_is_not_with_time_to_spare(record_rviz):
    caught, unreachable = drops(load(), [film.brick for film in record_rviz.FILMS])
    assert caught.caught and caught.decision.margin > 0.1
    assert not unreachable.decision.reachable and unreachable.decision.margin < -0.3


def test_the_films_wait_for_words_that_the_arena_says(record_rviz):
    words = {event.partition(': ')[2] for film in record_rviz.FILMS for event in film.events
             if event.startswith('brick')}
    assert words == {phase.value for phase in Phase}


@pytest.mark.parametrize('there, sentence', [
    ((), 'rviz2 and Xvfb and xdotool and ffmpeg not installed '
     'here: apt-get install ros-jazzy-rviz2 xvfb xdotool ffmpeg'),
    (('Xvfb', 'xdotool', 'ffmpeg'), 'rviz2 not installed here: apt-get install ros-jazzy-rviz2'),
])
def test_what_is_missing_is_said_in_a_sentence(
        record_rviz, there, sentence, tmp_path, monkeypatch, capsys):
    for name in there:
        make_program(tmp_path, name)
    monkeypatch.setenv('PATH', str(tmp_path))
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    assert record_rviz.main([str(tmp_path)]) == 1
    assert capsys.readouterr() == ('', f'record_rviz: {sentence}\n')


def test_an_interrupt_leaves_nothing_behind(tmp_path):
    """Of the screen, of what is launched, and of what that has started."""
    output = tmp_path / 'output'
    output.mkdir()
    make_program(tmp_path, 'Xvfb', 'echo 7; exec sleep 60')
    make_program(tmp_path, 'node', f'echo launched > {tmp_path}/fifo; exec sleep 60')
    make_program(tmp_path, 'ros2', 'node & exec sleep 60')
    for name in ('xdotool', 'ffmpeg'):
        make_program(tmp_path, name)
    index = tmp_path / 'share' / 'ament_index' / 'resource_index' / 'packages'
    index.mkdir(parents=True)
    (index / 'rviz2').touch()
    os.mkfifo(tmp_path / 'fifo')
    with subprocess.Popen(
            [sys.executable, str(SCRIPT), str(output)],
            env={**os.environ, 'PATH': f'{tmp_path}:{os.environ["PATH"]}', 'TMPDIR': str(output),
                 'AMENT_PREFIX_PATH': f'{tmp_path}:{os.environ["AMENT_PREFIX_PATH"]}',
                 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))},
            stderr=subprocess.PIPE, text=True) as process:
        assert (tmp_path / 'fifo').read_text() == 'launched\n'
        process.send_signal(signal.SIGTERM)
        assert process.communicate(timeout=30.0)[1] == ''
    assert process.returncode == 0
    for name in ('Xvfb', 'ros2', 'node'):
        pid = int((tmp_path / f'{name}.pid').read_text())
        assert not psutil.pid_exists(pid) or psutil.Process(pid).status() == 'zombie'
    assert not list(output.iterdir())
