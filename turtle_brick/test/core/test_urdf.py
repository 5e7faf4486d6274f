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
"""The robot's description: what it shows, and that it has the rules of core.parameters."""

from math import atan2, copysign, hypot, inf, nan, nextafter, pi, sin
from random import Random

from hypothesis import given
from hypothesis import strategies as st
from laws import law
import numpy as np
import pytest
from test_parameters import DEFAULTS, written
from turtle_brick.core.parameters import least_height
from turtle_brick.core.parameters import default_path, load, PARAMETER_RULES, ParameterError
from turtle_referee.rules.robot_model import RobotModel
import xacro

XACRO = default_path().parents[1] / 'urdf' / 'turtle.urdf.xacro'
SHAPE = ('platform_height', 'platform_radius', 'platform_thickness', 'wheel_radius')
UP, DOWN = (0, 0, 1), (0, 0, -1)


class Robot(RobotModel):
    """A URDF whose joints can be turned, and how far its links reach."""

    def extent(self, link, direction, **positions):
        """Return how far a link reaches in a direction of base_link."""
        reaches = []
        for solid in self.links[link]:
            pose = self.pose(link, positions).compose(solid.pose)
            x, y, z = local = pose.axes.T @ direction
            match solid.kind:
                case 'box':
                    beyond = np.abs(local) @ solid.size / 2
                case 'cylinder':
                    beyond = solid.size[0] * hypot(x, y) + solid.size[1] / 2 * abs(z)
                case 'sphere':
                    (beyond,) = solid.size
            reaches.append(direction @ pose.position + beyond)
        return max(reaches)


def described(path):
    """Return what xacro makes of a parameter file."""
    return xacro.process_file(str(XACRO), mappings={'params_file': str(path)}).toxml()


def verdicts(path):
    """Return the sentences with which Python and xacro refuse a file; None is an admission."""
    python = from_xacro = None
    try:
        load(path)
    except ParameterError as error:
        python = str(error)
    try:
        described(path)
    except xacro.XacroException as error:
        from_xacro = str(error).split('\nwhen evaluating')[0].strip()
    return python, from_xacro


@pytest.fixture(scope='module')
def robot():
    """Return the robot of the installed parameters."""
    return Robot(xacro.process_file(str(XACRO)).toxml())


def test_links_and_joints_are_those_of_the_assignment(robot):
    joints = {joint.name: (joint.kind, joint.parent, joint.child, *joint.axis * joint.movable)
              for joint in robot.joints}
    assert joints.items() >= {
        'stem_joint': ('continuous', 'base_link', 'stem', 0, 0, 1),
        'wheel_joint': ('continuous', 'stem', 'wheel', 0, 1, 0),
        'post_joint': ('fixed', 'base_link', 'post', 0, 0, 0),
        'platform_joint': ('continuous', 'post', 'platform', 0, 1, 0)}.items()
    # A link that the assignment names has the one shape that it names.
    for link in ('stem', 'wheel', 'post', 'platform'):
        assert [solid.kind for solid in robot.links[link]] == ['cylinder']
    (cube,) = robot.links['base_link']
    assert cube.kind == 'box' and len(set(cube.size)) == 1, 'a cube'


def test_positive_tilt_lowers_the_front_and_positive_roll_goes_forward(robot):
    front = robot.pose('platform', {'platform_joint': 0.3}).axes[:, 0]
    assert front[2] == pytest.approx(-sin(0.3))
    # What is on top of the wheel goes where the stem points.
    for turn, axis in ((0.0, 0), (pi / 2, 1)):
        assert robot.pose('wheel', {'stem_joint': turn, 'wheel_joint': 1e-3}).upright[axis] > 0


@law(4)
@given(st.floats(0.03, 2.0), st.floats(0.34, 19.0), st.floats(0.01, 1.0),
       st.just(1e-6) | st.floats(0.0, 10.0))
def test_geometry_follows_from_the_parameters(tmp_path_factory, wheel, proportion, flatness,
                                              spare):
    """From the ground up nothing overlaps, everything has a size, and the platform turns over."""
    radius = min(proportion * wheel, 10.0)
    thickness = min(max(flatness * radius, 0.001), 10.0)
    height = least_height(radius, thickness, wheel) + spare
    robot = Robot(described(written(
        tmp_path_factory.getbasetemp(),
        {**DEFAULTS, **dict(zip(SHAPE, (height, radius, thickness, wheel)))})))
    for turn in (0.0, 0.4, 2.0):
        angles = {'stem_joint': turn, 'wheel_joint': 2.7 * turn}
        assert robot.extent('wheel', DOWN, **angles) == pytest.approx(0, abs=1e-9)
    assert robot.pose('wheel').position == pytest.approx((0, 0, wheel))
    wheel_top = robot.extent('wheel', UP)
    assert wheel_top == pytest.approx(2 * wheel)

    hinge = height - thickness
    assert robot.extent('platform', UP) == pytest.approx(height, abs=1e-9)
    assert -robot.extent('platform', DOWN) == pytest.approx(hinge, abs=1e-9)
    assert robot.extent('platform', (1, 0, 0)) == pytest.approx(radius)
    assert robot.pose('platform').position == pytest.approx((0, 0, hinge), abs=1e-9)
    assert robot.extent('post', UP) == pytest.approx(hinge, abs=1e-9)

    cube_bottom, cube_top = -robot.extent('base_link', DOWN), robot.extent('base_link', UP)
    assert cube_top - cube_bottom >= max(0.499 * wheel, radius / 12)
    # Nearest when its rim points down.
    for angle in (atan2(radius, thickness), *np.linspace(-pi, pi, 13)):
        assert -robot.extent('platform', DOWN, platform_joint=angle) > cube_top
    # The post stands on the cube, the stem hangs from it.
    assert -robot.extent('post', DOWN) == pytest.approx(cube_top, abs=1e-9)
    assert robot.extent('stem', UP) == pytest.approx(cube_bottom, abs=1e-9)
    assert wheel_top < -robot.extent('stem', DOWN)


def telling():
    """Yield changes of the parameters, admissible and not."""
    yield from ({}, {'platform_height': 3}, {'platform_height': 0.9},
                {'wheel_radius': 0.025}, {'wheel_radius': nextafter(0.025, 0)},
                {'wheel_radius': 1.5, 'platform_height': 9.0},
                {'wheel_radius': nextafter(1.5, 2), 'platform_height': 9.0},
                {'platform_radius': ..., 'platfrom_radius': 1}, {'wheel_radius': ..., 'wheel': 1})
    for name in SHAPE:
        yield {name: ...}
        yield {name: nextafter(PARAMETER_RULES[name].lower, -inf)}
        yield {name: nextafter(PARAMETER_RULES[name].upper, inf)}
    for value in (1, 10 ** 309, nan, True, None, '3', [1.0]):
        yield {'platform_thickness': value}
    random = Random(1)
    for ulps in (-2, 0, 1):
        wheel, radius, thickness = (random.uniform(*limits) for limits in (
            (0.3, 0.8), (0.4, 1.0), (0.02, 0.5)))
        height = least_height(radius, thickness, wheel)
        for _ in range(abs(ulps)):
            height = nextafter(height, copysign(inf, ulps))
        yield dict(zip(SHAPE, (height, radius, thickness, wheel)))


def test_python_and_xacro_give_the_same_verdicts(tmp_path):
    admitted = 0
    for changes in telling():
        python, from_xacro = verdicts(written(tmp_path, {**DEFAULTS, **changes}))
        assert python == from_xacro, changes
        admitted += python is None
    assert admitted == 7
    # What does not shape the robot is left to the nodes.
    shape = {name: DEFAULTS[name] for name in SHAPE}
    assert verdicts(written(tmp_path, {**shape, 'mass': 3.0}))[1] is None
    for text in ('', '3', '/**: 3', '/**:\n  ros__parameters:', 'arena: {ros__parameters: {}}'):
        path = written(tmp_path, text)
        sentence = f"{path}: there are no parameters under '/**: ros__parameters:'"
        assert verdicts(path) == (sentence, sentence)
