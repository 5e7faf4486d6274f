# SPDX-License-Identifier: Apache-2.0
"""Compare the stand-in for `ros2` with recordings of the real `ros2`."""

from argparse import Namespace
from concurrent.futures import ThreadPoolExecutor
import contextlib
import ctypes
import os
import re
import shlex
import shutil
import signal
import threading
from xml.sax.saxutils import unescape

from ament_flake8.main import main_with_errors
from ament_index_python.packages import get_package_share_directory
from ament_pep257.main import main as pep257
from catkin_pkg.package import parse_package
from live_graph import add_nodes
import pytest
import rclpy
from recorded import (Command, FORKS, POLL_TIME, records, restored_signal_handlers, run_here,
                      with_paths, write_files)
from ros2cli.cli import explain_alternative
from ros2cli.node import direct
from ros2cli.node.direct import GraphNode, is_complete
from ros2interface.api import complete_interface
from ros2launch.api import complete_launch_file_name
from ros2param.api import complete_parameter_name
from ros2pkg.api import get_executable_paths
from ros2topic.api import complete_message_type
import ros2topic.verb.bw as bw
import ros2topic.verb.delay as delay_verb
import ros2topic.verb.hz as hz
from turtle_brick_tools.graph import Graph
from turtle_graph.client.domains import reserved_domain

RECORDS = {name: record for name, record in records(
    'cli', 'launch_show_args', 'launch_errors').items()
    if not record['stdout'].startswith('[INFO]')}  # test_launch_standin.py replays the others.


def signals_of(record):
    signals = [] if record.get('stderr') else list(record.get('signals', ()))
    if record.get('ended_by_recorder'):
        signals.append([signals[-1][0] if signals else ['t', 0], 'SIGINT', 'group'])
    return signals


# These commands run in separate processes because they are interrupted, start processes, require
# an empty graph or fail with a traceback. All other commands run in this process.
PROCESSES = [name for name, record in RECORDS.items() if signals_of(record) or re.match(
    'run_(?!help|unk)|ros2_run|empty|pub_times|pub_bad_topic', name)]

INTERFACE_LISTS = {'interface_list': 'turtle|:', 'interface_package': '',
                   'interface_packages': 'turtle|std_'}
"""Patterns for the lines to compare, keyed by recording name."""

# Verbs that set parameters or call services run last, because they affect the other verbs.
HERE = sorted(set(RECORDS).difference(PROCESSES, INTERFACE_LISTS), key=lambda name: (
    re.match('param_(set|load)|call', name) is not None, list(RECORDS).index(name)))


@pytest.fixture(scope='module')
def files(tmp_path_factory):
    top = tmp_path_factory.mktemp('ros2')
    write_files(top)
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv('COLUMNS', '100')
        environment.setenv('LANGUAGE', 'C')  # Otherwise argparse searches for translations.
        environment.setenv('AMENT_PREFIX_PATH',
                           f'{top}/probe:{os.environ["AMENT_PREFIX_PATH"]}')
        yield top


@pytest.fixture(scope='module')
def arena():
    with reserved_domain() as domain, Graph(domain, quiet=True) as graph:
        nodes = add_nodes(graph)
        stopped = threading.Event()

        def spin():
            while not stopped.wait(0.05):  # No test depends on message rates.
                graph.spin_for(0.005)

        spinning = threading.Thread(target=spin, name='arena')
        spinning.start()
        try:
            yield nodes['arena']
        finally:
            stopped.set()
            spinning.join()


def start(words, domain, stdin=''):
    return Command(words, {**os.environ, 'ROS_DOMAIN_ID': str(domain)}, stdin,
                   forked=words[0] == 'ros2' and words[1:2] not in ([], ['run']))


def is_time_for_signal(record, when, command, arena):
    kind, expected = when
    if kind == 'line':
        return command.has_printed(expected)
    # The recorded signal was sent a few seconds after the start, while the command was waiting.
    expected = record['stdout'].replace('$MORE\n', '').count('\n')
    return command.text.count('\n') >= expected if expected else any(
        info.node_name == f'_ros2cli_{command.pid}' for topic in record['command'][3:]
        if topic.startswith('/') for info in arena.get_subscriptions_info_by_topic(topic))


def replay(record, domain, arena, files):
    command = start(with_paths(record['command'], files), domain, record.get('stdin', ''))
    for when, name, target in signals_of(record):
        command.wait_for(lambda: is_time_for_signal(record, when, command, arena))
        command.send(name, target)
    command.end()
    return command


@pytest.fixture(scope='module')
def outcomes(arena, files, request):
    """Run up to six commands in parallel, because most of them only wait."""
    wanted = [item.callspec.params['name'] for item in request.session.items
              if getattr(item, 'function', None) is test_command]
    with reserved_domain() as empty, ThreadPoolExecutor(6) as pool:
        yield {name: pool.submit(
            replay, RECORDS[name],
            empty if name.startswith('empty') else arena.context.get_domain_id(), arena, files)
            for name in wanted}


@pytest.fixture(scope='module')
def open_graph_here(arena):
    """Yield a replacement for open_graph() that does not wait for discovery."""
    with pytest.MonkeyPatch.context() as environment, restored_signal_handlers():
        environment.setenv('ROS_DOMAIN_ID', str(arena.context.get_domain_id()))
        with direct.open_graph() as graph:  # This call waits for discovery.
            direct.joined.clear()  # Commands must not end this process.

            @contextlib.contextmanager
            def open_graph(found=None, name=None):
                with restored_signal_handlers():
                    node = GraphNode(name)
                    try:
                        yield node
                    finally:
                        node.destroy_node()

            yield open_graph
        graph.destroy_node()
        rclpy.try_shutdown()


def test_graph_is_complete_when_all_nodes_and_services_are_announced():
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
    assert is_complete(graph)
    for table, key, value in (
            (info, '/parameter_events', {1: 'arena'}), (written, 'arena', {}), (read, 'arena', {}),
            (info, '/parameter_events', {1: 'arena', 2: '_NODE_NAME_UNKNOWN_'}),
            (written, 'brick', {})):
        with pytest.MonkeyPatch.context() as patch:
            patch.setitem(table, key, value)
            patch.setitem(read, 'brick', {})
            assert not is_complete(graph)
    assert is_complete(graph)


def test_ctrl_c_in_a_destructor_ends_spinning(open_graph_here):
    """Python ignores exceptions in destructors."""
    class Ending:

        def __del__(self):
            signal.raise_signal(signal.SIGINT)

    with open_graph_here() as graph, pytest.raises(KeyboardInterrupt):
        graph.create_timer(POLL_TIME, Ending)
        graph.spin_until(lambda: False, 10.0)


TF2_ECHO_OUTPUT = """At time 0.0
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
"""Output of the real tf2_echo."""


def test_tf2_echo_prints_published_transform(outcomes, domain_id):
    publisher, echo = (start(['ros2', 'run', 'tf2_ros', *words.split()], domain_id) for words in (
        'static_transform_publisher --x 1.5 --y -2 --z 0.25 --roll 0.1 --pitch 0.2 --yaw 0.3 '
        '--frame-id world --child-frame-id brick', 'tf2_echo world brick 20'))
    echo.wait_for(lambda: echo.has_printed('  1.000$'))
    publisher.wait_for(lambda: publisher.error.endswith("to 'brick'\n"))
    for command in (publisher, echo):
        command.send('SIGINT', 'group')
        command.end()
    assert echo.text.startswith(TF2_ECHO_OUTPUT)
    assert re.sub(r'.*Waiting for transform world ->  brick: .*\n', '', echo.error) == ''
    assert "rotation: ('0.034271', '0.106021', '0.143572', '0.983347')\n" in publisher.error
    assert publisher.error.endswith("from 'world' to 'brick'\n")


def test_view_frames_writes_the_tree_of_an_old_style_publisher(outcomes, domain_id, tmp_path):
    publisher = start(['ros2', 'run', 'tf2_ros', 'static_transform_publisher',
                       *'0 -1.5 0 0 0 0 1 world odom'.split()], domain_id)
    assert publisher.wait_for(lambda: 'translation' in publisher.error)
    viewer = start(['ros2', 'run', 'tf2_tools', 'view_frames', '-t', '5',
                    '-o', f'{tmp_path}/frames'], domain_id)
    viewer.end()
    publisher.send('SIGINT', 'group')
    publisher.end()
    assert 'Old-style arguments are deprecated; see --help for new-style arguments' in (
        publisher.error)
    assert "translation: ('0.000000', '-1.500000', '0.000000')" in publisher.error
    label = ''.join(f'{line}\\n' for line in (
        'Broadcaster: default_authority', 'Average rate: 10000.0', 'Buffer length: 0.0',
        'Most recent transform: 0.0', 'Oldest transform: 0.0'))
    assert re.sub(r'[\d.]{12,}', '', (tmp_path / 'frames.gv').read_text()) == (
        f'digraph G {{\n"world" -> "odom"[label=" {label}"];\nedge [style=invis];\n'
        ' subgraph cluster_legend { style=bold; color=black; label ="view_frames Result";\n'
        '"Recorded at time: "[ shape=plaintext ] ;\n}->"world";\n}')
    assert (viewer.status == 0) == (tmp_path / 'frames.pdf').is_file() == bool(shutil.which('dot'))
    assert viewer.status == 0 or 'A PDF requires Graphviz' in viewer.error


@pytest.mark.parametrize('words', [
    'ros2 topic echo /x std_msgs/msg/String', 'ros2 run tf2_ros tf2_echo a b',
    'ros2 run turtlesim turtlesim_node'])
def test_sigterm_ends_a_command_at_any_moment(words, domain_id):
    for delay in (0.0, 0.2, 0.5, 1.0):
        command = Command(words.split(), {**os.environ, 'ROS_DOMAIN_ID': str(domain_id)})
        command.wait_for(lambda: False, delay)
        command.send('SIGTERM', 'process')
        assert command.end(30.0) == []
        assert 'Exception' not in command.error


def test_ctrl_c_during_the_imports_prints_no_traceback(tmp_path):
    for module in ('rclpy', 'yaml'):
        (tmp_path / f'{module}.py').write_text('import signal\nsignal.raise_signal(signal.SIGINT)')
    path = f'{tmp_path}:{os.environ["PYTHONPATH"]}'
    packages = ('turtlesim', 'joint_state_publisher', 'robot_state_publisher')
    programs = [path for package in packages for path in get_executable_paths(package)]
    for program in (shutil.which('ros2'), shutil.which('rviz2'), *programs):
        command = Command([program], {**os.environ, 'PYTHONPATH': path})
        command.end(30.0)
        assert (program, command.status, command.error) == (program, -signal.SIGINT, '')


def test_closed_pipe_ends_command_without_error(outcomes, arena):
    command = ['bash', '-c', 'ros2 topic echo /turtle1/pose | head -n 1']
    done = start(command, arena.context.get_domain_id())
    done.end()
    assert (done.status, done.error) == (0, '')
    assert done.text.startswith('x: ')


NOISE = (
    r'.*RTPS_TRANSPORT_SHM.*\n', r'waiting for service to become available\.\.\.\n(?=requester)',
    r'(Waiting for at least 1 matching subscription\(s\)\.\.\.\n)+(?=publisher)',
    r'WARNING: topic .* does not appear to be published yet\n(?=average|Subscribed)',
    r'A message was lost!!!\n.*\n.*---\n', r'no new messages\n')
"""Patterns for lines that a busy machine adds to the output."""

ANSWERS = {
    # rclpy and rclcpp give different reasons for rejecting a parameter.
    **dict.fromkeys(('param_delete', 'param_load', 'param_set_out_of_range', 'param_set_unknown',
                     'param_set_wrong_type'), r'(failed: ).*()'),
    # This warning appears only if the command has not yet discovered the publisher.
    'topic_delay_without_header': r'()WARNING: .*\n()',
}
"""Patterns for output that may differ from the recording, keyed by recording name."""

TOKENS = {
    'SHARE': re.escape(get_package_share_directory('turtle_brick')),
    'PREFIX': r'\S+',
    'GID': '[0-9a-f.]+',
    'ID': '[0-9a-f]{32}',
}
"""Patterns for placeholders in the recordings. By default, a placeholder stands for a number."""


def comparable(name, text):
    for pattern in NOISE:
        text = re.sub(pattern, '', text)
    return re.sub(ANSWERS[name], r'\1\2', text) if name in ANSWERS else text


def matches(name, recorded, printed, files):
    tokens = {**TOKENS, 'PROBE': re.escape(f'{files}/probe'), 'FILES': re.escape(str(files))}
    pattern = re.sub(r'\\\$([A-Z]+)', lambda token: tokens.get(token[1], r'\d[\d.]*'),
                     re.escape(comparable(name, recorded)))
    if RECORDS[name].get('signals') and recorded:
        pattern += r'[\s\S]*'  # More lines may appear before the signal arrives.
    return re.fullmatch(pattern, comparable(name, printed)) is not None


def assert_same(name, done, files):
    record = RECORDS[name]
    assert done.status == record['returncode'], done
    for recorded, printed in ((record['stdout'], done.text), (record['stderr'], done.error)):
        if not matches(name, recorded, printed, files):
            assert comparable(name, printed) == comparable(name, recorded)


@pytest.mark.parametrize('name', PROCESSES)
def test_command(name, outcomes, files):
    assert_same(name, outcomes[name].result(), files)


@pytest.mark.parametrize('name', HERE)
def test_verb(name, open_graph_here, files, monkeypatch):
    monkeypatch.setattr(direct, 'open_graph', open_graph_here)
    record = RECORDS[name]
    done = run_here(with_paths(record['command'], files), monkeypatch, record.get('stdin', ''))
    monkeypatch.undo()
    assert_same(name, done, files)


PACKAGES = {
    '--build-type ament_python --node-name my_node --dependencies rclpy std_msgs':
        'LICENSE my_package/__init__.py my_package/my_node.py package.xml resource/my_package '
        'setup.cfg setup.py test/test_copyright.py test/test_flake8.py test/test_pep257.py',
    '--build-type ament_cmake --node-name my_node --dependencies std_msgs':
        'CMakeLists.txt LICENSE package.xml src/my_node.cpp'}
"""Files of a new package, keyed by the arguments of `ros2 pkg create`."""


@pytest.mark.parametrize('arguments', PACKAGES)
def test_created_package_has_the_files_of_the_real_command(arguments, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ['ros2', 'pkg', 'create', 'my_package', '--license', 'MIT', '--description',
             "It's <new>", '--maintainer-name', 'Ann', '--maintainer-email', 'ann@b.example',
             *arguments.split()]
    done = run_here(words, monkeypatch)
    assert (done.status, done.error) == (0, '')
    assert "maintainer: ['Ann <ann@b.example>']\n" in done.text
    folder = tmp_path / 'my_package'
    assert sorted(str(path.relative_to(folder)) for path in folder.rglob('*')
                  if path.is_file()) == PACKAGES[arguments].split()
    warnings = []
    package = parse_package(folder, warnings=warnings)
    assert (warnings, unescape(package.description)) == ([], "It's <new>")
    assert package.licenses == ['MIT']
    assert [each.name for each in package.exec_depends] == arguments.split()[5:]
    assert main_with_errors(argv=[str(folder)])[0] == 0
    assert pep257([str(folder)]) == 0
    assert 'The directory already exists: ./my_package' in run_here(words, monkeypatch).error


def test_unknown_license_is_declared_with_a_warning(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = run_here(['ros2', 'pkg', 'create', 'my_package', '--license', 'Beer'], monkeypatch)
    assert "[WARNING]: Unknown license 'Beer'." in done.text
    assert done.text.endswith('\nApache-2.0\nBSD-3-Clause\nMIT\n')
    assert parse_package(tmp_path / 'my_package').licenses == ['Beer']


MESSAGES = ((0.2, 120), (0.5, 80), (0.6, 400), (1.4, 100), (1.9, 300))
"""Reception time (s) and delay n (ms) of each message, whose size is 100 * n bytes."""

REPORTS = {
    bw: """
57.14 KB/s from 3 messages
\tMessage size mean: 26.67 KB min: 10.00 KB max: 40.00 KB
33.33 KB/s from 3 messages
\tMessage size mean: 26.67 KB min: 10.00 KB max: 40.00 KB""",
    delay_verb: """
average delay: 0.267
\tmin: 0.100s max: 0.400s std dev: 0.12472s window: 3
no new messages""",
    hz: """
average rate: 2.143
\tmin: 0.100s max: 0.800s std dev: 0.28674s window: 3
"""}
"""With a window of 3, the real `ros2 topic` prints these reports on MESSAGES at 2 s and 3 s."""


@pytest.mark.parametrize('verb', REPORTS)
def test_statistics_are_those_of_the_real_ros2(verb):
    if verb is bw:
        samples = [(time, n * 100) for time, n in MESSAGES[-3:]]
        printed = [bw.report(samples, now) for now in (2.0, 3.0)]
    else:
        samples = [(time, time - n / 1000) for time, n in MESSAGES[-4:]]
        printed = [verb.report(samples, now, now < 3.0) for now in (2.0, 3.0)]
    assert '\n'.join(['', *printed]) == REPORTS[verb]


@pytest.mark.parametrize('words, sentence', [
    ('topic echo /odom --raw',
     'this stand-in for ros2cli does not support ros2 topic echo --raw'),
    ('bag record -a',
     'ros2 bag is not supported by this stand-in: use `ros2 topic echo --csv TOPIC > FILE` to '
     'record a topic'),
    ('security create_keystore keys',
     'ros2 security is not supported by this stand-in: use another ROS_DOMAIN_ID to separate '
     'graphs, because the environment contains no SROS 2'),
    ('lifecycle set /talker configure',
     'ros2 lifecycle is not supported by this stand-in: use `ros2 service call NODE/change_state '
     "lifecycle_msgs/srv/ChangeState '{transition: {id: 1}}'`, which also requests a transition, "
     'and `ros2 service call NODE/get_state lifecycle_msgs/srv/GetState`'),
    ('param set /arena gravity_accel 2024-01-01',
     '2024-01-01 is not a bool, a number, text or a list of these in YAML. For text, add quotes: '
     '"\'2024-01-01\'"'),
    ('topic pub /x String', 'The passed message type is invalid'),
    ('service call /drop Trigger', 'The passed service type is invalid')])
def test_missing_verb_or_invalid_type_is_one_line(words, sentence, files, open_graph_here,
                                                  monkeypatch):
    monkeypatch.setattr(direct, 'open_graph', open_graph_here)
    done = run_here(['ros2', *words.split()], monkeypatch)
    assert (done.status, done.text, done.error) == (1, '', f'{sentence}\n')


EXAMPLES = {
    '': (0, '\n  topic      Various topic related sub-commands\n'),
    'fly': (2, "invalid choice: 'fly'"),
    'topic': (0, '\n  hz     Print the average publishing rate to screen\n'),
    'topic fly': (2, 'ros2 topic: error: argument Call `ros2 topic <command> -h` for more'),
    'topic pub -h': (0, ' Quality of service preset profile to publish with (default: default)'),
    'run probe': (2, 'the following arguments are required: executable_name'),
    'launch': (2, 'the following arguments are required: package_name'),
    'launch nothing a.launch.py': (1, "Package 'nothing' not found: "),
    'launch nothing.launch.py': (1, "'nothing.launch.py' is not a valid package name"),
    'node info /catcher': (0, '\n  Publishers:\n    /catcher_decision: '),
    'node info /turtlesim':
        (0, '  Action Servers:\n    /turtle1/rotate_absolute: turtlesim/action/RotateAbsolute\n'),
    'topic list': (0, '/odom\n'),
    'topic list -t': (0, '/odom [nav_msgs/msg/Odometry]\n'),
    'topic list -v': (0, ' * /odom [nav_msgs/msg/Odometry] 1 publisher\n'),
    'topic list --include-hidden-topics': (0, '/turtle1/rotate_absolute/_action/feedback\n'),
    'service list': (0, '/drop\n'),
    'param list': (0, '\n/turtlesim:\n  background_b\n'),
    'param dump /turtlesim': (0, '/turtlesim:\n  ros__parameters:\n    background_b: '),
    'param load /turtlesim nothing.yaml': (1, 'FileNotFoundError: [Errno 2] No such file or'),
    "topic pub --once /x std_msgs/msg/String '{data: '": (1, 'yaml.parser.ParserError: '),
    "service call /place turtle_brick_interfaces/srv/Place '{location: {x: '":
        (1, 'yaml.parser.ParserError: '),
    "service call /place turtle_brick_interfaces/srv/Place '{location: {z: -5.0}}'":
        (0, 'response:\nturtle_brick_interfaces.srv.Place_Response(success=False, message=')}
"""Exit status and part of the output, keyed by the words after `ros2`."""


def test_an_alternative_is_suggested_only_for_what_is_missing(tmp_path, monkeypatch):
    """The workspace may contain the source code of a package that the environment lacks."""
    with pytest.raises(SystemExit, match='demo_nodes_py is not supported'):
        explain_alternative(['run', 'demo_nodes_py', 'talker'])
    for path in ('lib/demo_nodes_py/talker',
                 'share/ament_index/resource_index/packages/demo_nodes_py'):
        (tmp_path / path).parent.mkdir(parents=True)
        (tmp_path / path).touch(0o755)
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{tmp_path}:{os.environ["AMENT_PREFIX_PATH"]}')
    explain_alternative(['run', 'demo_nodes_py', 'talker'])
    with pytest.raises(SystemExit, match='tf2_monitor is not supported'):
        explain_alternative(['run', 'tf2_ros', 'tf2_monitor'])


@pytest.mark.parametrize('words', EXAMPLES)
def test_verb_by_example(words, files, open_graph_here, monkeypatch):
    monkeypatch.setattr(direct, 'open_graph', open_graph_here)
    done = run_here(['ros2', *shlex.split(words)], monkeypatch)
    monkeypatch.undo()
    status, text = EXAMPLES[words]
    assert (done.status or 0) == status
    assert text in done.text + done.error


@pytest.mark.parametrize('words, pattern', [
    ('topic echo /turtle1/pose', r'(x: .*\n(.*\n)+---\n){2}'),
    ('topic bw /odom', r'Subscribed to \[/odom\]\n[\d.]+ K?B/s from \d+ messages\n\tMessage size '
     r'mean: 0.72 KB min: 0.72 KB max: 0.72 KB\n'),
    ('topic pub --once /x std_msgs/msg/String', r'Waiting for at least 1 matching subscription')])
def test_ctrl_c_ends_a_verb_that_waits(words, pattern, arena):
    command = start(['ros2', *words.split()], arena.context.get_domain_id())
    assert command.wait_for(lambda: re.search(pattern, command.text)), command.text
    command.send('SIGINT', 'group')
    command.end()
    assert command.status == 2


@pytest.mark.parametrize('name', INTERFACE_LISTS)
def test_interfaces_are_listed(name, monkeypatch):
    printed = run_here(RECORDS[name]['command'], monkeypatch).text.splitlines()
    found = [line for line in printed if re.search(INTERFACE_LISTS[name], line)]
    recorded = RECORDS[name]['stdout'].splitlines()
    assert found == (sorted(recorded) if name == 'interface_package' else recorded)


@pytest.mark.parametrize('words, text', [
    ('service info /drop', 'Type: std_srvs/srv/Trigger\nClients count: 0\nServices count: 1\n'),
    ('action list -t', '/turtle1/rotate_absolute [turtlesim/action/RotateAbsolute]\n'),
    ('action info -t /turtle1/rotate_absolute',
     'Action: /turtle1/rotate_absolute\nAction clients: 0\nAction servers: 1\n'
     '    /turtlesim [turtlesim/action/RotateAbsolute]\n'),
    ('action type /turtle1/rotate_absolute', 'turtlesim/action/RotateAbsolute\n'),
    ('daemon status', 'The daemon is not running\n'),
    ('param list --param-type --filter gravity /arena', '  gravity_accel (type: double)\n')])
def test_verb_without_recording(words, text, open_graph_here, monkeypatch):
    monkeypatch.setattr(direct, 'open_graph', open_graph_here)
    assert run_here(['ros2', *words.split()], monkeypatch).text == text


def block():
    """Hold Python's global interpreter lock, as Fast DDS sometimes does."""
    direct.exit_after(0.1, 3)
    ctypes.PyDLL(None).pause()


def test_blocked_command_ends_with_the_status_of_its_work():
    process = FORKS.Process(target=block)
    process.start()
    process.join()
    assert process.exitcode == 3


@pytest.mark.parametrize('complete, before, answers', [
    (complete_launch_file_name, {'package_name': 'turtle_brick'}, {'run_turtle.launch.xml'}),
    (complete_interface, {}, {'turtlesim/msg/Color', 'turtlesim/srv/Kill'}),
    (complete_parameter_name, {'node_name': '/arena'}, {'gravity_accel'}),
    (complete_message_type, {'topic_name': '/odom'}, {'nav_msgs/msg/Odometry'})])
def test_completion_offers_existing_names(complete, before, answers, open_graph_here,
                                          monkeypatch):
    monkeypatch.setattr(direct, 'open_graph', open_graph_here)
    assert answers <= set(complete('', Namespace(**before)))


def test_completion_offers_every_format_of_launch_files(tmp_path, monkeypatch):
    index = tmp_path / 'share/ament_index/resource_index/packages'
    for path in (index / 'some', *(tmp_path / 'share/some/launch' / name for name in (
            'a.launch.py', 'b.launch.xml', 'c.launch.yaml', 'd_launch.yml', 'e.launch', 'f.txt'))):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    assert sorted(complete_launch_file_name('', Namespace(package_name='some'))) == [
        'a.launch.py', 'b.launch.xml', 'c.launch.yaml', 'd_launch.yml', 'e.launch']


@pytest.mark.parametrize('line, words', [
    ('interface show turtlesim/msg/', 'turtlesim/msg/Color\nturtlesim/msg/Pose'),
    ('launch turtle_brick turtle_arena.launch.p', 'turtle_arena.launch.py ')])
def test_shell_completes_after_tab(line, words, tmp_path, domain_id, monkeypatch):
    line = f'ros2 {line}'
    for name, value in (('_ARGCOMPLETE', '1'), ('COMP_LINE', line), ('COMP_POINT', len(line)),
                        ('_ARGCOMPLETE_IFS', '\n'), ('_ARGCOMPLETE_SUPPRESS_SPACE', '0'),
                        ('_ARGCOMPLETE_STDOUT_FILENAME', tmp_path / 'words')):
        monkeypatch.setenv(name, str(value))
    start(['ros2'], domain_id).end()
    assert (tmp_path / 'words').read_text() == words
