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
"""The viewer in a live graph: what it hears, what commands do, how it starts and ends."""

from html import unescape
from math import inf, nan
from pathlib import Path
import re
import signal
import socket
from statistics import median
import urllib.request

from faulty_markers import changed, FAULTS, harmless
from geometry_msgs.msg import PoseStamped, TransformStamped
from live_graph import process
import pytest
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from turtle_brick.physics import Phase
from turtle_brick.tools.graph import executable, Graph
from turtle_brick.view import viewer
from turtle_brick.view.commands import Drop, DropAtRandom, PlaceAt, SendTo, SetTilt
from turtle_brick_interfaces.msg import Tilt
from visualization_msgs.msg import Marker, MarkerArray
from witness import Witness

needs_viser = pytest.mark.skipif(
    viewer.find_spec('viser') is None,
    reason='viser, which draws the page, is not installed here')

TIMEOUT = 20.0


def command():
    """Return the beginning of a command that runs the viewer."""
    return [executable('turtle_brick', 'viewer'), '--ros-args']


@pytest.fixture
def live(domain_id):
    """Return a graph with a viewer."""
    with Graph(domain_id, quiet=True) as graph:
        graph.viewer = graph.add(viewer.Viewer, '-p', 'port:=0', parameters=False)
        yield graph


def answer_of(graph, command):
    """Give a command as the page does, and return the answer that is shown."""
    panel = graph.viewer.view.panel
    panel.show_answer('', True)
    blank = panel._answer.content
    graph.viewer._commands.append(command)
    graph.spin_until(lambda: panel._answer.content != blank, TIMEOUT, f'an answer to {command}')
    return unescape(re.sub('<[^>]*>', '', panel._answer.content))


def test_without_viser_it_says_how_to_get_it(monkeypatch, capsys):
    monkeypatch.setattr(viewer, 'find_spec', lambda name: None)
    assert viewer.main([]) == 1
    said = capsys.readouterr().err
    assert said.count('\n') == 1
    assert f'pip install {viewer.VISER}' in said


def test_the_version_that_it_asks_for_is_the_one_that_the_home_has():
    requirements = Path(__file__).parents[2] / 'scripts' / 'requirements.txt'
    pins = [line.split()[0] for line in requirements.read_text().splitlines()
            if line.startswith('viser')]
    assert pins == [viewer.VISER]


@needs_viser
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_it_serves_and_ends_quietly(domain_id, number):
    with process([*command(), '-p', 'port:=0'], domain_id, stop=number) as running:
        url = running.wait_for_output(r'Viewer: (http://127\.0\.0\.1:\d+)\n', TIMEOUT).group(1)
        with urllib.request.urlopen(url, timeout=10.0) as page:
            assert page.status == 200
    assert running.output == f'Viewer: {url}\n'


@needs_viser
def test_it_takes_the_next_port_and_says_so(domain_id):
    with socket.create_server(('127.0.0.1', 0)) as taken:
        port = taken.getsockname()[1]
        with process([*command(), '-p', f'port:={port}'], domain_id) as running:
            found = running.wait_for_output(r'Viewer: http://127\.0\.0\.1:(\d+)', TIMEOUT)
            assert int(found.group(1)) > port
            assert f'Port {port} is taken' in running.output


@needs_viser
@pytest.mark.parametrize(('setting', 'said'), [
    ('port:=70000', 'port is 70000'), ('port:=home', "port is 'home', but must be a whole number"),
    ('host:=192.0.2.1', "host is '192.0.2.1'")])
def test_a_parameter_that_cannot_be_is_refused_in_a_sentence(domain_id, setting, said):
    with process([*command(), '-p', setting], domain_id, stop=None) as running:
        assert running.wait(TIMEOUT) == 1
        assert running.output.startswith('viewer: ') and running.output.count('\n') == 1
        assert said in running.output


@needs_viser
def test_without_an_arena_it_says_so(live):
    assert answer_of(live, Drop()) == 'drop: nobody offers /drop'
    assert answer_of(live, PlaceAt(1.0, 2.0, 3.0)) == 'place: nobody offers /place'
    assert 'no walls are in sight' in answer_of(live, DropAtRandom())


@needs_viser
def test_what_the_services_answer_is_shown_on_the_page_only(live, capfd):
    arena = live.add_arena()
    node = live.viewer
    live.spin_until(
        lambda: node._place_client.service_is_ready() and node._drop_client.service_is_ready()
        and node.display.walls() is not None, TIMEOUT, 'the viewer sees the arena')
    before = arena.world.brick
    assert 'ground' in answer_of(live, PlaceAt(5.0, 5.0, -1.0))
    assert '#c92a2a' in node.view.panel._answer.content
    assert arena.world.brick == before
    assert answer_of(live, PlaceAt(5.0, 5.0, 9.0)) == 'place: the brick hovers at (5, 5, 9)'
    assert arena.world.brick == (5.0, 5.0, 9.0)
    assert answer_of(live, Drop()) == 'drop: the brick falls from (5, 5, 9)'
    assert arena.world.phase is Phase.FALLING
    assert 'falling' in answer_of(live, Drop())
    live.spin_until(lambda: arena.world.phase is Phase.GROUNDED, TIMEOUT, 'it is down')
    assert answer_of(live, Drop()) == 'drop: the brick is on the ground: place it first'
    answer_of(live, DropAtRandom())
    x, y, z = arena.world.brick
    assert 0.0 < x < 11.1 and 0.0 < y < 11.1 and 0.0 < z < 10.0
    live.spin_until(lambda: arena.world.phase is Phase.FALLING, TIMEOUT, 'it falls, too')
    said = [line for line in capfd.readouterr().err.splitlines() if 'Viewer: ' not in line]
    assert said == []


@needs_viser
def test_a_click_sends_the_robot_and_the_slider_tilts_it(live):
    witness = live.add(Witness, parameters=False)
    goals = witness.record(PoseStamped, 'goal_pose')
    tilts = witness.record(Tilt, 'tilt')
    live.spin_until(lambda: witness.count_publishers('tilt') and witness.count_publishers(
        'goal_pose') and live.viewer.count_subscribers('tilt') == 2, TIMEOUT, 'they meet')
    live.viewer._commands.append(SendTo(3.0, 4.0))
    live.viewer._commands.append(SetTilt(0.25))
    live.spin_until(lambda: goals and tilts, TIMEOUT, 'goal and tilt')
    (_, goal), (_, tilt) = goals[0], tilts[0]
    assert goal.header.frame_id == 'world'
    assert (goal.pose.position.x, goal.pose.position.y) == (3.0, 4.0)
    assert tilt.angle == 0.25


@needs_viser
def test_a_service_that_never_answers_is_reported(live, monkeypatch):
    monkeypatch.setattr(viewer, 'ANSWER_TIME', 200_000_000)
    silent = live.add(Witness, parameters=False)
    silent.create_service(Trigger, 'drop', lambda request, response: None)
    live.spin_until(live.viewer._drop_client.service_is_ready, TIMEOUT, 'the silent service')
    live.executor.remove_node(silent)
    assert answer_of(live, Drop()) == 'drop: no answer'
    live.executor.add_node(silent)


@needs_viser
def test_an_answer_may_be_long_and_only_the_latest_commands_are_done(live):
    witness = live.add(Witness, parameters=False)
    tilts = witness.record(Tilt, 'tilt')

    def answer(request, response):
        response.message = 'x' * 10**6
        return response

    witness.create_service(Trigger, 'drop', answer)
    live.spin_until(
        lambda: live.viewer._drop_client.service_is_ready() and witness.count_publishers('tilt')
        and live.viewer.count_subscribers('tilt') == 2, TIMEOUT, 'they meet')
    assert answer_of(live, Drop()) == 'drop: ' + 'x' * (viewer.LONGEST_ANSWER - len('drop: '))
    for number in range(10_000):
        live.viewer._commands.append(SetTilt(number / 10_000.0))
    live.spin_until(lambda: tilts and tilts[-1][1].angle == 0.9999, TIMEOUT, 'the last tilt')
    assert len(tilts) == viewer.MOST_COMMANDS


def nonsense():
    """Return bad messages by topic, with their type."""
    transforms = []
    for parent, child, values in (
            ('world', 'brick', {'header.stamp.sec': -1}),
            ('world', 'brick', {'transform.translation.x': nan}),
            ('nowhere', 'brick', {'transform.translation.x': 1e308}),
            ('world', 'brick', {'transform.rotation.w': 0.0}),
            ('world', 'brick', {'header.stamp.nanosec': 2**32 - 1}),
            ('brick', 'brick', {}), ('', '', {}), ('brick', 'world', {})):
        transform = TransformStamped(child_frame_id=child)
        transforms.append(changed(transform, {
            'header.frame_id': parent, 'transform.rotation.w': 1.0, **values}))
    goals = [changed(PoseStamped(), {'header.frame_id': frame, 'pose.position.x': x})
             for frame, x in (('nowhere', 1.0), ('world', nan), ('', inf), ('brick', 1e308))]
    markers = [changed(harmless(), changes) for changes, _ in FAULTS]
    return {
        'robot_description': (String, [String(data=text) for text in (
            '', 'x' * 2_000_000, '<robot/>', '<a>' * 100_000, '<robot><link name="a"><visual>'
            '<geometry><box size="1 nan 1"/></geometry></visual></link></robot>')]),
        '/tf': (TFMessage, [TFMessage(transforms=[one]) for one in transforms]),
        '/tf_static': (TFMessage, [TFMessage(transforms=transforms)]),
        'walls': (MarkerArray, [MarkerArray(markers=[harmless()] * 1000),
                                MarkerArray(markers=markers)]),
        'brick_marker': (Marker, markers), 'catcher_marker': (Marker, markers), 'goal_pose':
        (PoseStamped, goals), 'tilt': (Tilt, [Tilt(angle=angle) for angle in (nan, inf, 1e308)])}


@needs_viser
def test_no_message_ends_it_holds_it_up_or_floods_its_log(live, capfd):
    node, times = live.viewer, []
    draw = node.display.draw
    node.display.draw = lambda now: (times.append(now), draw(now))
    witness = live.add(Witness, parameters=False)
    said = nonsense()
    publishers = {topic: witness.create_publisher(kind, topic, viewer.LATCHED)
                  for topic, (kind, _) in said.items()}
    live.spin_until(lambda: all(publisher.get_subscription_count() for publisher
                                in publishers.values()), TIMEOUT, 'the viewer hears it all')
    for number in range(2):
        for topic, (_, messages) in said.items():
            for message in messages:
                publishers[topic].publish(message)
        marker = changed(harmless(), {'id': number + 100})
        publishers['catcher_marker'].publish(marker)
        live.spin_until(lambda: f'markers/catcher_marker//{number + 100}'  # noqa: B023
                        in node.view.scene.names(), TIMEOUT, 'what can be drawn is drawn')
    times.clear()
    live.spin_until(lambda: len(times) > 30, TIMEOUT, 'it goes on drawing')
    warnings = [line for line in capfd.readouterr().err.splitlines()
                if not line.startswith('Viewer: ')]
    assert len(warnings) <= len(said), warnings
    for topic in ('robot_description', 'walls', 'brick_marker', 'catcher_marker', 'goal_pose',
                  'tilt'):
        words = topic.replace('_pose', '').replace('robot_', '')
        assert sum(words in warning for warning in warnings) == 1, (topic, warnings)
    assert sum('Left out: the transform' in warning for warning in warnings) == 2, warnings


@needs_viser
def test_it_draws_30_pictures_per_second_of_a_busy_graph(live):
    live.add_turtlesim()
    live.add_robot_state_publisher()
    live.add_robot()
    live.add_arena()
    times = []
    draw = live.viewer.display.draw
    live.viewer.display.draw = lambda now: (times.append(now), draw(now))
    live.spin_until(
        lambda: times and all(rate for _, rate in live.viewer.display.rates(times[-1])),
        TIMEOUT, 'all that is counted')
    times.clear()
    live.spin_until(lambda: len(times) > 90, TIMEOUT, '90 pictures')
    # Pictures that a busy machine leaves out are not made up for.
    intervals = [later - earlier for earlier, later in zip(times, times[1:])]
    assert median(intervals) == pytest.approx(1e9 / 30.0, rel=0.05)
    assert (len(times) - 1) * 1e9 / (times[-1] - times[0]) < 31.5
    rates = dict(live.viewer.display.rates(times[-1]))
    assert rates.pop('brick (TF)') == pytest.approx(250.0, rel=0.08)
    assert set(rates) == {'turtle1/cmd_vel', 'odom', 'joint_states'}
    assert all(rate == pytest.approx(100.0, rel=0.08) for rate in rates.values())
    things = set(live.viewer.view.scene.names())
    assert {'robot/base_link', 'robot/platform', 'robot/wheel'} <= things
    assert sum(name.startswith('markers/walls/') for name in things) == 4
    assert sum(name.startswith('markers/brick_marker/') for name in things) == 1
