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
"""Compare all imports with package.xml and with MAY_IMPORT."""

import ast
from functools import cache
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
"""Rosdep keys that differ from the names of the imported modules."""

NOT_IMPORTED = {'launch_xml', 'ros2launch'}
"""Packages required by `ros2 launch` and XML launch files, but not imported by any module."""

WITHOUT_KEY = {'viser', 'websockets'}
"""Modules without a usable rosdep key, installed as described in package.xml."""

PACKAGES = ('turtle_brick', 'graph_client', 'graph_view', 'turtle_referee')
"""Python packages in the ROS package turtle_brick."""

MAY_IMPORT = {
    'turtle_brick/core': ['turtle_brick.core'],
    'turtle_brick/physics.py': ['turtle_brick.core'],
    'turtle_brick/ros': ['turtle_brick.core', 'turtle_brick.ros'],
    **{f'turtle_brick/{name}.py': ['turtle_brick.physics', 'turtle_brick.core', 'turtle_brick.ros']
       for name in ('arena', 'catcher', 'turtle_robot')},
    'turtle_brick/tools': ['turtle_brick', 'graph_client'],
    'graph_client': ['graph_client'],
    'graph_view': ['graph_view', 'graph_client'],
    'turtle_referee': ['turtle_referee', 'graph_client'],
    'standins': [],
}
"""Modules and packages in this workspace that each folder or file may import."""


@cache
def imports_of(path):
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and '.' in node.module:
            names.add(node.module)
        elif isinstance(node, ast.ImportFrom):
            names.update(f'{node.module}.{alias.name}' for alias in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func) == 'pytest.importorskip':
            names.add(ast.literal_eval(node.args[0]))
    return names


def imports(*patterns):
    paths = (path for pattern in patterns for path in PACKAGE.glob(pattern))
    return set().union(*(imports_of(path) for path in paths if 'workspaces' not in path.parts))


def imported_packages(*patterns):
    """Return the rosdep keys of external modules imported by files that match glob patterns."""
    modules = {name.partition('.')[0] for name in imports(*patterns)}
    own = {*PACKAGES, *(file.stem for file in PACKAGE.glob('test/**/*.py'))}
    return {KEYS.get(name, name)
            for name in modules - sys.stdlib_module_names - own - WITHOUT_KEY}


def dependencies(kind):
    return {element.text for element in ElementTree.fromstring(MANIFEST).iter(kind)}


def test_exec_depend_lists_all_imported_and_launched_packages():
    launched = {name for path in PACKAGE.glob('launch/*') for name in re.findall(
        r'(?:package=\'|pkg=")(\w+)', path.read_text())} - {'turtle_brick'}
    imported = imported_packages(*(f'{name}/**/*.py' for name in PACKAGES), 'launch/*.py')
    assert dependencies('exec_depend') == imported | launched | NOT_IMPORTED


def test_test_depend_lists_all_packages_imported_by_tests():
    imported = imported_packages('test/**/*.py') - dependencies('exec_depend')
    assert dependencies('test_depend') == imported - {
        'ros2cli', 'tf_transformations', 'turtlesim_standin'}


@pytest.mark.parametrize('place', MAY_IMPORT)
def test_no_layer_imports_a_higher_layer(place):
    allowed = tuple(f'{module}.' for module in MAY_IMPORT[place])
    modules = imports(place if place.endswith('.py') else f'{place}/**/*.py')
    own = [name for name in modules if name.partition('.')[0] in PACKAGES]
    assert [name for name in own if not f'{name}.'.startswith(allowed)] == []
