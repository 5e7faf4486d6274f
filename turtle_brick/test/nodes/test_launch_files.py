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
Tests of the launch files: the Python and XML files are equivalent, and the arena works.

The tests evaluate every argument, command line, parameter, variable and condition in both files of
a pair. One test runs the complete arena.
"""

from pathlib import Path
import signal
import sys

from geometry_msgs.msg import Point, Twist
from launch import LaunchContext
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, LogInfo
from launch.launch_description_sources import AnyLaunchDescriptionSource
from launch.utilities import normalize_to_list_of_substitutions, perform_substitutions
from launch_ros.actions import Node
from live_graph import graph, process, TIMEOUT
import pytest
from std_srvs.srv import Trigger
from turtle_brick.core.parameters import default_path
from turtle_brick_interfaces.srv import Place
import yaml

SHARE = default_path().parents[1]
NAMES = ('show_turtle', 'run_turtle', 'turtle_arena')

TOPICS = {
    'robot_description': ('RobotModel', 'Transient Local'),
    'walls': ('MarkerArray', 'Transient Local'),
    'brick_marker': ('Marker', 'Transient Local'),
    'catcher_marker': ('Marker', 'Volatile'),
}
"""Display type and durability of each topic in the rviz configurations."""


class LoadedLaunchFile:
    """A launch file that is loaded with values for its arguments."""

    def __init__(self, name, language, **given):
        self.context = LaunchContext()
        self.context.launch_configurations.update(given)
        path = SHARE / 'launch' / f'{name}.launch.{language}'
        include = IncludeLaunchDescription(AnyLaunchDescriptionSource(str(path)))
        include.execute(self.context)  # This defines the directory of the launch file.
        source = include.launch_description_source
        self.actions = source.get_launch_description(self.context).entities
        self.arguments = {}
        """Default value, description, choices and current value of each argument."""
        for action in self.actions:
            if isinstance(action, DeclareLaunchArgument):
                action.execute(self.context)
                self.arguments[action.name] = (
                    self.value(action.default_value), action.description, action.choices,
                    self.context.launch_configurations[action.name])

    def value(self, substitutions):
        """Evaluate substitutions."""
        return perform_substitutions(
            self.context, normalize_to_list_of_substitutions(substitutions))

    def holds(self, action):
        """Evaluate the condition of an action."""
        return action.condition is None or action.condition.evaluate(self.context)

    def nodes(self):
        """Return command line, parameters, environment and condition of each executable."""
        return {self.value(action.node_executable): self.node(action)
                for action in self.actions if isinstance(action, Node)}

    def node(self, action):
        """Evaluate a node action."""
        # The first word is the path of the executable, whose package may not be installed.
        words = [self.value(part) for part in action.cmd[1:]]
        parameters = {}
        while '--params-file' in words:
            index = words.index('--params-file')
            _, file = words[index:index + 2]
            del words[index:index + 2]
            for node, section in yaml.safe_load(Path(file).read_text('utf-8')).items():
                parameters.setdefault(node, {}).update(section['ros__parameters'])
        environment = action.additional_env or []
        pairs = environment.items() if isinstance(environment, dict) else environment
        variables = [(self.value(key), self.value(entry)) for key, entry in pairs]
        return words, parameters, variables, self.holds(action)

    def messages(self):
        """Return text and condition of each log message."""
        return [(self.value(action.msg), self.holds(action))
                for action in self.actions if isinstance(action, LogInfo)]

    def includes(self):
        """Return name and passed arguments of each included launch file."""
        found = []
        for action in self.actions:
            if isinstance(action, IncludeLaunchDescription):
                action.launch_description_source.get_launch_description(self.context)
                location = Path(action.launch_description_source.location)
                found.append((location.name, {
                    self.value(key): self.value(entry) for key, entry in action.launch_arguments}))
        return found


@pytest.fixture(autouse=True)
def default_view(monkeypatch):
    """Let the environment not say what shows the scene."""
    monkeypatch.delenv('TURTLE_BRICK_VIEW', raising=False)


@pytest.mark.parametrize('given', [
    {}, {'view': 'web', 'rviz_config': 'config/own.rviz', 'namespace': 'alice'},
    {'view': 'none', 'use_jsp': 'jsp'}, {'use_jsp': 'none'}])
@pytest.mark.parametrize('name', NAMES)
def test_twins_do_the_same(name, given):
    if name != 'show_turtle':  # what drives has no use for it
        given = {key: value for key, value in given.items() if key != 'use_jsp'}
    actions = evaluated(name, 'py', **given)
    assert actions == evaluated(name, 'xml', **given)
    nodes = {action[2]: action[3:] for action in actions if action[0] == 'node'}
    if name == 'show_turtle':
        assert {executable: node[-1] for executable, node in nodes.items()} == {
            'robot_state_publisher': True,
            'joint_state_publisher_gui': given.get('use_jsp', 'gui') == 'gui',
            'joint_state_publisher': given.get('use_jsp') == 'jsp',
            'rviz2': given.get('view', 'rviz') == 'rviz',
            'viewer': given.get('view') == 'web',
        }
        told = str(nodes['robot_state_publisher'][1])
        assert "'ignore_timestamp': True" in told and '<robot name="turtle"' in told
        wanted = SHARE / given.get('rviz_config', 'config/show_turtle.rviz')
        assert str(wanted) in nodes['rviz2'][0]
    elif name == 'run_turtle':
        assert list(nodes) == ['turtlesim_node', 'turtle_robot']
        assert "'holonomic': True" in str(nodes['turtlesim_node'][1])
        assert 'cmd_vel:=turtle1/cmd_vel' in nodes['turtle_robot'][0]
    else:
        assert list(nodes) == ['arena', 'catcher']
    for executable, (words, *_) in nodes.items():
        remaps = [part for before, part in zip(words, words[1:]) if before == '-r']
        # TF's names are absolute, and no others: they are to be in the namespace, too.
        no_tf = executable == 'turtlesim_node' or 'joint_state' in executable
        assert [part for part in remaps if part.startswith('/') or ':=/' in part] == [
            f'__ns:=/{given.get("namespace", "")}',
            *([] if no_tf else ['/tf:=tf', '/tf_static:=tf_static'])]
    for _, included, passed in (action for action in actions if action[0] == 'include'):
        # An argument that is left out would take whatever value leaked from elsewhere.
        assert set(passed) == set(arguments(included))
        assert passed.items() >= given.items()


def test_arguments_are_those_of_the_assignment(monkeypatch):
    for name in NAMES:
        found = arguments(name)
        default, description, *_ = found['rviz_config']
        assert default == f'config/{name}.rviz'
        assert 'share directory' in description
        default, description, choices, _ = found['view']
        assert (default, choices) == ('rviz', ['rviz', 'web', 'none']) and description
        if name == 'show_turtle':
            default, description, choices, _ = found.pop('use_jsp')
            assert (default, choices) == ('gui', ['gui', 'jsp', 'none'])
            assert 'joint_state' in description
        assert list(found) == ['rviz_config', 'view', 'namespace']
    monkeypatch.setenv('TURTLE_BRICK_VIEW', 'web')
    for name in NAMES:
        for language in ('py', 'xml'):
            assert arguments(name, language)['view'][-1] == 'web'
    assert arguments('run_turtle', view='none')['view'][-1] == 'none'


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
    assert heard == (TOPICS if name == 'turtle_arena' else {
        'robot_description': TOPICS['robot_description']})
    goals = [tool['Topic']['Value'] for tool in manager['Tools'] if 'SetGoal' in tool['Class']]
    assert goals == ([] if name == 'show_turtle' else ['goal_pose'])


# -------------------------------------------------------------------------------- what they launch

# The real launch reads its signals from a file, and leaves Python's own handler in place: when its
# KeyboardInterrupt hits a callback of asyncio, that is lost, and launch may say "user interrupted"
# and wait for ever. It did so 6 times of 120 while processes printed, and never without.
LAUNCH = """
import signal
import sys

from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import AnyLaunchDescriptionSource
signal.signal(signal.SIGINT, lambda *_: None)
service = LaunchService(noninteractive=True)  # not only the terminal interrupts
service.include_launch_description(LaunchDescription([IncludeLaunchDescription(
    AnyLaunchDescriptionSource(sys.argv[1]),
    launch_arguments=[argument.split(':=') for argument in sys.argv[2:]])]))
sys.exit(service.run())
"""


def test_turtle_arena(domain_id):
    """
    The robot is commanded at 100 Hz, and catches a brick beside it: all in a namespace.

    At a Ctrl-C every process ends by itself.
    """
    path = SHARE / 'launch' / 'turtle_arena.launch.py'
    with process([sys.executable, '-c', LAUNCH, str(path), 'view:=none', 'namespace:=bob'],
                 domain_id, stop=None) as launching:
        launching.wait_for_output('waiting for a fall', TIMEOUT)
        with graph(domain_id, namespace='bob') as live:
            commands = live.record('turtle1/cmd_vel', Twist)
            # Long enough for a stall of the machine not to last for a third of it.
            assert live.rates([commands], 300) == [pytest.approx(100.0, rel=0.02)]
            # Beside the robot, and so high that a busy machine has the time to see it fall.
            beside = Place.Request(location=Point(x=6.5, y=6.0, z=20.0))
            assert live.call('place', Place, beside).success
            assert live.call('drop', Trigger).success
            names = {name for name, _ in (*live.listener.get_topic_names_and_types(),
                                          *live.listener.get_service_names_and_types())}
            assert {name for name in names if not name.startswith('/bob/')} == {
                '/parameter_events', '/rosout'}
        launching.wait_for_output('can be caught', TIMEOUT)
        launching.wait_for_output(r'arena-\d\].*riding', TIMEOUT)
        status = launching.stop(signal.SIGINT)
    assert 'Traceback' not in launching.output
    assert 'escalating' not in launching.output
    clean = launching.output.count('process has finished cleanly')
    # what the middleware has kept from ending: see END_TIME in node_main
    alarmed = launching.output.count(f'exit code {-signal.SIGALRM}')
    assert clean + alarmed == 5, launching.output
    assert alarmed or status == 0, launching.output
