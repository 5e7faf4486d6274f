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

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from itertools import product
import math
from pathlib import Path
from random import Random
import re
import subprocess
import sys
from xml.etree import ElementTree

from hypothesis import given
from hypothesis import strategies as st
from laws import law
import numpy as np
import pytest
from turtle_brick.core.dimensions import least_height
from turtle_brick.core.parameters import default_path, load, ParameterError, TABLE
from turtle_brick.tools.description import robot_description
import xacro
import yaml

XACRO = default_path().parents[1] / 'urdf' / 'turtle.urdf.xacro'
SHAPE = ('platform_height', 'platform_radius', 'platform_thickness', 'wheel_radius')
DEFAULTS = {name: list(value) if isinstance(value, tuple) else value
            for name, value in asdict(load()).items()}


# A small, independent reading of URDF: homogeneous transforms and the extent of primitives.

def numbers(element: ElementTree.Element | None, name: str) -> np.ndarray:
    """Return an attribute's three numbers, zeros by default."""
    text = '0 0 0' if element is None else element.get(name, '0 0 0')
    return np.array([float(part) for part in text.split()])


def transform(xyz: np.ndarray, rpy: np.ndarray) -> np.ndarray:
    """Return the matrix of an offset and URDF's fixed-axis roll, pitch and yaw."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = about_z @ about_y @ about_x, xyz
    return matrix


def origin_of(element: ElementTree.Element) -> np.ndarray:
    """Return the transform of a joint, visual or collision to its parent."""
    origin = element.find('origin')
    return transform(numbers(origin, 'xyz'), numbers(origin, 'rpy'))


def reach(geometry: ElementTree.Element, pose: np.ndarray, direction: tuple) -> float:
    """Return the support function of a primitive: its greatest coordinate in a direction."""
    local = pose[:3, :3].T @ direction
    if geometry.tag == 'box':
        beyond = np.abs(local) @ numbers(geometry, 'size') / 2
    elif geometry.tag == 'cylinder':
        beyond = (float(geometry.get('radius')) * math.hypot(local[0], local[1])
                  + float(geometry.get('length')) / 2 * abs(local[2]))
    else:
        assert geometry.tag == 'sphere', 'only primitives'
        beyond = float(geometry.get('radius'))
    return direction @ pose[:3, 3] + beyond


class Robot:
    """A URDF whose joints can be turned."""

    def __init__(self, urdf: str) -> None:
        self.root = ElementTree.fromstring(urdf)
        self.links = {link.get('name'): link for link in self.root.findall('link')}
        self.joints = {joint.get('name'): joint for joint in self.root.findall('joint')}
        self.parents = {
            joint.find('child').get('link'): joint for joint in self.joints.values()}

    def pose(self, link: str, **angles: float) -> np.ndarray:
        """Return the transform from a link to base_link at the joints' angles."""
        joint = self.parents.get(link)
        if joint is None:
            return np.eye(4)
        turn = numbers(joint.find('axis'), 'xyz') * angles.get(joint.get('name'), 0.0)
        parent = self.pose(joint.find('parent').get('link'), **angles)
        return parent @ origin_of(joint) @ transform(np.zeros(3), turn)

    def shapes(self, link: str, kind: str = 'visual') -> Iterator[tuple]:
        """Yield a link's shapes: a geometry and its transform to the link."""
        for element in self.links[link].findall(kind):
            (geometry,) = element.find('geometry')
            yield geometry, origin_of(element)

    def extent(self, link: str, direction: tuple, **angles: float) -> float:
        """Return how far a link reaches in a direction of base_link, to rounding."""
        pose = self.pose(link, **angles)
        return max(reach(geometry, pose @ origin, direction)
                   for geometry, origin in self.shapes(link))


def written(directory: Path, **changes: object) -> Path:
    """Write a parameter file with changes, Ellipsis for what is left out; return its path."""
    section = {name: value for name, value in {**DEFAULTS, **changes}.items()
               if value is not ...}
    path = directory / 'turtle.yaml'
    path.write_text(yaml.safe_dump({'/**': {'ros__parameters': section}}), encoding='utf-8')
    return path


def described(path: Path) -> str:
    """Return what xacro makes of a parameter file."""
    return xacro.process_file(str(XACRO), mappings={'params_file': str(path)}).toxml()


def verdicts(path: Path) -> tuple[str | None, str | None]:
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
def robot() -> Robot:
    """Return the robot of the installed parameters."""
    return Robot(xacro.process_file(str(XACRO)).toxml())


def test_links_and_joints_are_those_of_the_assignment(robot):
    tree = {name: (joint.get('type'), joint.find('parent').get('link'),
                   joint.find('child').get('link'),
                   None if joint.find('axis') is None else joint.find('axis').get('xyz'))
            for name, joint in robot.joints.items()}
    assert tree == {
        'stem_joint': ('continuous', 'base_link', 'stem', '0 0 1'),
        'wheel_joint': ('continuous', 'stem', 'wheel', '0 1 0'),
        'post_joint': ('fixed', 'base_link', 'post', None),
        'platform_joint': ('continuous', 'post', 'platform', '0 1 0'),
        # Adornments.
        'eyes_joint': ('fixed', 'base_link', 'eyes', None),
        'pupils_joint': ('fixed', 'base_link', 'pupils', None),
        'fork_joint': ('fixed', 'stem', 'fork', None),
        'spokes_joint': ('fixed', 'wheel', 'spokes', None),
    }
    assert set(robot.links) == {'base_link'} | {child for _, _, child, _ in tree.values()}
    # A link that the assignment names has the one shape that it names.
    tags = {link: [geometry.tag for geometry, _ in robot.shapes(link)] for link in (
        'base_link', 'stem', 'wheel', 'post', 'platform')}
    assert list(tags.values()) == [['box']] + 4 * [['cylinder']]
    ((cube, _),) = robot.shapes('base_link')
    assert len(set(numbers(cube, 'size'))) == 1, 'a cube'


def test_what_is_seen_is_solid_and_each_link_has_its_own_color(robot):
    colors = {material.get('name'): material.find('color').get('rgba')
              for material in robot.root.findall('material')}
    used = []
    for link, element in robot.links.items():
        seen, solid = ([(geometry.tag, geometry.attrib, pose.tolist())
                        for geometry, pose in robot.shapes(link, kind)]
                       for kind in ('visual', 'collision'))
        assert seen == solid
        assert seen
        for _, sizes, _ in seen:
            assert min(float(size) for text in sizes.values() for size in text.split()) > 0
        # rviz paints all of a link in the color of its first shape.
        (name,) = {material.get('name') for material in element.findall('visual/material')}
        used.append(colors[name])
    assert len(set(used)) == len(used) == len(colors)


def test_positive_tilt_lowers_the_front_and_positive_roll_goes_forward(robot):
    radius = DEFAULTS['platform_radius']
    tilted = robot.pose('platform', platform_joint=0.3)
    assert tilted[2, 0] * radius == pytest.approx(-radius * math.sin(0.3))
    # What is on top of the wheel goes where the stem points.
    for turn, axis in ((0.0, 0), (math.pi / 2, 1)):
        pose = robot.pose('wheel', stem_joint=turn, wheel_joint=1e-3)
        assert pose[axis, 2] > 0


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
        tmp_path_factory.getbasetemp(), platform_height=height, platform_radius=radius,
        platform_thickness=thickness, wheel_radius=wheel)))
    up, left, down = (0, 0, 1), (0, 1, 0), (0, 0, -1)
    for turn in (0.0, 0.4, 2.0):
        angles = {'stem_joint': turn, 'wheel_joint': 2.7 * turn}
        assert robot.extent('wheel', down, **angles) == pytest.approx(0, abs=1e-9)
        assert robot.extent('spokes', down, **angles) < 0, 'above the ground'
    assert robot.pose('wheel')[:3, 3] == pytest.approx((0, 0, wheel))
    wheel_top = robot.extent('wheel', up)
    assert wheel_top == pytest.approx(2 * wheel)

    hinge = height - thickness
    assert robot.extent('platform', up) == pytest.approx(height, abs=1e-9)
    assert -robot.extent('platform', down) == pytest.approx(hinge, abs=1e-9)
    assert robot.extent('platform', (1, 0, 0)) == pytest.approx(radius)
    assert robot.pose('platform')[:3, 3] == pytest.approx((0, 0, hinge), abs=1e-9)
    assert robot.extent('post', up) == pytest.approx(hinge, abs=1e-9)

    cube_bottom, cube_top = -robot.extent('base_link', down), robot.extent('base_link', up)
    assert cube_top - cube_bottom >= max(0.499 * wheel, radius / 12)
    # Nearest when its rim points down.
    for angle in (math.atan2(radius, thickness), *np.linspace(-math.pi, math.pi, 13)):
        assert -robot.extent('platform', down, platform_joint=angle) > cube_top
    assert robot.extent('fork', up) < cube_bottom
    assert max(robot.extent('eyes', up), robot.extent('pupils', up)) < cube_top
    # The post stands on the cube, the stem hangs from it, the fork holds the axle.
    assert -robot.extent('post', down) == pytest.approx(cube_top, abs=1e-9)
    assert robot.extent('stem', up) == pytest.approx(cube_bottom, abs=1e-9)
    assert wheel_top < -robot.extent('stem', down)
    assert 0 < -robot.extent('fork', down) < wheel
    # Under the fork's crown and between its blades the wheel turns freely.
    widest = max(robot.extent(link, left) for link in ('wheel', 'spokes'))
    for geometry, origin in (*robot.shapes('stem'), *robot.shapes('fork')):
        pose = robot.pose('stem') @ origin
        above = -reach(geometry, pose, down) - wheel_top
        beside = [-reach(geometry, pose, (0, side, 0)) - widest for side in (-1, 1)]
        assert max(above, *beside) > 0, geometry.attrib


def telling() -> Iterator[dict]:
    """Yield changes of the parameters, admissible and not."""
    yield from ({}, {'platform_height': 3}, {'wheel_radius': 0.35}, {'platform_height': 0.9},
                {'wheel_radius': 0.025}, {'wheel_radius': math.nextafter(0.025, 0)},
                {'wheel_radius': 1.5, 'platform_height': 9.0},
                {'wheel_radius': math.nextafter(1.5, 2), 'platform_height': 9.0},
                {'platform_radius': ..., 'platfrom_radius': 1}, {'wheel_radius': ..., 'wheel': 1})
    for name in SHAPE:
        yield {name: ...}
        yield {name: math.nextafter(TABLE[name].lower, -math.inf)}
        yield {name: math.nextafter(TABLE[name].upper, math.inf)}
    for value in (1, 10 ** 309, math.nan, True, None, '3', [1.0]):
        yield {'platform_thickness': value}
    random = Random(1)
    for size, ulps in product((1.0, 0.06), (-2, 0, 1)):
        wheel, radius, thickness = (size * random.uniform(*limits) for limits in (
            (0.3, 0.8), (0.4, 1.0), (0.02, 0.5)))
        height = least_height(radius, thickness, wheel)
        for _ in range(abs(ulps)):
            height = math.nextafter(height, math.copysign(math.inf, ulps))
        yield dict(zip(SHAPE, (height, radius, thickness, wheel)))


def test_python_and_xacro_give_the_same_verdicts(tmp_path):
    admitted = 0
    for changes in telling():
        python, from_xacro = verdicts(written(tmp_path, **changes))
        assert python == from_xacro, changes
        admitted += python is None
    assert admitted == 10
    # What does not shape the robot is left to the nodes.
    others = {name: ... for name in DEFAULTS if name not in SHAPE}
    assert verdicts(written(tmp_path, **others, mass=3.0))[1] is None


@pytest.mark.parametrize('text', [
    '', '3', '/**: 3', '/**:\n  ros__parameters:', 'arena:\n  ros__parameters: {mass: 0.2}'])
def test_file_without_parameters_is_refused(tmp_path, text):
    path = tmp_path / 'turtle.yaml'
    path.write_text(text, encoding='utf-8')
    python, from_xacro = verdicts(path)
    assert python == from_xacro == f"{path}: there are no parameters under '/**: ros__parameters:'"


def test_command_and_composed_graph_fail_with_the_sentence_first(tmp_path):
    """The command as the launch files run it, from any directory."""
    path = written(tmp_path, platform_height=0.9)
    code = 'import sys, xacro; sys.argv[0] = "xacro"; xacro.main()'
    ran = subprocess.run([sys.executable, '-c', code, str(XACRO), f'params_file:={path}'],
                         cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode != 0
    assert ran.stdout == ''
    assert re.match(f'error: {path}: platform_height 0.9 m is too low .* at least 1.1416 m',
                    ran.stderr)
    with pytest.raises(ValueError, match=f': {path}: platform_height 0.9 m .* 1.1416 m$'):
        robot_description(path)
