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
"""Test the links, joints and dimensions in the robot description."""

from math import atan2, hypot, nan, pi, sin
import re
from xml.etree import ElementTree

import pytest
from rigid import dot, Frame, X, Y, Z
from turtle_brick.core.parameters import default_path
import xacro
import yaml

XACRO = default_path().parents[1] / 'urdf' / 'turtle.urdf.xacro'
DEFAULTS = yaml.safe_load(default_path().read_text())['/**']['ros__parameters']
UP, DOWN = (0, 0, 1), (0, 0, -1)

SIZES = {'box': ('size',), 'cylinder': ('radius', 'length'), 'sphere': ('radius',)}
"""URDF attributes that define the size of each kind of geometry."""


def numbers(element, attribute):
    return tuple(map(float, element.get(attribute).split()))


def origin(element):
    """Return the origin of a joint or visual element. The rpy angles refer to fixed axes."""
    found = element.find('origin')
    place = (0.0, 0.0, 0.0) if found is None else numbers(found, 'xyz')
    roll, pitch, yaw = (0.0, 0.0, 0.0) if found is None or 'rpy' not in found.keys() else numbers(
        found, 'rpy')
    return Frame(place).turned(Z, yaw).turned(Y, pitch).turned(X, roll)


class Robot:
    """The solids and joints in a URDF."""

    def __init__(self, description):
        robot = ElementTree.fromstring(description)
        self.joints = {joint.find('child').get('link'): joint for joint in robot.iter('joint')}
        self.solids = {}
        for link in robot.iter('link'):
            (shape,) = link.find('visual/geometry')
            size = [number for name in SIZES[shape.tag] for number in numbers(shape, name)]
            self.solids[link.get('name')] = shape.tag, size, origin(link.find('visual'))

    def pose(self, link, **positions):
        """Return a link's frame in the base_link frame for given joint positions (rad)."""
        joint = self.joints.get(link)
        if joint is None:
            return Frame()
        frame = self.pose(joint.find('parent').get('link'), **positions).compose(origin(joint))
        if joint.find('axis') is None:
            return frame
        angle = positions.get(joint.get('name'), 0.0)
        return frame.turned(numbers(joint.find('axis'), 'xyz'), angle)

    def extent(self, link, direction, **positions):
        """Return the maximum coordinate (m) of a link along a direction in the base_link frame."""
        kind, size, place = self.solids[link]
        frame = self.pose(link, **positions).compose(place)
        x, y, z = local = [abs(dot(axis, direction)) for axis in frame.axes]
        beyond = (dot(local, size) / 2 if kind == 'box'
                  else size[0] * hypot(x, y) + size[1] / 2 * z)
        return dot(direction, frame.position) + beyond


@pytest.fixture(scope='module')
def robot():
    return Robot(xacro.process_file(str(XACRO)).toxml())


def written(folder, values):
    path = folder / 'turtle.yaml'
    path.write_text(yaml.safe_dump({'/**': {'ros__parameters': values}}))
    return path


def process(folder, **values):
    path = written(folder, {**DEFAULTS, **values})
    return Robot(xacro.process_file(str(XACRO), mappings={'params_file': str(path)}).toxml())


def refusal_of(folder, **values):
    with pytest.raises(xacro.XacroException) as refused:
        process(folder, **values)
    return str(refused.value)


def test_impossible_dimensions_are_refused_with_one_sentence(tmp_path):
    height = refusal_of(tmp_path, platform_height=0.9)
    assert re.search(r'In /\S*\.yaml, platform_height is 0.9 m, but must be at least 0.991597 m '
                     'so that', height)
    for wrong in ('0,2', -0.2, nan):
        value = refusal_of(tmp_path, wheel_radius=wrong)
        assert re.search(rf'In /\S*\.yaml, wheel_radius is {wrong}, but must be a positive number',
                         value)
    path = written(tmp_path, {'wheel_raduis': 0.2, **DEFAULTS})
    path.write_text(path.read_text().replace('wheel_radius', 'wheel'))
    with pytest.raises(xacro.XacroException, match='wheel_radius is missing in the parameter file'
                       '. Did you misspell it.*wheel_raduis'):
        xacro.process_file(str(XACRO), mappings={'params_file': str(path)})


@pytest.mark.parametrize('name, value', [
    *(('platform_height', height) for height in (1.06, 1.1, 1.3, 1.6, 2.0, 3.0)),
    *(('wheel_radius', radius) for radius in (0.05, 0.1, 0.2, 0.3, 0.4))])
def test_robot_is_recognizable_if_one_parameter_changes(tmp_path, name, value):
    solids = process(tmp_path, **{name: value}).solids
    _, (side, _, _), _ = solids['base_link']
    _, (post_radius, post_length), _ = solids['post']
    assert 0.1 <= side <= 0.5
    assert post_radius >= 0.02 and post_length >= 0.5
    assert post_radius < solids['stem'][1][0] * 2 < side


def test_links_and_joints_of_the_assignment(robot):
    joints = {joint.get('name'): (joint.get('type'), joint.find('parent').get('link'), child)
              for child, joint in robot.joints.items()}
    assert joints.items() >= {
        'stem_joint': ('continuous', 'base_link', 'stem'),
        'wheel_joint': ('continuous', 'stem', 'wheel'),
        'post_joint': ('fixed', 'base_link', 'post'),
        'platform_joint': ('continuous', 'post', 'platform')}.items()
    axes = {link: tuple(numbers(robot.joints[link].find('axis'), 'xyz'))
            for link in ('stem', 'wheel', 'platform')}
    assert axes == {'stem': (0, 0, 1), 'wheel': (0, 1, 0), 'platform': (0, 1, 0)}
    for link in ('stem', 'wheel', 'post', 'platform'):
        assert robot.solids[link][0] == 'cylinder'
    kind, size, _ = robot.solids['base_link']
    assert kind == 'box' and len(set(size)) == 1, 'a cube'


def test_positive_tilt_lowers_the_front_and_positive_roll_drives_forward(robot):
    front = robot.pose('platform', platform_joint=0.3).axes[0]
    assert front[2] == pytest.approx(-sin(0.3))
    # If the wheel rolls forward, its top moves in the direction in which the stem points.
    for angle, forward in ((0.0, 0), (pi / 2, 1)):
        assert robot.pose('wheel', stem_joint=angle, wheel_joint=1e-3).axes[2][forward] > 0


@pytest.mark.parametrize('wheel, radius, thickness, spare', [
    (0.2, 0.5, 0.04, 0.0), (0.03, 0.02, 0.02, 8.0), (0.03, 0.5, 0.001, 0.3), (2.0, 0.7, 0.6, 0.0),
    (2.0, 10.0, 0.1, 0.01), (0.4, 1.0, 1.0, 2.0)])
def test_geometry_follows_from_the_parameters(tmp_path, wheel, radius, thickness, spare):
    """Links do not overlap, each link has a positive size, and the platform can turn over."""
    dimensions = {'platform_radius': radius, 'platform_thickness': thickness,
                  'wheel_radius': wheel}
    refusal = refusal_of(tmp_path, platform_height=0.001, **dimensions)
    height = float(re.search('must be at least (.*) m so', refusal)[1]) * (1.0 + 1e-5) + spare
    robot = process(tmp_path, platform_height=height, **dimensions)
    for steering in (0.0, 0.4, 2.0):
        angles = {'stem_joint': steering, 'wheel_joint': 2.7 * steering}
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
    assert cube_top - cube_bottom >= 0.035
    assert robot.solids['post'][1][0] >= 0.07 * min(radius, cube_top - cube_bottom)
    for angle in (atan2(radius, -thickness), *(number * pi / 6 for number in range(-6, 7))):
        assert -robot.extent('platform', DOWN, platform_joint=angle) > cube_top
    assert -robot.extent('post', DOWN) == pytest.approx(cube_top, abs=1e-9)
    assert robot.extent('stem', UP) == pytest.approx(cube_bottom, abs=1e-9)
    assert wheel_top < -robot.extent('stem', DOWN)
