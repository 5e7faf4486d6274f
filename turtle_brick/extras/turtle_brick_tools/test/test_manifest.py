# SPDX-License-Identifier: Apache-2.0
"""Compare all imports with package.xml and with MAY_IMPORT."""

import ast
from functools import cache
from pathlib import Path
import re
import sys
from xml.etree import ElementTree

import pytest

TOP = Path(__file__).resolve().parents[3]
PACKAGES = {'turtle_brick': TOP, 'turtle_graph': TOP / 'extras/turtle_graph',
            'turtle_brick_tools': TOP / 'extras/turtle_brick_tools'}
"""Folder of each ament_python package."""

KEYS = {'PIL': 'python3-pil', 'tf2_ros': 'tf2_ros_py', **{name: f'python3-{name}' for name in (
    'hypothesis', 'joblib', 'matplotlib', 'mypy', 'numpy', 'psutil', 'pytest', 'rich', 'tqdm',
    'yaml')}}
"""Rosdep keys that differ from the names of the imported modules."""

NOT_IMPORTED = {'turtle_brick': {'launch_xml', 'ros2launch', 'xacro'},
                'turtle_brick_tools': {'launch_xml', 'ros2launch'}}
"""Packages that the launch files require, but that no module imports."""

WITHOUT_KEY = {'msgspec', 'viser', 'websockets'}
"""Modules without a usable rosdep key, installed as described in package.xml."""

MAY_IMPORT = {
    'turtle_brick/core': ['turtle_brick.core'],
    'turtle_brick/physics.py': ['turtle_brick.core'],
    'turtle_brick/programs.py': [],
    'turtle_brick/ros': ['turtle_brick.core', 'turtle_brick.ros'],
    **{f'turtle_brick/{name}.py': ['turtle_brick.physics', 'turtle_brick.core', 'turtle_brick.ros']
       for name in ('arena', 'catcher', 'turtle_robot')},
    'launch': [],
    'test': ['turtle_brick'],
    'extras/turtle_graph/turtle_graph/client': ['turtle_graph.client'],
    'extras/turtle_graph/turtle_graph/view': ['turtle_graph.view', 'turtle_graph.client'],
    'extras/turtle_graph/turtle_graph/referee': ['turtle_graph.referee', 'turtle_graph.client',
                                                 'turtle_graph.programs'],
    'extras/turtle_graph/turtle_graph/programs.py': [],
    'extras/turtle_graph/test': ['turtle_graph'],
    'extras/turtle_brick_tools/turtle_brick_tools': [
        'turtle_brick_tools', 'turtle_brick', 'turtle_graph'],
    'extras/website': ['turtle_brick_tools', 'turtle_brick', 'turtle_graph'],
    **{f'extras/standins/{folder.name}': ['turtle_graph']
       for folder in TOP.glob('extras/standins/*/') if (folder / 'package.xml').is_file()},
}
"""Modules and packages in this workspace that each folder or file may import."""


@cache
def imports_of(path):
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and '.' in node.module:
            names.add(node.module)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names.update(f'{node.module}.{alias.name}' for alias in node.names)
    return names


def imports(folder, *patterns):
    paths = (path for pattern in patterns for path in folder.glob(pattern))
    return set().union(*map(imports_of, paths))


def imported_packages(package, *patterns):
    """Return the rosdep keys of external modules imported by files of a package."""
    folder = PACKAGES[package]
    modules = {name.partition('.')[0] for name in imports(folder, *patterns)}
    helpers = {file.stem for file in TOP.glob('**/test/**/*.py')}
    return {KEYS.get(name, name) for name in
            modules - sys.stdlib_module_names - helpers - WITHOUT_KEY - {package}}


def dependencies(package, kind):
    manifest = ElementTree.parse(PACKAGES[package] / 'package.xml')
    return {element.text for element in manifest.iter(kind)}


@pytest.mark.parametrize('package', PACKAGES)
def test_exec_depend_lists_all_imported_and_launched_packages(package):
    launched = {name for path in PACKAGES[package].glob('launch/*') for name in re.findall(
        r'(?:package=\'|pkg=")(\w+)', path.read_text())} - {package}
    imported = imported_packages(package, f'{package}/**/*.py', 'launch/*.py')
    assert dependencies(package, 'exec_depend') == (
        imported | launched | NOT_IMPORTED.get(package, set()))


@pytest.mark.parametrize('package', PACKAGES)
def test_test_depend_lists_all_packages_imported_by_tests(package):
    imported = imported_packages(package, 'test/**/*.py')
    assert dependencies(package, 'test_depend') == (
        imported - dependencies(package, 'exec_depend') - {'turtlesim_standin'})


@pytest.mark.parametrize('place', MAY_IMPORT)
def test_no_layer_imports_a_higher_layer(place):
    allowed = tuple(f'{module}.' for module in MAY_IMPORT[place])
    modules = imports(TOP, place if place.endswith('.py') else f'{place}/**/*.py')
    own = [name for name in modules if name.partition('.')[0] in PACKAGES]
    assert [name for name in own if not f'{name}.'.startswith(allowed)] == []
