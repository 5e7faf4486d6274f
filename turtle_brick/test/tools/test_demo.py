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
"""The demo refuses what can't be before anything has started, and keeps to itself."""

import os
import sys
from types import SimpleNamespace

from geometry_msgs.msg import Twist
from live_graph import graph, process
import pytest
from rclpy.node import Node
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from turtle_brick.core.parameters import load
from turtle_brick.core.reachability import resting_height
from turtle_brick.ros.tf import BASE_LINK, ODOM, transform_message
from turtle_brick.tools import demo
from turtle_brick.tools.graph import executable, Graph
from turtle_referee.domains import RANGE_VARIABLES
from turtlesim.msg import Pose

DEMO = [sys.executable, '-m', 'turtle_brick.tools.demo', '--no-view']
WAIT = 60.0


# ----------------------------------------------------------------------------- what is refused

@pytest.fixture
def no_graph(monkeypatch):
    """Have nothing started."""
    monkeypatch.setattr(demo, 'Graph', None)
    monkeypatch.setattr(demo.INTERRUPTS, 'take_over', lambda: None)


@pytest.mark.parametrize('number', ['0', '-1'])
def test_a_number_of_drops_that_cannot_be_is_refused(no_graph, number, capsys):
    with pytest.raises(SystemExit, match='2'):
        demo.main(['--drops', number])
    assert f'--drops {number}: at least 1' in capsys.readouterr().err


@pytest.mark.parametrize('place, words', [
    ('nan 1 1', 'is [nan, 1.0, 1.0], but must be 3 numbers'),
    ('1 inf 1', 'is [1.0, inf, 1.0], but must be 3 numbers'),
    ('1e308 1 1', 'is [1e+308, 1.0, 1.0], but must be 3 numbers'),
    ('1 1 -1', '[1.0, 1.0, -1.0] m is below the ground'),
    ('1 1 0.05', '[1.0, 1.0, 0.05] m is below the ground'),
])
def test_a_place_that_cannot_be_is_refused(no_graph, place, words, capsys):
    assert demo.main(['--place', '5', '5', '5', '--place', *place.split()]) == 1
    sentence, = capsys.readouterr().err.splitlines()
    assert sentence.startswith(f'demo: --place {words}')


@pytest.mark.parametrize('domain', ['abc', '-1', '233', '1.5', '9' * 309])
def test_a_domain_that_cannot_be_is_refused(no_graph, domain, monkeypatch, capsys):
    monkeypatch.setenv('ROS_DOMAIN_ID', domain)
    assert demo.main([]) == 1
    sentence, = capsys.readouterr().err.splitlines()
    assert sentence.startswith(f"demo: ROS_DOMAIN_ID is '{domain[:30]}")
    assert len(sentence) < 120


def test_a_program_that_is_not_installed_is_named(monkeypatch, capsys):
    def start(*_, **__):
        executable('no_such_package', 'no_such_program')

    monkeypatch.setattr(demo, 'Graph', start)
    monkeypatch.setattr(demo.INTERRUPTS, 'take_over', lambda: None)
    assert demo.main(['--no-view']) == 1
    assert capsys.readouterr().err == (
        'demo: the package no_such_package is not installed here\n')


# ------------------------------------------------------------------------------- what is told

@pytest.mark.parametrize('height, refusals, told', [
    (-0.01, [5_000_000], 'Unreachable, said 0.005 s after the release: it starts below where it '
     'would lie on the platform'),
    (0.01, [], 'reachable, decided 0.005 s after the release: it falls for 0.045 s, '
     'the robot needs 0.000 s'),  # sqrt(2 * 0.01 / 9.81)
])
def test_the_reason_of_a_verdict_is_told(height, refusals, told):
    """The brick is let go above the robot, so far (m) above where it would lie."""
    parameters, said = load(), []
    watch = SimpleNamespace(
        place=(7.0, 7.0, resting_height(parameters) + height), distance=0.0, released=0,
        decided=5_000_000, refusals=refusals, landed=None, carried_to=None, floated=None)
    demo.Teller(SimpleNamespace(parameters=parameters, say=said.append)).tell(watch)
    assert said == ['it is let go', told]


# ---------------------------------------------------------------------------------- its domain

@pytest.fixture
def nothing_said(monkeypatch):
    """Take back what the user, and the tests, say about domains."""
    for name in (*RANGE_VARIABLES, 'ROS_DOMAIN_ID'):
        monkeypatch.setenv(name, '')  # also what is set in the test is taken back after it


def test_it_takes_a_free_domain_of_this_machine_and_says_which(nothing_said, capsys):
    with demo.chosen_domain() as shared:
        first = os.environ['ROS_DOMAIN_ID']
        assert os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'
        assert not shared
        assert f'export ROS_DOMAIN_ID={first}\n' in capsys.readouterr().out
        os.environ['ROS_DOMAIN_ID'] = ''
        with demo.chosen_domain():
            assert os.environ['ROS_DOMAIN_ID'] != first


def test_the_users_domain_is_taken_with_whoever_is_in_it(domain_id):
    with demo.chosen_domain() as shared:
        assert not shared
        assert os.environ['ROS_DOMAIN_ID'] == str(domain_id)
    with graph(domain_id), demo.chosen_domain() as shared:
        assert shared


@pytest.mark.parametrize('variable', RANGE_VARIABLES)
def test_who_is_out_of_this_machine_is_not_known(nothing_said, variable, monkeypatch):
    monkeypatch.setenv(variable, 'SUBNET')
    with demo.chosen_domain() as shared:
        assert shared
        assert os.environ[variable] == 'SUBNET'


def broadcaster(node):
    """Have a node say where a robot is, again and again."""
    publisher = node.create_publisher(TFMessage, '/tf', 10)
    message = TFMessage(transforms=[transform_message(ODOM, BASE_LINK)])
    node.create_timer(0.02, lambda: publisher.publish(message))


@pytest.mark.parametrize('act, words', [
    (lambda node: node.create_publisher(Pose, 'turtle1/pose', 10), 'publishes turtle1/pose'),
    (lambda node: node.create_publisher(Twist, 'cmd_vel', 10), 'publishes cmd_vel'),
    (lambda node: node.create_service(Trigger, 'drop', print), 'serves drop'),
    (broadcaster, 'broadcasts base_link')])
def test_another_robot_is_found(domain_id, act, words):
    def rival(context):
        node = Node('rival', context=context)
        act(node)
        return node

    with graph(domain_id, rival), Graph(domain_id) as own:
        with pytest.raises(demo.CompanyError, match=f'domain {domain_id} .*{words}'):
            demo.look_out(own)


def test_who_is_no_robot_is_no_company(domain_id, monkeypatch):
    monkeypatch.setattr(demo, 'DISCOVERY_TIME', 0.5)

    def watcher(context):
        node = Node('watcher', context=context)
        node.create_subscription(Pose, 'turtle1/pose', print, 10)
        node.create_client(Trigger, 'drop')
        return node

    with graph(domain_id, watcher) as live, Graph(domain_id) as own:
        demo.look_out(own)
        assert own.nodes == []
        live.wait_for(lambda: live.listener.get_node_names().count('lookout') == 0, WAIT,
                      'the lookout to leave')


# --------------------------------------------------------------------------------- in processes

def test_a_second_one_in_its_domain_ends_with_a_sentence(domain_id, monkeypatch, tmp_path):
    """And the first one goes on, although its home can't be written to."""
    monkeypatch.delenv('ROS_LOG_DIR')
    monkeypatch.setenv('HOME', os.devnull)
    monkeypatch.setenv('TMPDIR', str(tmp_path))
    with process(DEMO, domain_id, timeout=WAIT) as first:
        first.wait_for_output('turtlesim is up', WAIT)
        with process(DEMO, domain_id, stop=None) as second:
            assert second.wait(WAIT) == 1
        assert second.output.startswith('demo: another robot is in ROS domain')
        assert len(second.output.splitlines()) == 1
        first.wait_for_output('driven to', WAIT)
    assert 'Traceback' not in first.output
