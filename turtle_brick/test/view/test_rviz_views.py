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

from math import cos
from math import pi
from math import sin
from math import tan

import pytest
from turtle_brick.catching import CENTER
from turtle_brick.geometry import Vector
from turtle_brick.parameters import default_path
from turtle_brick.parameters import load
import yaml

CONFIG = default_path().parent
PARAMETERS = load()

#: Half the height of the picture per distance, at Ogre's default field of view of 45 degrees.
HALF_HEIGHT = tan(pi / 8)

#: Width per height of the 3D view in a window of 1300 by 800, with the Displays panel.
ASPECT = 920 / 709


def manager(name: str) -> dict:
    """Return what a configuration says of displays and view."""
    return yaml.safe_load((CONFIG / f'{name}.rviz').read_text('utf-8'))['Visualization Manager']


def seen(view: dict, point: Vector) -> tuple[float, float]:
    """
    Return where a point is in the picture of an Orbit view.

    :param view: the view
    :param point: in the view's target frame (m)
    :return: To the right and up from the center, in half heights of the picture.
    """
    yaw, pitch = view['Yaw'], view['Pitch']
    x, y, z = (point[i] - view['Focal Point'][axis] for i, axis in enumerate('XYZ'))
    inward = x * cos(yaw) + y * sin(yaw)
    depth = view['Distance'] - inward * cos(pitch) - z * sin(pitch)
    assert depth > 0
    right, up = y * cos(yaw) - x * sin(yaw), z * cos(pitch) - inward * sin(pitch)
    return right / depth / HALF_HEIGHT, up / depth / HALF_HEIGHT


def height_at(view: dict, x: float, y: float) -> float:
    """Return the height of the robot at a place, all of which is seen, of that of the picture."""
    bottom, top = (seen(view, (x, y, z)) for z in (0.0, PARAMETERS.platform_height))
    for right, up in (bottom, top):
        assert abs(right) < ASPECT and abs(up) < 1.0
    return (top[1] - bottom[1]) / 2


@pytest.mark.parametrize('name', ['show_turtle', 'run_turtle'])
def test_the_robot_takes_a_quarter_of_the_height_wherever_it_is(name):
    configuration = manager(name)
    view = configuration['Views']['Current']
    target = view['Target Frame'].replace(
        '<Fixed Frame>', configuration['Global Options']['Fixed Frame'])
    assert target == 'base_link'
    assert height_at(view, 0.0, 0.0) >= 0.25


def test_the_arena_shows_the_brick_at_its_start_and_a_robot_near_enough_to_see_it_roll():
    view = manager('turtle_arena')['Views']['Current']
    assert view['Target Frame'] == '<Fixed Frame>'
    x, y, z = PARAMETERS.brick_start
    right, up = seen(view, (x, y, z + PARAMETERS.brick_size[2] / 2))
    assert abs(right) < ASPECT and abs(up) < 1.0
    assert height_at(view, *CENTER) > 1 / 6
    assert height_at(view, x, y) > 1 / 6
