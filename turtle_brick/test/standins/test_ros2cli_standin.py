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
`ros2` on a running turtle_arena, held to recordings of the real one.

Every record of data/ros2 about what the stand-in has is replayed on one graph.
"""

from argparse import Namespace
from concurrent.futures import ThreadPoolExecutor
import contextlib
import os
from pathlib import Path
import re
import signal
import threading

from ament_index_python.packages import get_package_share_directory
import pytest
from rcl_interfaces.msg import IntegerRange, ParameterDescriptor
from rclpy.action import ActionServer
from recorded import Command, done_here, GLANCE, records, with_paths, write_files
from ros2cli import cli, traffic
import ros2cli.graph as cli_graph
from ros2cli.graph import Observer
from turtle_brick.tools.graph import Graph
from turtle_referee.graph_client.domains import reserved_domain
from turtlesim.action import RotateAbsolute
from turtlesim.msg import Color

RECORDS = {name: record for name, record in records(
    'cli', 'launch_show_args', 'launch_errors').items()
    if not record['stdout'].startswith('[')}  # what launch says: test_launch_standin.py


def signals_of(record):
    """Return the signals that were sent: what was waited for, the signal, and to whom."""
    signals = [] if record.get('stderr') else list(record.get('signals', ()))
    if record.get('ended_by_recorder'):
        signals.append([signals[-1][0] if signals else ['t', 0], 'SIGINT', 'group'])
    return signals


# These are commands in processes of their own, as a user's are: what is interrupted, what starts
# processes, what sees an empty graph or fails with a traceback, and for each way into the graph
# and out of it one. The others are done in this process, in which a node enters the graph at once
# (and hears what is latched, whatever its QoS).
PROCESSES = [name for name, record in RECORDS.items() if signals_of(record) or re.match(
    'run_(?!help|unk)|ros2_run|empty|node_list$|node_info_catcher|echo_once$|pub_times|'
    'pub_bad_topic|param_list_all', name)]

# They come last, since they change what others see.
HERE = sorted(set(RECORDS).difference(PROCESSES, ['interface_list']), key=lambda name: (
    re.match('param_set|call', name) is not None, list(RECORDS).index(name)))


@pytest.fixture(scope='module')
def files(tmp_path_factory):
    """Write the files that were recorded with."""
    top = tmp_path_factory.mktemp('ros2')
    write_files(top)
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv('COLUMNS', '100')
        environment.setenv('LANGUAGE', 'C')  # for which argparse looks at no file per word
        environment.setenv('AMENT_PREFIX_PATH',
                           f'{top}/probe:{os.environ["AMENT_PREFIX_PATH"]}')
        yield top


# ----------------------------------------------------------------------------------- the graph

def complete(turtlesim):
    """Give turtlesim what it leaves out and the recordings show."""
    turtlesim.create_publisher(Color, 'turtle1/color_sensor', 10)
    ActionServer(turtlesim, RotateAbsolute, 'turtle1/rotate_absolute', lambda _: None)
    for color, name, value in (('b', 'Blue', 255), ('g', 'Green', 86), ('r', 'Red', 69)):
        turtlesim.declare_parameter(f'background_{color}', value, ParameterDescriptor(
            description=f'{name} channel of the background color',
            integer_range=[IntegerRange(from_value=0, to_value=255, step=1)]))


@pytest.fixture(scope='module')
def arena():
    """Run what `turtle_arena view:=none` starts, in a domain of its own; return one node."""
    with reserved_domain() as domain, Graph(domain, quiet=True) as graph:
        complete(graph.add_turtlesim())
        graph.add_robot_state_publisher()
        graph.add_robot()
        node = graph.add_arena()
        graph.add_catcher()
        over = threading.Event()

        def spin():
            while not over.wait(0.02):  # the nodes need not hurry: what they say counts
                graph.spin_for(0.005)

        spinning = threading.Thread(target=spin, name='arena')
        spinning.start()
        try:
            yield node
        finally:
            over.set()
            spinning.join()


# ---------------------------------------------------------------------------------- the replay

def start(words, domain, stdin=''):
    """Start a command in a domain."""
    return Command(words, {**os.environ, 'ROS_DOMAIN_ID': str(domain)}, stdin,
                   forked=words[0] == 'ros2' and words[1:2] not in ([], ['run']))


def has_come(record, when, command, arena):
    """Tell whether what a signal waits for has come: what a command says, or its subscription."""
    kind, what = when
    if kind == 'line':
        return command.has_said(what)
    # After some seconds, when it was waiting.
    expected = record['stdout'].replace('$MORE\n', '').count('\n')
    return command.text.count('\n') >= expected if expected else any(
        info.node_name == f'_ros2cli_{command.pid}' for topic in record['command'][3:]
        if topic.startswith('/') for info in arena.get_subscriptions_info_by_topic(topic))


def replay(record, domain, arena, files):
    """Do what was recorded, with its signals when what they waited for has come."""
    command = start(with_paths(record['command'], files), domain, record.get('stdin', ''))
    for when, name, whom in signals_of(record):
        command.wait_for(lambda: has_come(record, when, command, arena))
        command.send(name, whom)
    command.end()
    return command


@pytest.fixture(scope='module')
def outcomes(arena, files, request):
    """Do the commands again that this session tests, several at a time: most of them wait."""
    wanted = [item.callspec.params['name'] for item in request.session.items
              if getattr(item, 'function', None) is test_command]
    with reserved_domain() as empty, ThreadPoolExecutor(6) as pool:
        yield {name: pool.submit(
            replay, RECORDS[name],
            empty if name.startswith('empty') else arena.context.get_domain_id(), arena, files)
            for name in wanted}


@pytest.fixture(scope='module')
def near(arena):
    """Enter the arena's domain; return what lets a command in this process enter the graph."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv('ROS_DOMAIN_ID', str(arena.context.get_domain_id()))
        with cli_graph.observer():  # waits until the graph is known

            @contextlib.contextmanager
            def observer(found=None, name=None):
                """Do without the wait."""
                node = Observer(name)
                try:
                    yield node
                finally:
                    node.destroy_node()

            yield observer
        signal.alarm(0)


# ------------------------------------------------------- beside the commands that are replayed

def test_a_graph_is_whole_when_nothing_lacks_its_other_half():
    """Each participant has named a node, and each node that is not hidden has its services."""
    info = {'ros_discovery_info': {1: '', 2: ''}, '/parameter_events': {1: 'arena', 2: '_ros2cli'}}
    written, read = ({'arena': {each: []}, '_ros2cli': {}} for each in (
        'rr/dropReply', 'rq/dropRequest'))
    graph = Namespace(
        get_publishers_info_by_topic=lambda topic, **_: [
            Namespace(endpoint_gid=[number] * 16, node_name=name)
            for number, name in info[topic].items()],
        get_node_names_and_namespaces=lambda: [(name, '/') for name in written],
        get_publisher_names_and_types_by_node=lambda name, *_, **__: written[name].items(),
        get_subscriber_names_and_types_by_node=lambda name, *_, **__: read[name].items())
    assert Observer.is_whole(graph)
    for table, key, value in (
            (info, '/parameter_events', {1: 'arena'}), (written, 'arena', {}), (read, 'arena', {}),
            (info, '/parameter_events', {1: 'arena', 2: '_NODE_NAME_UNKNOWN_'}),
            (written, 'brick', {})):
        with pytest.MonkeyPatch.context() as patch:
            patch.setitem(table, key, value)
            patch.setitem(read, 'brick', {})
            assert not Observer.is_whole(graph)
    assert Observer.is_whole(graph)


def test_a_ctrl_c_is_not_lost(near):
    """Not even where it comes as rclpy throws something away, and Python passes over it."""
    class Ending:

        def __del__(self):
            signal.raise_signal(signal.SIGINT)

    with near() as graph, pytest.raises(KeyboardInterrupt):
        graph.create_timer(GLANCE, Ending)
        graph.spin_until(lambda: False, 10.0)


# What the real tf2_echo says of the transform that the test below publishes.
ECHO = """At time 0.0
- Translation: [1.500, -2.000, 0.250]
- Rotation: in Quaternion (xyzw) [0.034, 0.106, 0.144, 0.983]
- Rotation: in RPY (radian) [0.100, 0.200, 0.300]
- Rotation: in RPY (degree) [5.730, 11.459, 17.189]
- Matrix:
  0.936 -0.275  0.218  1.500
  0.290  0.956 -0.037 -2.000
 -0.199  0.098  0.975  0.250
  0.000  0.000  0.000  1.000
"""


def test_tf2_echo_tells_what_is_published(outcomes, domain_id):
    """As the real ones do, from their executables, until Ctrl-C."""
    publisher, echo = (start(['ros2', 'run', 'tf2_ros', *words.split()], domain_id) for words in (
        'static_transform_publisher --x 1.5 --y -2 --z 0.25 --roll 0.1 --pitch 0.2 --yaw 0.3 '
        '--frame-id world --child-frame-id brick', 'tf2_echo world brick -r 20'))
    echo.wait_for(lambda: echo.has_said('  1.000$'))
    publisher.wait_for(lambda: publisher.error.endswith("to 'brick'\n"))
    for command in (publisher, echo):
        command.send('SIGINT', 'group')
        command.end()
    assert echo.text.startswith(ECHO)
    assert re.sub(r'.*Waiting for transform world ->  brick: .*\n', '', echo.error) == ''
    assert "rotation: ('0.034271', '0.106021', '0.143572', '0.983347')\n" in publisher.error
    assert publisher.error.endswith("from 'world' to 'brick'\n")


def test_nobody_reads_on(outcomes, arena):
    """A pipe that is closed ends the command quietly, as in `ros2 topic echo ... | head`."""
    command = ['bash', '-c', 'ros2 topic echo /turtle1/pose | head -n 1']
    done = start(command, arena.context.get_domain_id())
    done.end()
    assert (done.status, done.error) == (0, '')
    assert done.text.startswith('x: ')


# -------------------------------------------------------------------------------- the comparison

# What may be there or not: lines about a graph that is not known yet, as the real one mostly has;
# lost messages; where the stand-in says what it is; the way to the last line of an error; what
# differs between versions of argparse.
MAY_DIFFER = (
    (r' *qos_overrides:\n( {6}.*\n)+', ''),
    # what the workspace has or does without since
    (r'.*(/catcher_state|/tf2_frames|/parameter_events|qos_overrides)\b.*\n', ''),
    (r'.*RTPS_TRANSPORT_SHM.*\n', ''),  # what DDS complains of on a busy machine
    (r'\$MORE\n?', ''),
    (r'waiting for service to become available\.\.\.\n(?=requester)', ''),
    (r'(Waiting for at least 1 matching subscription\(s\)\.\.\.\n)+(?=publisher)', ''),
    (r'WARNING: topic .* does not appear to be published yet\n(?=average|Subscribed)', ''),
    (r'A message was lost!!!\n.*\n.*---\n', ''),
    (r'\nThis is a stand-in for ros2cli.*\n', ''),
    (r'Traceback \(most recent call last\):\n(  .*\n)+', ''),
    (r'(-\w) [A-Z_]+, (?=--)', r'\1, '),
    (r"'(?=[\w', ]*\)\n)", ''),
    (r'(required: .*), (argv|launch_arguments)\n', r'\1\n'),
    (r'searching: .*', ''),
    # what the workspace says has changed since
    ('centre', 'center'),
    ('metres', 'meters'),
)

# What another node answers, and says in its own words, and what the graph has got since.
ANSWERS = {
    'topic_list_verbose': r'(/(?:tf_static|rosout) .*\] )\d+( )',
    **dict.fromkeys((name for name in RECORDS if name.startswith('param_set')), r'(failed: ).*()'),
    'param_list_all': r'(/(?:arena|catcher|turtle_robot):\n)(?:  .*\n)+()',  # and what it needs
    'param_dump': r'(background_b:).*()',  # what others set
}

TOKENS = {
    'SHARE': re.escape(get_package_share_directory('turtle_brick')),
    'PREFIX': r'\S+',
    'GID': '[0-9a-f.]+',
}


def comparable(name, text):
    """Return what a command prints, without what may differ."""
    for pattern, replacement in MAY_DIFFER:
        text = re.sub(pattern, replacement, text)
    return re.sub(ANSWERS[name], r'\1\2', text) if name in ANSWERS else text


def matches(name, recorded, printed, files):
    """Return whether a command has printed what is recorded."""
    tokens = {**TOKENS, 'PROBE': re.escape(f'{files}/probe'), 'FILES': re.escape(str(files))}
    pattern = re.sub(r'\\\$([A-Z]+)', lambda token: tokens.get(token[1], r'\d[\d.]*'),
                     re.escape(comparable(name, recorded)))
    if RECORDS[name].get('signals') and recorded:
        pattern += r'[\s\S]*'  # it may have gone on until the signal came
    return re.fullmatch(pattern, comparable(name, printed)) is not None


def assert_same(name, done, files):
    """Compare what has come of a command with its record."""
    record = RECORDS[name]
    assert done.status == record['returncode'], done
    for recorded, printed in ((record['stdout'], done.text), (record['stderr'], done.error)):
        if not matches(name, recorded, printed, files):
            assert comparable(name, printed) == comparable(name, recorded)


@pytest.mark.parametrize('name', PROCESSES)
def test_command(name, outcomes, files):
    """The command prints what the real one printed, and ends as it did."""
    assert_same(name, outcomes[name].result(), files)


@pytest.mark.parametrize('name', HERE)
def test_verb(name, near, files, monkeypatch):
    """So does what the command does, in this process."""
    for module in (cli_graph, traffic):
        monkeypatch.setattr(module, 'observer', near)
    record = RECORDS[name]
    done = done_here(with_paths(record['command'], files), monkeypatch, record.get('stdin', ''))
    monkeypatch.undo()
    assert_same(name, done, files)


# Of each message, when it comes (s), and a number n: it is 100 n bytes long, or n ms late. TOLD is
# what the classes of the real one print of these messages after 2 and 3 s, with a window of 3.
COME = ((0.2, 120), (0.5, 80), (0.6, 400), (1.4, 100), (1.9, 300))
TOLD = {
    traffic.bandwidth: """
57.14 KB/s from 3 messages
\tMessage size mean: 26.67 KB min: 10.00 KB max: 40.00 KB
33.33 KB/s from 3 messages
\tMessage size mean: 26.67 KB min: 10.00 KB max: 40.00 KB""",
    traffic.delay: """
average delay: 0.267
\tmin: 0.100s max: 0.400s std dev: 0.12472s window: 3
no new messages""",
    traffic.rate: """
average rate: 2.143
\tmin: 0.100s max: 0.800s std dev: 0.28674s window: 3
"""}


@pytest.mark.parametrize('told', TOLD)
def test_figures(told):
    """What is measured of a topic is what the real one measures."""
    values = {traffic.bandwidth: lambda time, amount: amount * 100,
              traffic.delay: lambda time, amount: time - amount / 1000}
    seen = [(time, values.get(told, max)(time, amount)) for time, amount in COME]
    assert ''.join(f'\n{told(seen[-4:], 3, now, now < 3.0)}' for now in (2.0, 3.0)) == TOLD[told]


# ------------------------------------------------------------------ what the stand-in does better

@pytest.mark.parametrize('words, sentence', [
    ('interface proto a a --b -h', 'ros2 interface proto: this needs the real ros2cli, which this '
                                   'one stands in for'),
    ('bag record -a', 'ros2 bag: this needs a ROS 2 that is installed; here, `ros2 topic echo '
                      '--csv TOPIC > FILE` writes down what comes on a topic'),
    ('topic pub /x String', 'The passed message type is invalid'),
    ('service call /drop Trigger', 'The passed service type is invalid')])
def test_what_cannot_be_done_is_said(words, sentence, files, near, monkeypatch):
    """In one line: what is left out, and what is no type, without its package or of another."""
    monkeypatch.setattr(traffic, 'observer', near)
    done = done_here(['ros2', *words.split()], monkeypatch)
    assert (done.status, done.text, done.error) == (1, '', f'{sentence}\n')


def test_interfaces_are_listed(files, monkeypatch):
    """All of a kind, under its heading, as in the recording of what was installed there."""
    recorded = RECORDS['interface_list']['stdout'].splitlines()
    printed = done_here(['ros2', 'interface', 'list'], monkeypatch).text
    assert [line for line in printed.splitlines() if 'turtle' in line or ':' in line] == recorded


@pytest.mark.parametrize('argument, before, answers', [
    ('launch_file_name', {'package_name': 'turtle_brick'}, {'run_turtle.launch.xml'}),
    ('type', {}, {'turtlesim/msg/Color', 'turtlesim/srv/Kill'}),
    ('parameter_name', {'node_name': '/arena'}, {'gravity_accel'}),
    ('message_type', {'topic_name': '/odom'}, {'nav_msgs/msg/Odometry'})])
def test_tab_knows_what_can_be(argument, before, answers, near, monkeypatch):
    """From the packages, and from the graph."""
    monkeypatch.setattr(cli_graph, 'observer', near)
    table = cli.yaml.safe_load(Path(cli.__file__).with_name('command_line.yaml').read_text())
    known = cli.complete(table['completed'], Namespace(dest=argument), Namespace(**before))
    assert answers <= set(known)


def test_tab_completes(tmp_path, domain_id, monkeypatch):
    """The shell that has sourced env.bash asks in this way, and reads such answers."""
    line = 'ros2 interface show turtlesim/msg/'
    for name, value in (('_ARGCOMPLETE', '1'), ('COMP_LINE', line), ('COMP_POINT', len(line)),
                        ('_ARGCOMPLETE_IFS', '\n'), ('_ARGCOMPLETE_SUPPRESS_SPACE', '0'),
                        ('_ARGCOMPLETE_STDOUT_FILENAME', tmp_path / 'words')):
        monkeypatch.setenv(name, str(value))
    start(['ros2'], domain_id).end()
    assert (tmp_path / 'words').read_text() == 'turtlesim/msg/Color\nturtlesim/msg/Pose'
