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
from pathlib import Path

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


def test_one_brick_is_caught_and_one_is_not_with_time_to_spare(record_rviz):
    caught, unreachable = drops(load(), [film.brick for film in record_rviz.FILMS])
    assert caught.caught and caught.decision.margin > 0.1
    assert not unreachable.decision.reachable and unreachable.decision.margin < -0.3


def test_the_films_wait_for_words_that_the_arena_says(record_rviz):
    words = {event.partition(': ')[2] for film in record_rviz.FILMS for event in film.events
             if event.startswith('brick')}
    assert words == {phase.value for phase in Phase}


def test_what_is_missing_is_said_in_a_sentence(record_rviz, tmp_path, monkeypatch, capsys):
    (tmp_path / 'ffmpeg').touch(0o755)
    monkeypatch.setenv('PATH', str(tmp_path))
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    assert record_rviz.main([str(tmp_path)]) == 1
    assert capsys.readouterr() == (
        '', 'record_rviz: rviz2 and Xvfb and xdotool not installed here: apt-get install '
        'ros-jazzy-rviz2 xvfb xdotool\n')
