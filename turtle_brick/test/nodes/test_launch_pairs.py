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
"""
The launch files: each pair in Python and XML says the same, and says it declaratively.

Both twins are read twice. Statically, in any home: the Python syntax tree and the XML are brought
into one form, in which substitutions are written as the XML frontend writes them; whatever the
reading does not know is a failure. And through launch itself, where it is installed: both are
loaded and every argument, command line, parameter, environment and condition is evaluated.
"""

from __future__ import annotations

import ast
from itertools import product
from pathlib import Path
from xml.etree import ElementTree

import pytest
from turtle_brick.core.parameters import default_path
import yaml

SHARE = default_path().parents[1]
NAMES = ('show_turtle', 'run_turtle', 'turtle_arena')

#: What the displays of rviz listen to, with the QoS of the publishers.
TOPICS = {
    'robot_description': ('RobotModel', 'Transient Local'),
    'walls': ('MarkerArray', 'Transient Local'),
    'brick_marker': ('Marker', 'Transient Local'),
    'catcher_marker': ('Marker', 'Volatile'),
}


def twin(name: str, language: str) -> Path:
    """Return the path of a launch file."""
    return SHARE / 'launch' / f'{name}.launch.{language}'


# The static reading.

def only(found: set, known: set) -> None:
    """Fail on anything that the reading would otherwise pass over."""
    assert found <= known, f'unknown to this test: {found - known}'


def text(node: ast.expr) -> str:
    """Write a Python substitution as the XML frontend would."""
    if isinstance(node, ast.Constant):
        return str(node.value).lower() if isinstance(node.value, bool) else str(node.value)
    if isinstance(node, ast.List):
        return ''.join(text(part) for part in node.elts)
    assert isinstance(node, ast.Call), ast.dump(node)
    values = [text(value) for value in node.args]
    keywords = {keyword.arg: text(keyword.value) for keyword in node.keywords}
    call = node.func.id
    if call == 'PathJoinSubstitution':
        return '/'.join(text(part) for part in node.args[0].elts)
    if call == 'EnvironmentVariable':
        only(set(keywords), {'default_value'})
        return f"$(env {values[0]} '{keywords['default_value']}')"
    if call == 'Command':
        only(set(keywords), {'on_stderr'})
        return f"$(command '{values[0]}' '{keywords['on_stderr']}')"
    assert not keywords
    written = {
        'LaunchConfiguration': '$(var {})',
        'FindPackageShare': '$(find-pkg-share {})',
        'EqualsSubstitution': '$(equals {} {})',
        'IfCondition': '{}',
    }
    return written[call].format(*values)


def parameters_of(node: ast.expr) -> list:
    """Return a Python node's parameters: (name, value, type) or (file,)."""
    found = []
    for entry in node.elts:
        if not isinstance(entry, ast.Dict):
            found.append((text(entry),))
            continue
        for key, value in zip(entry.keys, entry.values):
            kind = None
            if isinstance(value, ast.Call) and value.func.id == 'ParameterValue':
                assert [keyword.arg for keyword in value.keywords] == ['value_type']
                value, kind = value.args[0], value.keywords[0].value.id
            found.append((text(key), text(value), kind))
    return found


def read_python(path: Path) -> list:
    """Bring a Python launch file into the common form."""
    module = ast.parse(path.read_text(encoding='utf-8'))
    described = module.body[-1].body[-1].value
    actions = []
    for call in described.args[0].elts:
        keywords = {keyword.arg: keyword.value for keyword in call.keywords}
        if call.func.id == 'DeclareLaunchArgument':
            only(set(keywords), {'default_value', 'description', 'choices'})
            choices = keywords.get('choices')
            actions.append((
                'arg', text(call.args[0]), text(keywords['default_value']),
                text(keywords['description']),
                [] if choices is None else [text(choice) for choice in choices.elts]))
        elif call.func.id == 'Node':
            assert not call.args
            only(set(keywords), {'package', 'executable', 'arguments', 'parameters',
                                 'remappings', 'additional_env', 'condition'})
            environment = keywords.get('additional_env', ast.Dict([], []))
            actions.append((
                'node', text(keywords['package']), text(keywords['executable']),
                ' '.join(text(part) for part in getattr(keywords.get('arguments'), 'elts', [])),
                parameters_of(keywords.get('parameters', ast.List([]))),
                [tuple(text(part) for part in pair.elts)
                 for pair in getattr(keywords.get('remappings'), 'elts', [])],
                [(text(key), text(value))
                 for key, value in zip(environment.keys, environment.values)],
                text(keywords['condition']) if 'condition' in keywords else None))
        else:
            assert call.func.id == 'IncludeLaunchDescription'
            only(set(keywords), {'launch_arguments'})
            location = text(call.args[0])
            assert location.endswith('.py')
            actions.append((
                'include', location.removesuffix('.py'),
                [tuple(text(part) for part in pair.elts)
                 for pair in keywords['launch_arguments'].elts]))
    return actions


def read_xml(path: Path) -> list:
    """Bring an XML launch file into the common form."""
    actions = []
    for element in ElementTree.parse(path).getroot():
        tags = [child.tag for child in element]
        if element.tag == 'arg':
            only(set(element.attrib), {'name', 'default', 'description'})
            only(set(tags), {'choice'})
            actions.append((
                'arg', element.get('name'), element.get('default'), element.get('description'),
                [choice.get('value') for choice in element]))
        elif element.tag == 'node':
            only(set(element.attrib), {'pkg', 'exec', 'args', 'if'})
            only(set(tags), {'param', 'remap', 'env'})
            parameters = []
            for parameter in element.findall('param'):
                only(set(parameter.attrib), {'name', 'value', 'type', 'from'})
                parameters.append(
                    (parameter.get('from'),) if 'from' in parameter.attrib else
                    tuple(parameter.get(key) for key in ('name', 'value', 'type')))
            actions.append((
                'node', element.get('pkg'), element.get('exec'), element.get('args', ''),
                parameters,
                [(remap.get('from'), remap.get('to')) for remap in element.findall('remap')],
                [(env.get('name'), env.get('value')) for env in element.findall('env')],
                element.get('if')))
        else:
            assert element.tag == 'include'
            only(set(element.attrib), {'file'})
            only(set(tags), {'arg'})
            assert element.get('file').endswith('.xml')
            actions.append((
                'include', element.get('file').removesuffix('.xml'),
                [(argument.get('name'), argument.get('value')) for argument in element]))
    return actions


@pytest.mark.parametrize('name', NAMES)
def test_twins_say_the_same(name):
    python, xml = read_python(twin(name, 'py')), read_xml(twin(name, 'xml'))
    assert python == xml
    assert python, 'something was read'


@pytest.mark.parametrize('name', NAMES)
def test_python_is_imports_and_one_return(name):
    docstring, *imports, function = ast.parse(twin(name, 'py').read_text(encoding='utf-8')).body
    assert isinstance(docstring.value, ast.Constant)
    assert all(isinstance(statement, ast.ImportFrom) for statement in imports)
    assert {statement.module.split('.')[0] for statement in imports} <= {'launch', 'launch_ros'}
    assert 'OpaqueFunction' not in {alias.name for line in imports for alias in line.names}
    assert function.name == 'generate_launch_description'
    docstring, returned = function.body
    assert isinstance(docstring.value, ast.Constant)
    assert isinstance(returned, ast.Return)
    assert returned.value.func.id == 'LaunchDescription'
    calls = {type(node) for node in ast.walk(returned)}
    assert not calls & {ast.Lambda, ast.ListComp, ast.IfExp, ast.JoinedStr, ast.BinOp}


def arguments(name: str) -> dict:
    """Return a launch file's arguments: default, description and choices by name."""
    return {action[1]: action[2:] for action in read_xml(twin(name, 'xml')) if action[0] == 'arg'}


def test_arguments_are_those_of_the_assignment():
    default, description, choices = arguments('show_turtle')['use_jsp']
    assert (default, choices) == ('gui', ['gui', 'jsp', 'none'])
    assert 'joint_state' in description
    for name in NAMES:
        default, description, _ = arguments(name)['rviz_config']
        assert default == f'config/{name}.rviz'
        assert (SHARE / default).is_file()
        assert 'share directory' in description
        default, description, choices = arguments(name)['view']
        assert (default, choices) == (
            "$(env TURTLE_BRICK_VIEW 'rviz')", ['rviz', 'web', 'none'])


@pytest.mark.parametrize('name', NAMES)
def test_no_name_is_absolute(name):
    for action in read_python(twin(name, 'py')):
        if action[0] == 'node':
            for pair in action[5]:
                assert not any(topic.startswith('/') for topic in pair)


@pytest.mark.parametrize('name', NAMES)
def test_included_arguments_are_all_given(name):
    # An argument that is left out would take whatever value leaked from elsewhere.
    for action in read_python(twin(name, 'py')):
        if action[0] == 'include':
            included = Path(action[1]).name.removesuffix('.launch')
            assert {given for given, _ in action[2]} == set(arguments(included))


@pytest.mark.parametrize('name', NAMES)
def test_rviz_configuration_fits_its_launch_file(name):
    manager = yaml.safe_load(
        (SHARE / 'config' / f'{name}.rviz').read_text(encoding='utf-8'))['Visualization Manager']
    # Alone, the robot has no world.
    frame = 'base_link' if name == 'show_turtle' else 'world'
    assert manager['Global Options']['Fixed Frame'] == frame
    heard = {}
    for display in manager['Displays']:
        for key in ('Topic', 'Description Topic'):
            if key in display:
                kind = display['Class'].removeprefix('rviz_default_plugins/')
                heard[display[key]['Value']] = (kind, display[key]['Durability Policy'])
                assert display[key]['Reliability Policy'] == 'Reliable'
                assert display['Enabled'] is True
    expected = TOPICS if name == 'turtle_arena' else {
        'robot_description': TOPICS['robot_description']}
    assert heard == expected
    goals = [tool['Topic']['Value'] for tool in manager['Tools'] if 'SetGoal' in tool['Class']]
    assert goals == ([] if name == 'show_turtle' else ['goal_pose'])


# The reading through launch.

def evaluated(name: str, language: str, **given: str) -> list:
    """Load a launch file and evaluate everything in it for the values of its arguments."""
    from launch import LaunchContext
    from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
    from launch.launch_description_sources import get_launch_description_from_any_launch_file
    from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
    from launch_ros.actions import Node

    context = LaunchContext()
    context.launch_configurations.update(given)

    def value(substitutions: object) -> str:
        return perform_substitutions(context, normalize_to_list_of_substitutions(substitutions))

    actions = []
    for action in get_launch_description_from_any_launch_file(str(twin(name, language))).entities:
        condition = action.condition is None or action.condition.evaluate(context)
        if isinstance(action, DeclareLaunchArgument):
            action.execute(context)
            actions.append((action.name, value(action.default_value), action.description,
                            action.choices, context.launch_configurations[action.name]))
        elif isinstance(action, Node):
            action._perform_substitutions(context)
            # The first part finds the executable, of a package that need not be here.
            parts = [value(part) for part in action.cmd[1:]]
            files, rest, merged = [], [], {}
            for before, part in zip(['', *parts], parts):
                (files if before == '--params-file' else rest).append(part)
            for file in files:
                for node, section in yaml.safe_load(Path(file).read_text('utf-8')).items():
                    merged.setdefault(node, {}).update(section['ros__parameters'])
            environment = action.additional_env or {}
            actions.append((
                value(action.node_package), value(action.node_executable),
                [part for part in rest if part != '--params-file'], merged,
                [(value(key), value(entry)) for key, entry in
                 getattr(environment, 'items', lambda: environment)()],
                condition))
        else:
            assert isinstance(action, IncludeLaunchDescription)
            action.launch_description_source.get_launch_description(context)
            location = Path(action.launch_description_source.location)
            assert location.suffix == f'.{language}'
            actions.append((
                location.stem, [(value(key), value(entry))
                                for key, entry in action.launch_arguments]))
    return actions


CASES = [('show_turtle', {'use_jsp': use_jsp, 'view': view})
         for use_jsp, view in product(('gui', 'jsp', 'none'), ('rviz', 'web', 'none'))]
CASES += [(name, {'view': view}) for name in NAMES[1:] for view in ('rviz', 'web', 'none')]
CASES += [(name, {}) for name in NAMES]
CASES += [(name, {'rviz_config': 'config/own.rviz'}) for name in NAMES]


@pytest.mark.parametrize('name, given', CASES)
def test_twins_do_the_same(name, given, monkeypatch):
    monkeypatch.delenv('TURTLE_BRICK_VIEW', raising=False)
    python, xml = evaluated(name, 'py', **given), evaluated(name, 'xml', **given)
    assert python == xml
    if name == 'show_turtle':
        started = {executable: condition
                   for _, executable, *_, condition in (a for a in python if len(a) == 6)}
        assert started == {
            'robot_state_publisher': True,
            'joint_state_publisher_gui': given.get('use_jsp', 'gui') == 'gui',
            'joint_state_publisher': given.get('use_jsp') == 'jsp',
            'rviz2': given.get('view', 'rviz') == 'rviz',
            'viewer': given.get('view') == 'web',
        }
        (published,) = (a[3] for a in python if a[0] == 'robot_state_publisher')
        (section,) = published.values()
        assert section['ignore_timestamp'] is True
        assert '<robot name="turtle"' in section['robot_description']


@pytest.mark.parametrize('language', ['py', 'xml'])
@pytest.mark.parametrize('name, argument', [
    ('show_turtle', 'use_jsp'), *((name, 'view') for name in NAMES)])
def test_value_that_is_no_choice_is_refused(name, argument, language):
    with pytest.raises(RuntimeError, match=f'"{argument}" provided value "both" is not valid'):
        evaluated(name, language, **{argument: 'both'})
