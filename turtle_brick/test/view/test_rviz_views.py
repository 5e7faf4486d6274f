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
"""What rviz shows: our views start near the robot, and the films of the README show two bricks."""

from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from itertools import product
from math import cos, pi, sin
from pathlib import Path

from perspective import seen_from
import pytest
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.geometry import Vector
from turtle_brick.core.parameters import default_path, load
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.physics import Phase
from turtle_brick.tools.simulation import drops
import yaml

CONFIG = default_path().parent
SCRIPT = Path(__file__).resolve().parents[2] / 'scripts' / 'record_rviz'
PARAMETERS = load()

FIELD_OF_VIEW = pi / 4.0
"""Ogre's default (rad)."""

FRAME = 40, 91
"""Width and height of what a window has around the 3D view: bars and edges."""

PANEL = 340
"""Width of the Displays panel."""

record_rviz = module_from_spec(spec_from_loader(
    'record_rviz', SourceFileLoader('record_rviz', str(SCRIPT))))
record_rviz.__spec__.loader.exec_module(record_rviz)


def read(name: str) -> dict:
    """Return a configuration of the package."""
    return yaml.safe_load((CONFIG / f'{name}.rviz').read_text('utf-8'))


def view_of(content: dict) -> dict:
    """Return the view of a configuration."""
    return content['Visualization Manager']['Views']['Current']


def size_of(content: dict) -> tuple[int, int]:
    """Return width and height of the 3D view (pixels)."""
    window = content['Window Geometry']
    panel = PANEL if content['Panels'] else 0
    return window['Width'] - panel - FRAME[0], window['Height'] - FRAME[1]


def seen(content: dict, point: Vector) -> float:
    """See that an Orbit view shows a point of its frame (m); return how high, in heights."""
    view = view_of(content)
    yaw, pitch, distance = view['Yaw'], view['Pitch'], view['Distance']
    x, y, z = look_at = tuple(view['Focal Point'][axis] for axis in 'XYZ')
    position = (x + distance * cos(yaw) * cos(pitch), y + distance * sin(yaw) * cos(pitch),
                z + distance * sin(pitch))
    right, up = seen_from(position, look_at, FIELD_OF_VIEW, point)
    width, height = size_of(content)
    assert abs(right) < width / height / 2.0 and abs(up) < 0.5
    return up


def height_at(content: dict, x: float, y: float) -> float:
    """Return the height (pixels) of the robot at a place, where all of it is seen."""
    return size_of(content)[1] * (seen(content, (x, y, PARAMETERS.platform_height))
                                  - seen(content, (x, y, 0.0)))


@pytest.mark.parametrize('name', ['show_turtle', 'run_turtle'])
def test_the_robot_takes_a_quarter_of_the_height_wherever_it_is(name):
    content = read(name)
    target = view_of(content)['Target Frame'].replace(
        '<Fixed Frame>', content['Visualization Manager']['Global Options']['Fixed Frame'])
    assert target == 'base_link'
    assert height_at(content, 0.0, 0.0) > size_of(content)[1] / 4


def test_the_arena_shows_the_brick_at_its_start_and_a_robot_near_enough_to_see_it_roll():
    content = read('turtle_arena')
    x, y, z = PARAMETERS.brick_start
    assert view_of(content)['Target Frame'] == '<Fixed Frame>'
    seen(content, (x, y, z + PARAMETERS.brick_size[2] / 2))
    assert height_at(content, *CENTER) > size_of(content)[1] / 6
    assert height_at(content, x, y) > size_of(content)[1] / 6


def test_the_videos_show_all_walls_then_both_bricks_and_a_robot_of_a_quarter_of_their_height():
    content = record_rviz.configuration()
    for corner in product((0.0, ARENA_SIZE), repeat=2):
        seen(content, (*corner, PARAMETERS.wall_height))
    view_of(content)['Distance'] *= 0.99 ** record_rviz.DRAG
    for film in record_rviz.FILMS:
        x, y, z = film.brick
        seen(content, (x, y, z + PARAMETERS.brick_size[2] / 2))
        seen(content, (x, y, 0.0))
    caught = record_rviz.FILMS[0]
    for place in (CENTER, caught.brick[:2]):
        assert height_at(content, *place) > size_of(content)[1] / 4


def test_one_brick_is_caught_and_one_is_not_with_time_to_spare():
    caught, unreachable = drops(load(), [film.brick for film in record_rviz.FILMS])
    assert caught.caught and caught.decision.margin > 0.1
    assert not unreachable.decision.reachable and unreachable.decision.margin < -0.3


def test_the_films_wait_for_words_that_the_arena_says():
    words = {event.partition(': ')[2] for film in record_rviz.FILMS for event in film.events
             if event.startswith('brick')}
    assert words == {phase.value for phase in Phase}


def test_what_is_missing_is_said_in_a_sentence(tmp_path, monkeypatch, capsys):
    (tmp_path / 'ffmpeg').touch(0o755)
    monkeypatch.setenv('PATH', str(tmp_path))
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    assert record_rviz.main([str(tmp_path)]) == 1
    assert capsys.readouterr() == (
        '', 'record_rviz: rviz2 and Xvfb and xdotool not installed here: apt-get install '
        'ros-jazzy-rviz2 xvfb xdotool\n')
