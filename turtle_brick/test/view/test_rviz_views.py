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
"""What rviz shows: our views start near enough to the robot to see it roll."""

from math import cos, pi, sin

from perspective import seen_from
import pytest
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.geometry import Vector
from turtle_brick.core.parameters import default_path, load
import yaml

PARAMETERS = load()

FIELD_OF_VIEW = pi / 4.0
"""Ogre's default (rad)."""

AROUND = 40 + 340, 91
"""Width and height (pixels) of what a window has around the 3D view: the panel, bars and edges."""


class Config:
    """A configuration of the package."""

    def __init__(self, name: str) -> None:
        """Read it."""
        content = yaml.safe_load(default_path().with_name(f'{name}.rviz').read_text('utf-8'))
        self.view = content['Visualization Manager']['Views']['Current']
        self.fixed_frame = content['Visualization Manager']['Global Options']['Fixed Frame']
        window = content['Window Geometry']
        self.aspect = (window['Width'] - AROUND[0]) / (window['Height'] - AROUND[1])
        """Of the 3D view: its width in its heights."""

    def see(self, point: Vector) -> float:
        """See that its Orbit view shows a point of its frame (m); return how high, in heights."""
        yaw, pitch, distance = self.view['Yaw'], self.view['Pitch'], self.view['Distance']
        x, y, z = look_at = tuple(self.view['Focal Point'][axis] for axis in 'XYZ')
        position = (x + distance * cos(yaw) * cos(pitch), y + distance * sin(yaw) * cos(pitch),
                    z + distance * sin(pitch))
        right, up = seen_from(position, look_at, FIELD_OF_VIEW, point)
        assert abs(right) < self.aspect / 2.0 and abs(up) < 0.5
        return up

    def height_at(self, x: float, y: float) -> float:
        """Return the height of the robot, in those of the view, at a place where it is seen."""
        return self.see((x, y, PARAMETERS.platform_height)) - self.see((x, y, 0.0))


@pytest.mark.parametrize('name', ['show_turtle', 'run_turtle'])
def test_the_robot_takes_a_quarter_of_the_height_wherever_it_is(name):
    config = Config(name)
    assert config.view['Target Frame'].replace('<Fixed Frame>', config.fixed_frame) == 'base_link'
    assert config.height_at(0.0, 0.0) > 0.25


def test_the_arena_shows_the_brick_at_its_start_and_a_robot_near_enough_to_see_it_roll():
    config, (x, y, z) = Config('turtle_arena'), PARAMETERS.brick_start
    assert config.view['Target Frame'] == '<Fixed Frame>'
    config.see((x, y, z + PARAMETERS.brick_size[2] / 2))
    assert config.height_at(*CENTER) > 1.0 / 6.0 and config.height_at(x, y) > 1.0 / 6.0
