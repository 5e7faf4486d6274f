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
"""The views of the rviz configurations start near the robot, and show what there is to see."""

from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from math import cos, pi, sin, tan
from pathlib import Path

import pytest
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.geometry import Vector
from turtle_brick.core.parameters import default_path, load
import yaml

SCRIPT = Path(__file__).resolve().parents[2] / 'scripts' / 'record_rviz'
loader = SourceFileLoader('record_rviz', str(SCRIPT))
record_rviz = module_from_spec(spec_from_loader('record_rviz', loader))
loader.exec_module(record_rviz)

CONFIG = default_path().parent
PARAMETERS = load()

#: Half the height of the picture per distance, at Ogre's default field of view of 45 degrees.
HALF_HEIGHT = tan(pi / 8)

#: Width and height of what a window has around the 3D view: the Displays panel, bars and edges.
FRAME = 380, 91


def read(name: str) -> dict:
    """Return a configuration of the package."""
    return yaml.safe_load((CONFIG / f'{name}.rviz').read_text('utf-8'))


def view_of(content: dict) -> dict:
    """Return the view of a configuration."""
    return content['Visualization Manager']['Views']['Current']


def size_of(content: dict) -> tuple[int, int]:
    """Return width and height of the 3D view (pixels)."""
    window = content['Window Geometry']
    return window['Width'] - FRAME[0], window['Height'] - FRAME[1]


def seen(content: dict, point: Vector) -> float:
    """
    See that a point is in the picture of an Orbit view, and return where.

    :param content: the configuration
    :param point: in the view's target frame (m)
    :return: How far it is up from the center, in half heights of the picture.
    """
    view = view_of(content)
    yaw, pitch = view['Yaw'], view['Pitch']
    x, y, z = (point[i] - view['Focal Point'][axis] for i, axis in enumerate('XYZ'))
    inward = x * cos(yaw) + y * sin(yaw)
    depth = view['Distance'] - inward * cos(pitch) - z * sin(pitch)
    assert depth > 0
    right, up = y * cos(yaw) - x * sin(yaw), z * cos(pitch) - inward * sin(pitch)
    width, height = size_of(content)
    assert abs(right) / depth / HALF_HEIGHT < width / height
    assert abs(up) / depth / HALF_HEIGHT < 1.0
    return up / depth / HALF_HEIGHT


def height_at(content: dict, x: float, y: float) -> float:
    """Return the height (pixels) of the robot at a place, where all of it is seen."""
    top, bottom = (seen(content, (x, y, z)) for z in (PARAMETERS.platform_height, 0.0))
    return (top - bottom) / 2 * size_of(content)[1]


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


def test_the_videos_show_both_bricks_and_a_robot_of_a_quarter_of_their_height():
    content = record_rviz.configuration()
    for film in record_rviz.FILMS:
        x, y, z = film.brick
        seen(content, (x, y, z + PARAMETERS.brick_size[2] / 2))
        seen(content, (x, y, 0.0))
    caught = record_rviz.FILMS[0]
    for place in (CENTER, caught.brick[:2]):
        assert height_at(content, *place) > record_rviz.SIZE[1] / 4


def test_the_window_of_the_videos_stands_beside_that_of_turtlesim():
    window = record_rviz.configuration()['Window Geometry']
    assert (window['X'], window['Y']) == (record_rviz.TURTLESIM_SIZE, 0)
    assert (window['X'] + window['Width'], window['Height']) == record_rviz.SIZE
