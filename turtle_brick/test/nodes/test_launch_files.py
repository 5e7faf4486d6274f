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

"""Test the launch files, mostly with programs that only report their arguments and parameters."""

import os
import re
import subprocess
import sys

from launch import LaunchContext
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import AnyLaunchDescriptionSource
from launch.utilities import perform_substitutions
import pytest
from turtle_brick.core.parameters import default_path
import yaml

SHARE = default_path().parents[1]
NAMES = ('show_turtle', 'run_turtle', 'turtle_arena')

PROGRAMS = {
    'joint_state_publisher': ['joint_state_publisher'],
    'joint_state_publisher_gui': ['joint_state_publisher_gui'],
    'robot_state_publisher': ['robot_state_publisher'],
    'rviz2': ['rviz2'],
    'turtle_brick': ['arena', 'catcher', 'turtle_robot'],
    'turtlesim': ['turtlesim_node'],
}
"""Executables that the launch files start, grouped by package."""

REPORT_COMMAND = r"""#!/bin/sh
exec >"$REPORTS/$LAUNCH_NUMBER-${0##*/}"
echo "$QT_QPA_PLATFORM"
printf '%s\n' "$@"
while [ $# -gt 0 ]; do
  [ "$1" != --params-file ] || { echo ---; cat "$2"; }
  shift
done
"""
"""Program that writes its Qt platform, arguments and parameters to a file. A Python program would
need more processor time."""

TOPICS = {
    'robot_description': ('RobotModel', 'Transient Local'),
    'walls': ('MarkerArray', 'Transient Local'),
    'brick_marker': ('Marker', 'Transient Local'),
    'catcher_marker': ('Marker', 'Volatile'),
}
"""Display type and durability of each topic in turtle_arena.rviz."""

LAUNCH = """
import os
import shlex
import signal
import sys

from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import AnyLaunchDescriptionSource
signal.signal(signal.SIGINT, lambda *_: None)
for number, command in enumerate(sys.argv[1:]):
    os.environ['LAUNCH_NUMBER'] = str(number)
    path, *arguments = shlex.split(command)
    service = LaunchService(noninteractive=True)
    service.include_launch_description(LaunchDescription([IncludeLaunchDescription(
        AnyLaunchDescriptionSource(path),
        launch_arguments=[argument.split(':=') for argument in arguments])]))
    if status := service.run():
        sys.exit(status)
"""
"""Program that runs launch files and replaces Python's SIGINT handler. With Python's handler,
6 of 120 runs with the real launch packages did not exit."""

CASES = {
    'show_turtle': {'robot_state_publisher', 'joint_state_publisher_gui', 'rviz2'},
    'show_turtle use_jsp:=jsp view:=none': {'robot_state_publisher', 'joint_state_publisher'},
    'run_turtle rviz_config:=config/own.rviz': {
        'robot_state_publisher', 'rviz2', 'turtlesim_node', 'turtle_robot'},
    'turtle_arena rviz_config:=own.rviz': {
        'robot_state_publisher', 'rviz2', 'turtlesim_node', 'turtle_robot', 'arena', 'catcher'}}
"""Programs started by each combination of launch file and launch arguments."""


def run_with_fake_programs(commands, top):
    """Run launch files with programs that only write reports to the folder `top`."""
    index = top / 'share' / 'ament_index' / 'resource_index' / 'packages'
    index.mkdir(parents=True)
    (top / 'share' / 'turtle_brick').symlink_to(SHARE)
    for package, names in PROGRAMS.items():
        (index / package).touch()
        (top / 'lib' / package).mkdir(parents=True)
        for name in names:
            program = top / 'lib' / package / name
            program.write_text(REPORT_COMMAND)
            program.chmod(0o755)
    variables = {name: value for name, value in os.environ.items() if name != 'QT_QPA_PLATFORM'}
    variables['AMENT_PREFIX_PATH'] = f'{top}:{os.environ["AMENT_PREFIX_PATH"]}'
    done = subprocess.run(
        [sys.executable, '-c', LAUNCH, *commands], text=True, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, env={**variables, 'REPORTS': str(top)})
    assert done.returncode == 0, done.stdout


def programs_of(reports, number):
    """Return the arguments, the parameters and the Qt platform of each started program."""
    found = {}
    for report in reports.glob(f'{number}-*'):
        head, *documents = report.read_text().split('\n---\n')
        platform, *words = head.splitlines()
        while '--params-file' in words:
            index = words.index('--params-file')
            del words[index:index + 2]
        parameters = {}
        for node, section in (item for text in documents for item in yaml.safe_load(text).items()):
            parameters.setdefault(node, {}).update(section['ros__parameters'])
        found[report.name.partition('-')[2]] = ' '.join(words), parameters, platform
    return found


@pytest.fixture(scope='module')
def reports(tmp_path_factory):
    """Return the reports of the Python and XML version of each case."""
    top = tmp_path_factory.mktemp('prefix')
    run_with_fake_programs([re.sub(r'^\w+', rf'{SHARE}/launch/\g<0>.launch.{language}', case)
                            for case in CASES for language in ('py', 'xml')], top)
    return top


@pytest.mark.parametrize('case', CASES)
def test_python_and_xml_start_the_same_programs(reports, case):
    number = 2 * list(CASES).index(case)
    programs = programs_of(reports, number)
    assert programs == programs_of(reports, number + 1)
    assert set(programs) == CASES[case]
    for program, (_, parameters, _) in programs.items():
        is_own_node = program in ('arena', 'catcher', 'turtle_robot')
        assert ('wheel_radius' in str(parameters)) is is_own_node
    description = programs['robot_state_publisher'][1]['/**']
    assert description['ignore_timestamp'] is True
    assert '<robot name="turtle"' in description['robot_description']
    if 'rviz2' in programs:
        _, _, config = case.rpartition('rviz_config:=')
        config = config if config != case else f'config/{case}.rviz'
        words = programs['rviz2'][0].split()
        assert words[:2] == ['-d', str(reports / 'share/turtle_brick' / config)]
    if 'turtle_robot' in programs:
        assert 'cmd_vel:=turtle1/cmd_vel' in programs['turtle_robot'][0]
        _, parameters, platform = programs['turtlesim_node']
        assert parameters['/**'] == {'holonomic': True}
        assert platform == 'xcb;wayland;offscreen'


@pytest.mark.parametrize('language', ['py', 'xml'])
@pytest.mark.parametrize('name', NAMES)
def test_arguments_have_defaults_and_descriptions(name, language):
    """These are also the arguments that `ros2 launch -s` prints."""
    context = LaunchContext()
    file = IncludeLaunchDescription(
        AnyLaunchDescriptionSource(str(SHARE / 'launch' / f'{name}.launch.{language}')))
    file.execute(context)
    description = file.launch_description_source.get_launch_description(context)
    arguments = {argument.name: argument for argument in description.get_launch_arguments()}
    assert set(arguments) == {'use_jsp', 'rviz_config', 'view'}
    use_jsp = arguments['use_jsp']
    assert perform_substitutions(context, use_jsp.default_value) == 'gui'
    assert use_jsp.choices == ['gui', 'jsp', 'none']
    assert 'joint_state' in use_jsp.description
    rviz_config = arguments['rviz_config']
    assert perform_substitutions(context, rviz_config.default_value) == f'config/{name}.rviz'
    assert 'share directory' in rviz_config.description
    assert perform_substitutions(context, arguments['view'].default_value) == 'rviz'
    assert arguments['view'].choices == ['rviz', 'none']
    assert 'rviz2' in arguments['view'].description


@pytest.mark.parametrize('name', NAMES)
def test_rviz_configuration_matches_the_published_topics(name):
    manager = yaml.safe_load(
        (SHARE / 'config' / f'{name}.rviz').read_text(encoding='utf-8'))['Visualization Manager']
    # In show_turtle, no node broadcasts the world frame.
    frame = 'base_link' if name == 'show_turtle' else 'world'
    assert manager['Global Options']['Fixed Frame'] == frame
    topics = {}
    for display in manager['Displays']:
        for key in ('Topic', 'Description Topic'):
            if key in display:
                kind = display['Class'].removeprefix('rviz_default_plugins/')
                topics[display[key]['Value']] = (kind, display[key]['Durability Policy'])
                assert display[key]['Reliability Policy'] == 'Reliable'
                assert display['Enabled'] is True
    assert topics == (TOPICS if name == 'turtle_arena' else {
        'robot_description': TOPICS['robot_description']})
    goals = [tool['Topic']['Value'] for tool in manager['Tools'] if 'SetGoal' in tool['Class']]
    assert goals == ([] if name == 'show_turtle' else ['goal_pose'])
