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
"""The robot's description: what xacro makes of any parameters, and when it refuses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from itertools import product
import math
import os
from pathlib import Path
import re
import subprocess
import sys
from types import SimpleNamespace
from xml.etree import ElementTree

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from turtle_brick.core.dimensions import least_room
from turtle_brick.core.parameters import (default_path, from_mapping, load, meaning,
                                          ParameterError, Parameters)
from turtle_brick.tools.graph import Graph
import xacro
import yaml

XACRO = default_path().parents[1] / 'urdf' / 'turtle.urdf.xacro'
SHAPE = ('platform_height', 'platform_radius', 'platform_thickness', 'wheel_radius')
RULES = {entry.name: meaning(entry) for entry in fields(Parameters)}
DEFAULTS = {name: list(value) if isinstance(value, tuple) else value
            for name, value in asdict(load()).items()}


# A small, independent reading of URDF: rigid transforms and the extent of primitives.

def rotation(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Return the matrix of URDF's fixed-axis roll, pitch and yaw."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def numbers(element: ElementTree.Element, name: str) -> np.ndarray:
    """Return an attribute's three numbers, zeros by default."""
    return np.array([float(part) for part in element.get(name, '0 0 0').split()])


@dataclass(frozen=True)
class Transform:
    """A rigid transform from a child frame to its parent."""

    matrix: np.ndarray
    offset: np.ndarray

    def __matmul__(self, other: Transform) -> Transform:
        """Return the transform that applies the other one first."""
        return Transform(self.matrix @ other.matrix, self.matrix @ other.offset + self.offset)

    @classmethod
    def origin_of(cls, element: ElementTree.Element) -> Transform:
        """Read the origin of a joint, visual or collision."""
        origin = element.find('origin')
        origin = ElementTree.Element('origin') if origin is None else origin
        return cls(rotation(*numbers(origin, 'rpy')), numbers(origin, 'xyz'))


class Robot:
    """A URDF whose joints can be turned."""

    def __init__(self, urdf: str) -> None:
        self.root = ElementTree.fromstring(urdf)
        self.links = {link.get('name'): link for link in self.root.findall('link')}
        self.joints = {joint.get('name'): joint for joint in self.root.findall('joint')}
        self.parents = {
            joint.find('child').get('link'): joint for joint in self.root.findall('joint')}

    def pose(self, link: str, **angles: float) -> Transform:
        """Return the transform from a link to base_link at the joints' angles."""
        joint = self.parents.get(link)
        if joint is None:
            return Transform(np.eye(3), np.zeros(3))
        step = Transform.origin_of(joint)
        if joint.get('type') != 'fixed':
            turn = rotation(*(numbers(joint.find('axis'), 'xyz')
                              * angles.get(joint.get('name'), 0.0)))
            step = step @ Transform(turn, np.zeros(3))
        return self.pose(joint.find('parent').get('link'), **angles) @ step

    def shapes(self, link: str, kinds: tuple = ('visual', 'collision')) -> Iterator[tuple]:
        """Yield a link's shapes: a geometry and its transform to the link."""
        for kind in kinds:
            for element in self.links[link].findall(kind):
                (geometry,) = element.find('geometry')
                yield geometry, Transform.origin_of(element)

    def extent(self, link: str, direction: tuple, kinds: tuple = ('visual', 'collision'),
               **angles: float) -> float:
        """Return how far a link reaches in a direction of base_link, to rounding."""
        pose = self.pose(link, **angles)
        return max(reach(geometry, pose @ origin, np.array(direction, float))
                   for geometry, origin in self.shapes(link, kinds))


def reach(geometry: ElementTree.Element, pose: Transform, direction: np.ndarray) -> float:
    """Return the support function of a primitive: its greatest coordinate in a direction."""
    local = pose.matrix.T @ direction
    if geometry.tag == 'box':
        beyond = np.abs(local) @ numbers(geometry, 'size') / 2
    elif geometry.tag == 'cylinder':
        beyond = (float(geometry.get('radius')) * math.hypot(local[0], local[1])
                  + float(geometry.get('length')) / 2 * abs(local[2]))
    else:
        assert geometry.tag == 'sphere', 'only primitives'
        beyond = float(geometry.get('radius'))
    return direction @ pose.offset + beyond


def described(path: Path) -> str:
    """Return what xacro makes of a parameter file."""
    return xacro.process_file(str(XACRO), mappings={'params_file': str(path)}).toxml()


def verdicts(directory: Path, **changes: object) -> tuple[str | None, str | None]:
    """Return the sentences with which Python and xacro refuse a file; None is an admission."""
    values = {**DEFAULTS, **changes}
    section = {name: value for name, value in values.items() if value is not Ellipsis}
    path = directory / 'turtle.yaml'
    path.write_text(yaml.safe_dump({'/**': {'ros__parameters': section}}), encoding='utf-8')
    python = from_xacro = None
    try:
        load(path)
    except ParameterError as error:
        python = re.sub(r'^\S+\.yaml(:\d+)?: ', '', str(error))
    try:
        described(path)
    except xacro.XacroException as error:
        sentence = str(error).split('\nwhen evaluating')[0].strip()
        assert sentence.startswith(f'{path}: ')
        from_xacro = sentence.removeprefix(f'{path}: ')
    return python, from_xacro


@pytest.fixture(scope='module')
def robot() -> Robot:
    """Return the robot of the installed parameters."""
    return Robot(xacro.process_file(str(XACRO)).toxml())


def test_tree_is_the_one_of_the_assignment(robot):
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
        'lamp_joint': ('fixed', 'stem', 'lamp', None),
        'rim_joint': ('fixed', 'wheel', 'rim', None),
        'spokes_joint': ('fixed', 'wheel', 'spokes', None),
        'mark_joint': ('fixed', 'wheel', 'mark', None),
    }
    assert set(robot.links) == {'base_link'} | {child for _, _, child, _ in tree.values()}


def test_links_are_the_shapes_of_the_assignment(robot):
    shapes = {'base_link': 'box', 'stem': 'cylinder', 'wheel': 'cylinder',
              'post': 'cylinder', 'platform': 'cylinder'}
    for link, tag in shapes.items():
        geometry, _ = next(robot.shapes(link))
        assert geometry.tag == tag
    side = {float(part) for part in next(robot.shapes('base_link'))[0].get('size').split()}
    assert len(side) == 1, 'a cube'


def test_what_is_seen_is_solid(robot):
    for link in robot.links:
        seen, solid = ([(geometry.tag, geometry.attrib, [*pose.matrix.flat, *pose.offset])
                        for geometry, pose in robot.shapes(link, (kind,))]
                       for kind in ('visual', 'collision'))
        assert seen == solid
        assert seen


def test_every_link_has_its_own_color(robot):
    colors = {material.get('name'): material.find('color').get('rgba')
              for material in robot.root.findall('material')}
    used = []
    for link in robot.links.values():
        # rviz paints all of a link in the color of its first shape.
        (name,) = {material.get('name') for material in link.findall('visual/material')}
        used.append(colors[name])
    assert len(set(used)) == len(used) == len(colors)


def test_no_shape_is_empty(robot):
    for element in robot.root.iter():
        for name in ('radius', 'length'):
            assert float(element.get(name, 1)) > 0
        assert np.all(numbers(element, 'size') > 0) or element.tag != 'box'


def test_positive_tilt_lowers_the_front(robot):
    radius = DEFAULTS['platform_radius']
    pose = robot.pose('platform', platform_joint=0.3)
    front = pose.matrix @ np.array([radius, 0, 0])
    assert front[2] == pytest.approx(-radius * math.sin(0.3))


def test_wheel_rolls_forward(robot):
    # What is on top of the wheel goes forward when its angle grows.
    pose = robot.pose('wheel', wheel_joint=1e-3)
    assert (pose.matrix @ np.array([0, 0, DEFAULTS['wheel_radius']]))[0] > 0
    # And forward is where the stem points.
    pose = robot.pose('wheel', stem_joint=math.pi / 2, wheel_joint=1e-3)
    assert (pose.matrix @ np.array([0, 0, DEFAULTS['wheel_radius']]))[1] > 0


ADMISSIBLE = [
    dict(zip(('platform_height', 'wheel_radius', 'platform_radius', 'platform_thickness'), values))
    for values in product((0.5, 1.6, 3, 20.0), (0.05, 0.2, 0.7), (0.05, 0.5, 1.3), (0.01, 0.3))
    if values[2] >= values[1] / 3 and values[2] <= 20 * values[1]
    and values[0] >= (2 * values[1] + math.hypot(values[2], values[3]) + values[3]
                      + least_room(values[2], values[1]))
]


def test_geometry_follows_from_the_parameters(tmp_path):
    assert len(ADMISSIBLE) > 25
    path = tmp_path / 'turtle.yaml'
    up, down = (0, 0, 1), (0, 0, -1)
    for changes in ADMISSIBLE:
        values = {**DEFAULTS, **changes}
        path.write_text(yaml.safe_dump({'/**': {'ros__parameters': values}}), encoding='utf-8')
        robot = Robot(described(path))
        chassis = from_mapping(values).chassis

        for turn in (0.0, 0.4, 1.0, 2.0, -3.0):
            angles = {'stem_joint': turn, 'wheel_joint': 2.7 * turn}
            for kind in ('visual', 'collision'):
                assert robot.extent('wheel', down, (kind,), **angles) == pytest.approx(
                    0, abs=1e-9)
            for adornment in ('rim', 'spokes', 'mark'):
                assert robot.extent(adornment, down, **angles) < 0, 'above the ground'
        assert robot.extent('wheel', up) == pytest.approx(chassis.wheel_top, abs=1e-9)
        assert robot.pose('wheel').offset == pytest.approx((0, 0, values['wheel_radius']))

        height = values['platform_height']
        for kind in ('visual', 'collision'):
            assert robot.extent('platform', up, (kind,)) == pytest.approx(height, abs=1e-9)
            assert robot.extent('platform', (1, 0, 0), (kind,)) == pytest.approx(
                values['platform_radius'], abs=1e-9)
        hinge = height - values['platform_thickness']
        assert -robot.extent('platform', down) == pytest.approx(hinge, abs=1e-9)
        assert robot.pose('platform').offset == pytest.approx((0, 0, hinge), abs=1e-9)
        assert robot.extent('post', up) == pytest.approx(hinge, abs=1e-9)

        # The platform turns over fully above the top of the base and of all beneath it.
        lowest = min(-robot.extent('platform', down, platform_joint=angle)
                     for angle in np.linspace(-math.pi, math.pi, 181))
        top = robot.extent('base_link', up)
        assert top == pytest.approx(chassis.cube_top, abs=1e-9)
        assert lowest > top
        assert lowest == pytest.approx(chassis.hinge_height - chassis.reach, rel=1e-3)
        assert robot.extent('stem', up) <= -robot.extent('base_link', down) + 1e-9

        # The post stands on the cube, the stem hangs from it, the fork holds the axle.
        assert -robot.extent('post', down) == pytest.approx(top, abs=1e-9)
        assert robot.extent('stem', up) == pytest.approx(chassis.cube_bottom, abs=1e-9)
        assert -robot.extent('stem', down) < values['wheel_radius']
        assert -robot.extent('stem', down) > 0
        assert robot.extent('eyes', up) < top
        assert robot.extent('pupils', up) < top
        assert robot.extent('lamp', up) < chassis.cube_bottom
        assert -robot.extent('lamp', down) > chassis.wheel_top

        # Under the fork's crown and between its blades the wheel turns freely.
        widest = max(robot.extent(link, (0, 1, 0)) for link in ('wheel', 'rim', 'spokes', 'mark'))
        for geometry, origin in robot.shapes('stem'):
            pose = robot.pose('stem') @ origin
            above = -reach(geometry, pose, np.array(down)) - chassis.wheel_top
            left = -reach(geometry, pose, np.array((0, -1, 0))) - widest
            right = -reach(geometry, pose, np.array((0, 1, 0))) - widest
            assert max(above, left, right) > 0, geometry.attrib


def grid() -> Iterator[dict]:
    """Yield changes of the parameters, admissible and not."""
    for values in product((0.5, 0.99, 1.0, 1.6, 3), (0.05, 0.2, 0.7), (0.05, 0.5, 1.3)):
        yield dict(zip(('platform_height', 'wheel_radius', 'platform_radius'), values))
    for wheel in (0.02, 0.025, math.nextafter(0.025, 0), 0.3, 0.35, 0.5, 1.5, 2.0):
        for height in (1.6, 3.0, 9.0):
            yield {'wheel_radius': wheel, 'platform_height': height}
    for name in SHAPE:
        yield {name: ...}
        for edge, outward in ((RULES[name].lower, -math.inf), (RULES[name].upper, math.inf)):
            for value in (edge, math.nextafter(edge, outward)):
                yield {name: value}
    for value in (1, 3.5, 0, -1, 10 ** 30, 10 ** 309, math.nan, math.inf, True, None, '3', 'fast',
                  [1.0], {}):
        yield {'platform_thickness': value}


def test_python_and_xacro_give_the_same_verdicts(tmp_path):
    verdict = [verdicts(tmp_path, **changes) for changes in grid()]
    for changes, (python, from_xacro) in zip(grid(), verdict):
        assert python == from_xacro, changes
    assert 20 < verdict.count((None, None)) < len(verdict) - 20


@settings(deadline=None, max_examples=40)
@given(st.floats(0.01, 1.0), st.floats(0.01, 1.0), st.floats(0.001, 0.5), st.integers(-3, 3))
def test_verdicts_agree_at_the_edge_of_what_can_be(tmp_path_factory, wheel, radius, thickness,
                                                   ulps):
    height = 2 * wheel + math.hypot(radius, thickness) + thickness + least_room(radius, wheel)
    for _ in range(abs(ulps)):
        height = math.nextafter(height, math.copysign(math.inf, ulps))
    python, from_xacro = verdicts(
        tmp_path_factory.getbasetemp(), wheel_radius=wheel, platform_radius=radius,
        platform_thickness=thickness, platform_height=height)
    assert python == from_xacro


@pytest.mark.parametrize('text', ['', '3', '/**: 3', '/**:\n  ros__parameters: 3',
                                  'arena:\n  ros__parameters: {wheel_radius: 0.2}'])
def test_file_without_parameters_is_refused(tmp_path, text):
    path = tmp_path / 'turtle.yaml'
    path.write_text(text, encoding='utf-8')
    with pytest.raises(xacro.XacroException, match='there are no parameters under'):
        described(path)
    with pytest.raises(ParameterError, match='there are no parameters under'):
        load(path)


def run_xacro(directory: Path, *args: str) -> subprocess.CompletedProcess:
    """Run the command as the launch files do, from any directory."""
    code = 'import sys, xacro; sys.argv[0] = "xacro"; xacro.main()'
    return subprocess.run(
        [sys.executable, '-c', code, str(XACRO), *args],
        cwd=directory, env=os.environ, capture_output=True, text=True)


def test_command_makes_the_installed_robot_without_a_word(tmp_path):
    ran = run_xacro(tmp_path)
    assert (ran.returncode, ran.stderr) == (0, '')
    assert ElementTree.fromstring(ran.stdout).get('name') == 'turtle'


def test_what_does_not_shape_the_robot_is_left_to_the_nodes(tmp_path):
    path = tmp_path / 'turtle.yaml'
    section = {name: DEFAULTS[name] for name in SHAPE} | {'mass': 3.0, 'max_velocity': 'fast'}
    path.write_text(yaml.safe_dump({'/**': {'ros__parameters': section}}), encoding='utf-8')
    ran = run_xacro(tmp_path, f'params_file:={path}')
    assert (ran.returncode, ran.stderr) == (0, '')
    assert ran.stdout == run_xacro(tmp_path).stdout


def test_command_fails_with_the_sentence_first(tmp_path):
    values = {**DEFAULTS, 'platform_height': 0.9}
    path = tmp_path / 'low.yaml'
    path.write_text(yaml.safe_dump({'/**': {'ros__parameters': values}}), encoding='utf-8')
    ran = run_xacro(tmp_path, f'params_file:={path}')
    assert ran.returncode != 0
    assert ran.stdout == ''
    first = ran.stderr.splitlines()[0]
    for value in ('0.9 m', '0.5 m', '0.04 m', '0.2 m', 'at least 1.1416 m'):
        assert value in first


@pytest.mark.parametrize('given, sentence', [
    ('platfrom_height', 'unknown platfrom_height, did you mean platform_height?'),
    ('platformheight', 'unknown platformheight, did you mean platform_height?'),
    ('platform_heigth', 'unknown platform_heigth, did you mean platform_height?'),
    ('height', 'missing parameters: platform_height'),
    (3, 'missing parameters: platform_height'),
])
def test_a_slip_in_a_name_is_told(tmp_path, given, sentence):
    values = {**DEFAULTS, given: DEFAULTS['platform_height']}
    del values['platform_height']
    path = tmp_path / 'turtle.yaml'
    path.write_text(yaml.safe_dump({'/**': {'ros__parameters': values}}), encoding='utf-8')
    assert run_xacro(tmp_path, f'params_file:={path}').stderr.splitlines()[0] == (
        f'error: {path}: {sentence} ')


def test_a_composed_graph_fails_with_the_sentence_alone(tmp_path):
    path = tmp_path / 'low.yaml'
    path.write_text('/**:\n  ros__parameters: {platform_height: 3}\n')
    with pytest.raises(ValueError) as caught:
        Graph.robot_description(SimpleNamespace(params_file=path))
    assert str(caught.value).endswith(f': {path}: missing parameters: platform_radius')
