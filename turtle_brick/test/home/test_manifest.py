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
"""What the packages import: as package.xml names it, and only downwards."""

import ast
from pathlib import Path
import re
import sys
from xml.etree import ElementTree

import pytest

PACKAGE = Path(__file__).resolve().parents[2]
MANIFEST = (PACKAGE / 'package.xml').read_text()

KEYS = {'PIL': 'python3-pil', 'tf2_ros': 'tf2_ros_py', **{name: f'python3-{name}' for name in (
    'hypothesis', 'joblib', 'matplotlib', 'mypy', 'numpy', 'psutil', 'pytest', 'rich', 'tqdm',
    'yaml')}}
"""The rosdep keys that are not the name of the module."""

NOT_PYTHON = {'launch_xml', 'ros2launch'}
"""They make ros2 launch read launch files, those in XML too."""

MAY_IMPORT = {
    'turtle_brick/core': ['turtle_brick.core'],
    'turtle_brick/physics.py': ['turtle_brick.core'],
    'turtle_brick/ros': ['turtle_brick.core', 'turtle_brick.ros'],
    **{f'turtle_brick/{name}.py': ['turtle_brick.physics', 'turtle_brick.core', 'turtle_brick.ros']
       for name in ('arena', 'catcher', 'turtle_robot')},
    'turtle_brick/view': [f'turtle_brick.{name}' for name in (
        'core', 'ros', 'view', 'arena', 'catcher', 'physics', 'turtle_robot')],
    'turtle_brick/tools': ['turtle_brick', 'turtle_referee'],
    'turtle_referee': ['turtle_referee'],
    'standins': ['turtle_brick.core.turtlesim_kinematics'],
}
"""What each room may import of this package's modules."""


def modules_of(paths):
    """Return the full names of the modules that files import."""
    names = set()
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                names.update(alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                names.update([node.module] if '.' in node.module else (
                    f'{node.module}.{alias.name}' for alias in node.names))
            elif isinstance(node, ast.Call) and ast.unparse(node.func) == 'pytest.importorskip':
                names.add(ast.literal_eval(node.args[0]))
    return names


def imported(*patterns):
    """Return the keys of the modules that files import, without the package's own and viser's."""
    paths = [path for pattern in patterns for path in PACKAGE.glob(pattern)]
    modules = {name.partition('.')[0] for name in modules_of(paths)}
    own = {'turtle_brick', 'turtle_referee',
           *(path.stem for path in PACKAGE.joinpath('test').rglob('*.py'))}
    without_key = re.search(r'<!-- viser(.*?)-->', MANIFEST, re.DOTALL)[0]
    own.update(re.findall(r'\w+', without_key))
    return {KEYS.get(name, name) for name in modules - sys.stdlib_module_names - own}


def named(kind):
    """Return the dependencies of a kind."""
    return {element.text for element in ElementTree.fromstring(MANIFEST).iter(kind)}


def test_what_is_imported_or_launched_is_named_and_nothing_else():
    launched = {name for path in PACKAGE.glob('launch/*') for name in re.findall(
        r'(?:package=\'|pkg=")(\w+)', path.read_text())} - {'turtle_brick'}
    used = imported('turtle_*/**/*.py', 'launch/*.py')
    assert named('exec_depend') == used | launched | NOT_PYTHON


def test_what_tests_import_is_named_and_nothing_else():
    used = imported('test/**/*.py') - named('exec_depend')
    assert named('test_depend') == used - {'ros2cli', 'turtlesim_standin'}


@pytest.mark.parametrize('room', MAY_IMPORT)
def test_no_room_imports_from_above(room):
    place = PACKAGE / room
    ours = {name for name in modules_of([place] if place.is_file() else place.rglob('*.py'))
            if name.startswith(('turtle_brick.', 'turtle_referee.'))}
    assert [name for name in sorted(ours)
            if not any(f'{name}.'.startswith(f'{below}.') for below in MAY_IMPORT[room])] == []
