# SPDX-License-Identifier: Apache-2.0
"""Compare the stand-in for the launch packages with recordings of the real packages."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cache
import importlib.metadata
import os
from pathlib import Path
import re
import subprocess
import sys
from tempfile import gettempdir
import threading
from types import ModuleType, SimpleNamespace

from ament_index_python.packages import get_package_share_directory
import launch
from launch.invalid_launch_file_error import InvalidLaunchFileError
from launch.launch_description_sources.any_launch_file_utilities import (
    get_launch_description_from_any_launch_file)
from launch_testing.loader import TestRun
import pytest
from recorded import Command, PROGRAMS, records, run_here, TIMEOUT, with_paths, write_files
import yaml

# A module-level skip would make the launch_testing plugin skip all files in this folder.
pytestmark = pytest.mark.skipif(importlib.metadata.version('launch') != '1.0.0',
                                reason='the installed launch is the real one')

SHARE = get_package_share_directory('turtle_brick')


def recorded(*names):
    """Return the recordings in the given files as test parameters."""
    return [pytest.param(record, id=name)
            for name, record in records(*(f'launch_{name}' for name in names)).items()
            if names[0] != 'errors' or record['stdout'].startswith('[INFO]')]


@pytest.fixture(scope='module')
def files(tmp_path_factory):
    top = tmp_path_factory.mktemp('ros2')
    write_files(top)
    for package in ('rviz2', 'joint_state_publisher', 'joint_state_publisher_gui'):
        program = top / 'others' / 'lib' / package / package
        mark = top / 'others/share/ament_index/resource_index/packages' / package
        for path in (program, mark):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch(0o755)
    return top


@pytest.fixture
def environment(files, runs, monkeypatch):
    monkeypatch.setenv('AMENT_PREFIX_PATH', os.pathsep.join(
        [str(files / 'probe'), os.environ['AMENT_PREFIX_PATH'], str(files / 'others')]))
    monkeypatch.setenv('COLUMNS', '100')
    monkeypatch.delenv('QT_QPA_PLATFORM', raising=False)
    before = dict(os.environ)
    yield
    os.environ.clear()  # Launch actions may have changed environment variables.
    os.environ.update(before)


def normal(text, files, log_dir=None):
    """Replace paths, process IDs and other variable text with the recorded placeholders."""
    text = text.replace('\r\n', '\n')
    if log_dir:
        text = text.replace(str(log_dir), '$LOGDIR')
    text = text.replace(f'{files}/probe', '$PROBE').replace(str(files), '$FILES')
    text = text.replace(SHARE, '$SHARE')
    text = re.sub(r'(pid \[?)\d+', r'\1$PID', text)
    text = re.sub(rf'{re.escape(gettempdir())}/launch_params_\w+', '$TMP1', text)
    text = re.sub(r'<launch[^>]* object at [^>]*>', '$OBJECT', text)
    text = re.sub(r'(?m)^(\[.*?\] )?(Traceback .*:)(\n\1?  .*)+', r'\1\2\n\1  $TRACEBACK', text)
    return re.sub(r'([=_-])\1{2,}', r'\1\1\1', re.sub(r'in \d+\.\d+s', 'in $N s', text))


@cache
def xacro(*arguments):
    """Run xacro and cache the result, because each run takes half a second."""
    return subprocess.run(['xacro', *arguments], capture_output=True, text=True)


@pytest.fixture
def starts(monkeypatch):
    """Run `true` instead of each command, and return the list of commands and their options."""
    found = []

    def start(command, **options):
        if command[0] == sys.executable:  # The real package lets the kernel read the first line.
            command = command[1:]
        found.append((command, options))
        # With a preexec_fn, Python would copy this large process for each command.
        return subprocess.Popen(['true'], **{
            **options, 'shell': False, 'cwd': None, 'env': None, 'preexec_fn': None})

    def run_once(command, **options):
        return xacro(*command[1:]) if command[0] == 'xacro' else (
            subprocess.run(command, **options))

    monkeypatch.setattr(launch.actions.execute_local, 'subprocess', SimpleNamespace(
        Popen=start, PIPE=subprocess.PIPE))
    monkeypatch.setattr(launch.substitutions.command, 'subprocess', SimpleNamespace(
        run=run_once, PIPE=subprocess.PIPE, STDOUT=subprocess.STDOUT))
    return found


def process_record(command, options, temporary, files, inherited):
    argv = [command] if options['shell'] else list(command)
    written = {}
    for index, part in enumerate(argv):
        if Path(part).name.startswith('launch_params_'):
            temporary.append(part)
            content = yaml.unsafe_load(Path(part).read_text())
            for node in content.values():
                for name, value in node['ros__parameters'].items():
                    if isinstance(value, tuple):
                        value = ['$TUPLE', *value]
                    if value == xacro(f'{SHARE}/urdf/turtle.urdf.xacro').stdout:
                        value = '$STDOUT(xacro $SHARE/urdf/turtle.urdf.xacro)'
                    node['ros__parameters'][name] = value
            written[f'$TMP{len(temporary)}'] = content
            argv[index] = f'$TMP{len(temporary)}'
    argv = [re.sub(r'^.*(?=/lib/(turtle|joint|robot|rviz))', '$PREFIX', normal(part, files))
            for part in argv]
    env = options['env']
    exact = not env.keys() >= {'HOME', 'PATH'}
    cwd = options['cwd'] and normal(options['cwd'], files)
    return {'argv': argv, 'cwd': cwd, 'files': written,
            'environment': env if exact else
            {name: value for name, value in env.items() if inherited.get(name) != value}}


@pytest.mark.parametrize('record', recorded('features', 'processes'))
def test_started_processes_match_recording(record, files, environment, starts, monkeypatch):
    for name, value in (record.get('environment') or {}).items():
        monkeypatch.setenv(name, value)
    before = dict(os.environ)
    done = run_here(with_paths(record['command'], files), monkeypatch)
    output = normal(done.text, files, launch.logging.launch_config.log_dir)
    assert done.status == record['returncode']
    if record.get('stdout'):
        assert without_reasons(output) == without_reasons(record['stdout'])
    for line in record.get('log', ()):
        assert line in output.split('\n')
    temporary = []
    found = [process_record(*each, temporary, files, before) for each in starts]
    expected = [{'argv': [' '.join(each['argv'])] if '|' in each['argv'] else each['argv'],
                 'cwd': each.get('cwd'), 'files': each.get('files', {}),
                 'environment': each['environment']} for each in record['processes']]
    assert found == expected
    names = re.findall(r'\[INFO\] \[(.*)\]: process started', output)
    assert names == [each['process'] for each in record['processes']]


def without_reasons(text):
    """Hide the reasons of errors. Those of the stand-in are tested by their own examples."""
    return re.sub(r'(\[ERROR\] \[launch(_ros\.actions\.node)?\]: ).*(\n(?!\[).*)*', r'\1', text)


@pytest.mark.parametrize('record', recorded('errors', 'more') + recorded('cases'))
def test_output_matches_recording(record, files, environment, tmp_path, monkeypatch):
    if 'files' in record:
        for name, text in record['files'].items():
            (tmp_path / name).write_text(text)
        monkeypatch.chdir(tmp_path)
        monkeypatch.setenv('AMENT_PREFIX_PATH',
                           f'{files}/cases:{os.environ["AMENT_PREFIX_PATH"]}')
    done = run_here(with_paths(record['command'], files), monkeypatch)
    text = done.text.replace(str(tmp_path), '$DIR').replace(f'{files}/cases', '$PREFIX')
    output = normal(text, files, launch.logging.launch_config.log_dir)
    found, expected = (
        by_source(without_reasons(re.sub('searching: .*', 'searching', each)))
        for each in (output, record['stdout']))
    assert found == expected
    assert done.status == record['returncode']


NODE = 'launch:\n- node:\n    pkg: turtlesim\n    exec: turtlesim_node\n'
MISTAKES = [
    ('launch:', "'launch' must contain a list of entities"),
    ('launch:\n  log:\n    message: no dash', 'Is there a dash in front of each entity?'),
    ('launch:\n- log:\n  message: not indented',
     "but is {'log': None, 'message': 'not indented'}. Are the attributes indented"),
    ('launch:\n- group:\n    scoped: true', "'group' must contain a list of entities"),
    ('- log:\n    message: no root', "must have exactly one root, which is 'launch'"),
    ('launch:\n- log: hi',
     "'log' contains only 'hi', but must have attributes or nested entities"),
    ('launch:\n- group:\n  - logg:\n      message: hi',
     "'logg' is not an action. The stand-in for launch supports append_env, arg,"),
    ('launch:\n- group:\n  - log:\n      message: hi\n      if: false',
     "Attribute 'if' of 'log' is False of type bool, but must be str"),
    ('launch:\n- log:\n    massage: hi', "'log' requires the attribute 'message'"),
    (f'{NODE}    nam: n',
     "'node' does not support 'nam'. The stand-in for launch supports args, cwd, emulate_tty,"),
    (f'{NODE}    param:\n      name: a\n      value: 1',
     "Attribute 'param' of 'node' is {'name': 'a', 'value': 1}, but must be a list of"),
    (f'{NODE}    param:\n    - name: a\n      vaule: 1',
     "'param' does not support 'vaule'. The stand-in for launch supports"),
    (f'{NODE}    param:\n    - name: a\n      value:',
     "Attribute 'value' of 'param' is None of type NoneType, but must be a number, a"),
    (f'{NODE}    param:\n    - name: a\n      value: x\n      type: int',
     "Attribute 'value' of 'param' is 'x' of type str, but must be int"),
    (f'{NODE}    remap:\n    - a: b', "'remap' requires the attribute 'from'"),
    ('<launch><timer period="soon"/></launch>',
     "Attribute 'period' of 'timer' is 'soon' of type str, but must be float"),
    ('<launch>log hi</launch>',
     "'launch' contains only the text 'log hi', but must have attributes"),
    ('<launch><node pkg="turtlesim" executable="turtlesim_node"/></launch>',
     "'node' requires the attribute 'exec'"),
    ('<launch><group ns="a"/></launch>',
     "'group' does not support 'ns'. The stand-in for launch supports forwarding, if, keep,"),
    ('<launch><log message="hi" if="true" unless="false"/></launch>',
     "'log' has both attributes 'if' and 'unless', but only one of them is allowed"),
    ('<launch><log message="$(param x)"/></launch>',
     '$(param ...) is not a substitution. The stand-in for launch supports all, and, anon,')]


@pytest.mark.parametrize('text, expected', MISTAKES)
def test_mistake_in_launch_file_is_named(text, expected, environment, tmp_path, monkeypatch):
    path = tmp_path / ('wrong.launch.xml' if text[0] == '<' else 'wrong.launch.yaml')
    path.write_text(text)
    done = run_here(['ros2', 'launch', str(path)], monkeypatch)
    assert done.status == 1
    assert expected in done.text


@pytest.mark.parametrize('name, text', [
    ('all.launch.xml', '<launch><include file="part.launch.xml"><let name="side" value="left"/>'
     '</include></launch>'),
    ('all.launch.yaml', 'launch:\n- include:\n    file: part.launch.xml\n    let:\n'
     '    - name: side\n      value: left')])
def test_include_accepts_let(name, text, environment, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path('part.launch.xml').write_text(
        '<launch><arg name="side"/><log message="$(var side)"/></launch>')
    Path(name).write_text(text)
    done = run_here(['ros2', 'launch', name], monkeypatch)
    assert done.text.endswith('[INFO] [launch.user]: left\n')


def test_debug_option_prints_the_traceback_of_an_error(environment, tmp_path, monkeypatch):
    path = tmp_path / 'wrong.launch.py'
    path.write_text('def generate_launch_description():\n    return Node()\n')
    done = run_here(['ros2', 'launch', '-d', str(path)], monkeypatch)
    assert done.status == 1
    assert '[DEBUG] [launch]: Traceback (most recent call last):\n' in done.text
    assert f'File "{path}", line 2, in generate_launch_description\n' in done.text


def test_interrupted_command_is_not_an_error(environment, tmp_path, monkeypatch):
    path = tmp_path / 'command.launch.xml'
    path.write_text('<launch><log message="$(command '
                    '\'sh -c &quot;kill -INT $PPID; exit 1&quot;\')"/></launch>')
    done = run_here(['ros2', 'launch', str(path)], monkeypatch)
    assert done.status == 0
    assert done.text.endswith('user interrupted with ctrl-c (SIGINT)\n')


COMMON_FEATURES = """
from launch import LaunchDescription
from launch.actions import EmitEvent, ExecuteProcess, LogInfo, RegisterEventHandler
from launch.conditions import LaunchConfigurationEquals, LaunchConfigurationNotEquals
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import AnonName, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterFile


def generate_launch_description():
    parameters = ParameterFile('parameters.yaml', allow_substs=True)
    node = Node(package='turtle_brick', executable='arena', prefix='echo', output='screen',
                name=AnonName('anonymous'), parameters=[parameters])
    return LaunchDescription([
        LogInfo(msg='equal', condition=LaunchConfigurationEquals('side', 'left')),
        LogInfo(msg='wrong', condition=LaunchConfigurationNotEquals('side', 'left')),
        LogInfo(msg='different', condition=LaunchConfigurationNotEquals('side', None)),
        LogInfo(msg=PythonExpression('os.path.join("a", "b")', python_modules=['os'])),
        ExecuteProcess(cmd=['sleep', '60']), node,
        RegisterEventHandler(OnProcessExit(
            target_action=node, on_exit=EmitEvent(event=Shutdown(reason='done'))))])
"""


def test_common_features_without_recordings(environment, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path('common.launch.py').write_text(COMMON_FEATURES)
    Path('parameters.yaml').write_text('side: $(var side)')
    done = run_here(['ros2', 'launch', 'common.launch.py', 'side:=left'], monkeypatch)
    assert done.status == 0
    messages = re.findall(r'launch.user\]: (.*)', done.text)
    assert messages == ['equal', 'different', 'a/b']
    path = re.search(r'__node:=anonymous_\S*_\d+ --params-file (\S+)', done.text)[1]
    assert Path(path).read_text() == 'side: left'
    assert "sending signal 'SIGINT' to process[sleep-1]" in done.text


CONDITIONAL = """
from launch import LaunchDescription
from launch.actions import (DeclareLaunchArgument, GroupAction, IncludeLaunchDescription,
                            TimerAction)
from launch.conditions import IfCondition
from launch.launch_description_sources import AnyLaunchDescriptionSource


def generate_launch_description():
    on = IfCondition('1')
    return LaunchDescription([
        DeclareLaunchArgument('plain'),
        DeclareLaunchArgument('own', condition=on),
        GroupAction([DeclareLaunchArgument('grouped')], condition=on),
        GroupAction([GroupAction([DeclareLaunchArgument('nested')])], condition=on),
        TimerAction(period=1.0, actions=[DeclareLaunchArgument('timed')]),
        GroupAction([DeclareLaunchArgument('plain')], condition=on),
        IncludeLaunchDescription(AnyLaunchDescriptionSource('part.launch.xml'), condition=on),
        DeclareLaunchArgument('own')])
"""


def test_arguments_under_a_condition_are_marked_as_by_the_real_command(
        environment, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path('a.launch.py').write_text(CONDITIONAL)
    Path('part.launch.xml').write_text('<launch><arg name="included"/></launch>')
    done = run_here(['ros2', 'launch', '-s', 'a.launch.py'], monkeypatch)
    assert re.findall(r"'(\w+)':(.*)", done.text) == [
        ('plain', ''), ('own', '*'), ('grouped', '*'), ('nested', ''), ('timed', '*'),
        ('included', '')]
    assert done.text.endswith(
        '\n\n* argument(s) which are only used if specific conditions occur\n')


SCRIPT = '#!/usr/other/python3 -u\nimport rclpy, sys\nprint("runs", *sys.argv[1:])\n'


def test_a_script_of_another_python_runs_with_that_of_the_environment(
        files, environment, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    program = files / 'probe/lib/probe/other_python'
    program.write_text(SCRIPT)
    program.chmod(0o755)
    Path('a.launch.xml').write_text(
        '<launch><node pkg="probe" exec="other_python" args="here" output="screen"/></launch>')
    launched = run_here(['ros2', 'launch', 'a.launch.xml'], monkeypatch)
    assert '[other_python-1] runs here' in launched.text
    started = subprocess.run(['ros2', 'run', 'probe', 'other_python', 'there'], text=True,
                             stdout=subprocess.PIPE)
    program.unlink()
    assert (started.returncode, started.stdout) == (0, 'runs there\n')


ENTITIES = """
from launch import Action, LaunchDescription, Substitution
from launch.actions import (ExecuteProcess, GroupAction, IncludeLaunchDescription, LogInfo,
                            RegisterEventHandler, TimerAction)
from launch.event_handlers import OnProcessExit, OnProcessIO
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import (LaunchConfiguration, PathJoinSubstitution, PathSubstitution,
                                  ThisLaunchFileDir)
from launch_ros.actions import LifecycleNode, Node, PushROSNamespace
from launch_ros.substitutions import FindPackageShare


class Shout(Substitution):
    def __init__(self, text):
        self.text = text

    def perform(self, context):
        return f'{self.text}!'


class Greet(Action):
    def execute(self, context):
        return [LogInfo(msg=Shout('hello'))]


def generate_launch_description():
    return LaunchDescription([%s])
"""


@pytest.mark.parametrize('entities, message', [
    ("LogInfo(msg=PathSubstitution('a') / ['b', LaunchConfiguration('side')] / 'c/')",
     'a/bleft/c'),
    ("LogInfo(msg=(PathJoinSubstitution(['a']) / 'b').describe())",
     "PathJoinSubstitution(''a', 'b'')"),
    ("LogInfo(msg=FindPackageShare('turtle_brick') / 'launch')", f'{SHARE}/launch'),
    ("LogInfo(msg=(ThisLaunchFileDir() / 'x').describe())",
     "PathJoinSubstitution('ThisLaunchFileDir(), 'x'')"),
    ("GroupAction([PushROSNamespace('g'), TimerAction(period=0.1, actions=[LogInfo("
     "msg=LaunchConfiguration('ros_namespace'))])])", '[launch.user]: /g'),
    ('Greet()', 'hello!'),
    ("LifecycleNode(package='turtle_brick', executable='arena', prefix='echo', output='screen', "
     "name='talker', namespace='/g')", ' --ros-args -r __node:=talker -r __ns:=/g\n'),
    ("*[ExecuteProcess(cmd=['true'])] * 2", "The process 'true-1' is executed more than once"),
    ("RegisterEventHandler(OnProcessIO(on_stdout=[])), ExecuteProcess(cmd=['echo'])",
     "'list' object is not callable"),
    ("IncludeLaunchDescription(PythonLaunchDescriptionSource('part.launch.xml'))",
     '): invalid syntax (part.launch.xml, line 1)'),
    ("RegisterEventHandler(OnProcessExit(target_action='a', on_exit=[]))",
     "target_action of OnProcessExit is 'a', but must be an action or a function"),
    ('TimerAction(period=1, actions=[])',
     'period of TimerAction is 1 of type int, but must be a float, text or a substitution'),
    ("ExecuteProcess(cmd=['true'], additional_env={'A': 1})",
     'A string or a substitution is expected, but 1 is of type int'),
    ("Node(executable='x', params=[])",
     "Node has no argument 'params' in the stand-in for launch")])
def test_entities_without_recordings(entities, message, environment, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path('all.launch.py').write_text(ENTITIES % entities)
    Path('part.launch.xml').write_text('<launch/>')
    done = run_here(['ros2', 'launch', 'all.launch.py', 'side:=left'], monkeypatch)
    assert message in done.text


def test_package_that_the_environment_lacks_is_explained(tmp_path):
    path = tmp_path / 'a.launch.py'
    path.write_text('from ament_index_python import get_package_share_directory\n'
                    'get_package_share_directory("urdf_tutorial")\n')
    with pytest.raises(InvalidLaunchFileError, match='urdf_tutorial is not available in this '
                       'environment.* your workspace is not at fault'):
        get_launch_description_from_any_launch_file(str(path))


@pytest.mark.parametrize('package, name', [
    ('launch', 'LaunchIntrospector'), ('launch.actions', 'OpaqueCoroutine'),
    ('launch.events.process', 'ShutdownProcess'), ('launch_ros.substitutions', 'Parameter'),
    ('launch_ros.actions', 'ComposableNodeContainer'),
    ('launch_testing.asserts', 'EventuallyEqual'),
    ('launch_testing_ros', 'WaitForTopics'), ('tf2_ros', 'TransformServer')])
def test_missing_name_is_explained(package, name):
    with pytest.raises(ImportError, match=f'^{name} is not in the stand-in for'):
        exec(f'from {package} import {name}', {})


@pytest.mark.parametrize('module, name', [
    ('launch.launch_description_sources', 'PythonLaunchDescriptionSource'),
    ('launch_ros.actions.node', 'Node'), ('launch_testing.actions.ready', 'ReadyToTest'),
    ('launch.actions.declare_launch_argument', 'DeclareLaunchArgument'),
    ('launch_xml.launch_description_sources', 'XMLLaunchDescriptionSource')])
def test_modules_of_the_real_packages_exist(module, name):
    exec(f'import {module}; {module}.{name}', {})
    exec(f'import {module.partition(".")[0]}; {module}.{name}', {})
    exec(f'from {module} import *; {name}', {})


def test_unknown_argument_is_explained():
    with pytest.raises(TypeError, match="LogInfo has no argument 'colour' in the stand-in"):
        launch.actions.LogInfo(msg='', colour='red')


def test_argument_of_test_description_is_an_error():
    def generate_test_description(speed=1.0):
        return launch.LaunchDescription()

    module = ModuleType('test_module')
    module.generate_test_description = generate_test_description
    with pytest.raises(Exception, match="has unexpected extra argument 'speed'"):
        TestRun(module).normalized_test_description()


def test_timeouts_and_emulate_tty_are_launch_arguments(environment, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path('stubborn.launch.xml').write_text(
        '<launch><executable cmd="bash -c \'trap : INT TERM; tty &lt;&amp;1; kill -INT $PPID; '
        'while true; do sleep 0.02; done\'" output="screen" sigkill_timeout="0.25"/></launch>')
    done = run_here(['ros2', 'launch', 'stubborn.launch.xml', 'sigterm_timeout:=0.25',
                     'emulate_tty:=true'], monkeypatch)
    assert "'0.25' seconds after receiving 'SIGINT', escalating to 'SIGTERM'" in done.text
    assert "'0.5' seconds after receiving 'SIGTERM', escalating to 'SIGKILL'" in done.text
    assert '[bash-1] /dev/pts/' in done.text


def run(record, files, top, before):
    environment = {
        **before, 'ROS_LOG_DIR': str(top / 'log'), 'HOME': str(top / 'home'),
        'COLUMNS': '100', 'PYTHON_COLORS': '0',  # Python 3.13 colors tracebacks.
        'PYTHONPATH': os.pathsep.join(
            [str(Path(__file__).parent), before.get('PYTHONPATH', '')]),
        'AMENT_PREFIX_PATH': f'{files}/probe:{before["AMENT_PREFIX_PATH"]}'}
    for name, value in (record.get('environment') or {}).items():
        environment.pop(name, None)
        if value is not None:
            environment[name] = value.replace('$WORK', str(top))
    words = record['command']
    words = with_paths(['bash', '-c', words] if isinstance(words, str) else words, files)
    if words[:2] == ['ros2', 'launch'] and 'escalating' not in record['stdout']:
        words.append('sigterm_timeout:=120')  # Processes need more time on a busy machine.
    command = Command(words, environment, directory=top, forked=words[0] in PROGRAMS)
    try:
        for (kind, condition), number, target in record.get('signals', ()):
            if kind == 'after':
                threading.Event().wait(condition)
            else:
                assert command.wait_for(lambda: command.has_printed(condition)), (
                    f'no {condition!r} in:\n{command.text}{command.error}')
            command.send(number, target)
    finally:
        remaining = command.end(4 * TIMEOUT)  # Up to eight commands run in parallel.
    return command, remaining


COMMANDS = [param for param in recorded('dynamic', 'logs', 'testing')
            if not param.id.startswith('pytest_')]
PYTEST = {'name': 'pytest', 'seconds': 60, 'returncode': 1, 'command': [
    sys.executable, '-m', 'pytest', '-p', 'no:cacheprovider', '-rA', *(
        param.values[0]['command'][-1] for param in recorded('testing')
        if param.id.startswith('pytest_'))]}
COMMANDS.append(pytest.param(PYTEST, id='pytest'))


@pytest.fixture(scope='module')
def runs(files, tmp_path_factory, request):
    wanted = [item.callspec.id for item in request.session.items
              if getattr(item, 'originalname', '').endswith('run_matches_recording')]
    commands = [param for param in COMMANDS
                if any(name.startswith(param.id) for name in wanted)]
    tops = {param.id: tmp_path_factory.mktemp('run') for param in commands}
    before = dict(os.environ)  # Tests in this process change os.environ.
    with ThreadPoolExecutor(8) as pool:
        slow_first = sorted(commands, key=lambda param: -param.values[0].get('seconds', 1))
        yield {param.id: pool.submit(run, param.values[0], files, tops[param.id], before)
               for param in slow_first}


def by_source(text):
    """Group lines by process or logger, because the output of several processes may interleave."""
    lines_by_source, source = {}, ''
    text = re.sub(r'(?<=[^\n])(\[(INFO|ERROR)\])', r'\n\1', text)
    for line in filter(None, text.replace('\r', '').split('\n')):  # print() writes twice
        match = re.match(r'(\[(?:INFO|ERROR|WARNING)\] \[.*?\]:|\[[\w]+-\d+\]) ?', line)
        source = match.group(1) if match else source
        if "sending signal 'SIGINT'" not in line:  # A process may already have ended.
            lines = lines_by_source.setdefault(re.sub('INFO|ERROR|WARNING', '', source), [])
            if 'ignored SIGINT' not in line or line not in lines:  # Two signals may merge.
                lines.append(line)
    return lines_by_source


def without_end_status(text):
    """Hide the exit status of `wait`, which differs if SIGINT arrives while Python is starting."""
    text = re.sub(r".*\[wait-1\]: (process.* failed to|sending signal 'SIGTERM').*\n", '', text)
    return re.sub(
        r'\[\w+\] (\[wait-\d\]: process has )(finished cleanly|died).*', r'\1ended', text)


@pytest.mark.parametrize('record', recorded('dynamic', 'logs'))
def test_run_matches_recording(record, runs, files):
    done, remaining = runs[record['name']].result()
    top = Path(done.directory)
    (log_dir,) = (path.parent for path in top.rglob('launch.log'))
    output = normal(done.text, files, log_dir).replace(str(top), '$WORK')
    expected = record['stdout']
    if '$RUN' in expected:
        expected = re.sub(r'\$WORK/\S*\$RUN', '$LOGDIR', expected)
    for name, text in record.get('files_written', {}).items():
        found = normal((log_dir / Path(name).name).read_text(), files)
        found = re.sub(r'(?m)^\d+\.\d+ ', '$STAMP ', found.replace(str(top), '$WORK'))
        found, text = (each.replace('\n', '').split('$STAMP') for each in (
            found.replace(log_dir.name, '$RUN'), text.replace('$HOME', '$WORK/home')))
        assert sorted(found) == sorted(text)
    if record['name'].startswith('sigterm'):  # SIGTERM ends the real `launch`, not its processes.
        assert not remaining
        for number in '12':
            assert f"sending signal 'SIGTERM' to process[wait-{number}]" in output
            assert f'[wait-{number}] got SIGTERM' in output
            assert f'[INFO] [wait-{number}]: process has finished cleanly' in output
    elif record['name'] == 'stdout_closed_early':
        assert output.split('\n')[-2] == expected.split('\n')[-2] == '120 0'
        assert done.error == ''
    else:
        assert by_source(output) == by_source(expected)
        assert not (done.error or remaining)
    assert done.status == record['returncode']


@pytest.mark.parametrize('record', recorded('testing'))
def test_test_run_matches_recording(record, runs, files):
    if record['name'].startswith('pytest_'):
        done, _ = runs['pytest'].result()  # One run executes all files.
        output = normal(done.text, files).replace('NO TESTS RAN', 'OK')
        outcome = {0: 'PASSED', 1: 'FAILED', 5: r'SKIPPED \[1\]'}[record['returncode']]
        assert re.search(rf'\n{outcome} \S*{Path(record["command"][-1]).name}', output)
        for part in re.findall(r'(?s)\n(FAIL: .*?)(?=\n===|\n--- Cap)', record['stdout']):
            assert part.strip() in output
            assert f'{part.split()[1]} failed\n' in output
        return
    done, _ = runs[record['name']].result()
    assert done.status == record['returncode']
    output, error, expected, complaint = (
        without_end_status(re.sub(r'(?m)^(\[.*log files.*below ).*', r'\1$LOGDIR',
                                  normal(text, files)))
        for text in (done.text, done.error, record['stdout'], record['stderr']))
    output, expected = (sorted(sum(by_source(without_reasons(text)).values(), []))
                        for text in (output, expected))
    if 'exit code -2' in record['stdout']:  # If interrupted at startup, Python prints a traceback.
        output = [line for line in output if not line.startswith('[wait-1] ')]
    assert output == expected
    # Since Python 3.12, unittest prints NO TESTS RAN instead of OK if there are no tests.
    assert error.replace('NO TESTS RAN', 'OK').split('\n')[-8:] == complaint.split('\n')[-8:]
