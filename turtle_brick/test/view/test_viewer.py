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
"""The viewer in a live graph: what it hears, what its buttons do, how it starts and ends."""

from functools import partial
from html import unescape
from pathlib import Path
import re
import signal
import socket
import urllib.request

from geometry_msgs.msg import PoseStamped
from live_graph import graph, PATIENCE, process
import pytest
from std_srvs.srv import Trigger
from turtle_brick.physics import Phase
from turtle_brick.tools.graph import executable
from turtle_brick.view import viewer
from turtle_brick_interfaces.msg import Tilt

needs_viser = pytest.mark.skipif(
    viewer.find_spec('viser') is None,
    reason='viser, which draws the page, is not installed here')


@pytest.fixture
def live(domain_id):
    """Return a graph with a viewer."""
    with graph(domain_id, quiet=True) as live:
        live.viewer = live.add(viewer.Viewer, '-p', 'port:=0', parameters=False)
        yield live


def answer_to(live, order, *values):
    """Give an order as the page does, and return the answer that is shown."""
    panel = live.viewer.page._panel
    live.viewer.page.hear_answer('', True)
    blank = panel.show_answer('', True) or panel._answer.content
    live.viewer._soon(order)(*values)
    live.wait_for(lambda: panel._answer.content != blank, PATIENCE, f'an answer to {order}')
    return unescape(re.sub('<[^>]*>', '', panel._answer.content))


def await_services(live, *names):
    """Wait until the viewer sees services."""
    clients = {client.srv_name.rpartition('/')[2]: client for client in live.viewer.clients}
    live.wait_for(lambda: all(clients[name].service_is_ready() for name in names), PATIENCE,
                  f'the viewer sees {names}')


def test_without_viser_it_says_how_to_get_it(monkeypatch, capsys):
    monkeypatch.setattr(viewer, 'find_spec', lambda name: None)
    assert viewer.main([]) == 1
    said = capsys.readouterr().err
    assert said.count('\n') == 1 and f'pip install {viewer.VISER}' in said


def test_the_version_that_it_asks_for_is_the_one_that_the_home_has():
    requirements = Path(__file__).parents[2] / 'scripts' / 'requirements.txt'
    assert [line.split()[0] for line in requirements.read_text().splitlines()
            if line.startswith('viser')] == [viewer.VISER]


@needs_viser
def test_it_serves_on_the_next_free_port_and_ends_quietly(domain_id):
    with socket.create_server(('127.0.0.1', 0)) as taken:
        port = taken.getsockname()[1]
        command = [executable('turtle_brick', 'viewer'), '--ros-args', '-p', f'port:={port}']
        with process(command, domain_id, stop=signal.SIGTERM) as running:
            url, found = running.wait_for_output(
                r'Viewer: (http://127\.0\.0\.1:(\d+))\n', PATIENCE).groups()
            with urllib.request.urlopen(url, timeout=PATIENCE) as page:
                assert page.status == 200 and b'<html' in page.read()
    assert int(found) > port
    warning, said = running.output.splitlines()
    assert f'Port {port} is taken: the page is on {found}' in warning
    assert said == f'Viewer: {url}'


@needs_viser
def test_what_the_services_answer_is_shown_on_the_page_only(live, capfd):
    place, drop = partial(answer_to, live, live.viewer.place), partial(
        answer_to, live, live.viewer.drop)
    assert drop() == 'drop: nobody offers /drop'
    world = live.add_arena().world
    await_services(live, 'place', 'drop')
    assert 'ground' in place(5.0, 5.0, -1.0)
    assert '#c92a2a' in live.viewer.page._panel._answer.content, 'in red'
    assert place(5.0, 5.0, 3.0) == 'place: the brick hovers at (5, 5, 3)'
    assert world.brick == (5.0, 5.0, 3.0)
    assert drop() == 'drop: the brick falls from (5, 5, 3)'
    live.wait_for(lambda: world.phase is Phase.GROUNDED, PATIENCE, 'it is down')
    assert drop() == 'drop: the brick is on the ground: place it first'
    answer_to(live, live.viewer.drop_at_random)
    x, y, z = world.brick
    assert 0.4 < x < 10.7 and 0.4 < y < 10.7 and 0.0 < z < 9.0
    live.wait_for(lambda: world.phase is not Phase.HOVERING, PATIENCE, 'it falls, too')
    assert [line for line in capfd.readouterr().err.splitlines() if 'Viewer: ' not in line] == []


@needs_viser
def test_a_click_sends_the_robot_and_the_slider_tilts_it(live):
    goals, tilts = live.record('goal_pose', PoseStamped), live.record('tilt', Tilt)
    live.wait_for(lambda: all(live.viewer.count_subscribers(topic) == 2
                              for topic in ('goal_pose', 'tilt')), PATIENCE, 'they meet')
    live.viewer._soon(live.viewer.go)(3.0, 4.0)
    live.viewer._soon(live.viewer.tilt)(0.25)
    live.wait_for(lambda: goals.messages and tilts.messages, PATIENCE, 'goal and tilt')
    assert goals.last.header.frame_id == 'world'
    assert (goals.last.pose.position.x, goals.last.pose.position.y) == (3.0, 4.0)
    assert goals.last.pose.orientation.w == 1.0
    assert tilts.last.angle == 0.25
    live.wait_for(lambda: live.viewer.page._panel._tilt.value == 0.25, PATIENCE, 'the slider')
    assert [timer.timer_period_ns for timer in live.viewer.timers] == [1_000_000_000 // 30]


@needs_viser
def test_a_service_that_never_answers_is_reported(live, monkeypatch):
    monkeypatch.setattr(viewer, 'ANSWER_TIME', 200_000_000)
    live.listener.create_service(Trigger, 'drop', lambda request, response: None)
    await_services(live, 'drop')
    live.executor.remove_node(live.listener)
    assert answer_to(live, live.viewer.drop) == 'drop: no answer'
    live.executor.add_node(live.listener)
