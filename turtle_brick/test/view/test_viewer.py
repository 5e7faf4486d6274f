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
"""The viewer: who may talk to it, what its buttons do in a live graph, how it starts and ends."""

from functools import partial
from html import unescape
import http.client
from pathlib import Path
import re
import signal
import socket
import urllib.request

from geometry_msgs.msg import PoseStamped
from live_graph import graph, process, TIMEOUT
import pytest
from turtle_brick.core.parameters import ParameterError
from turtle_brick.physics import Phase
from turtle_brick.tools.graph import executable
from turtle_brick.view import viewer
from turtle_brick_interfaces.msg import Tilt

# Not skipped as a whole, which launch_testing's plugin would take for all files beside it as well.
if viewer.find_spec('viser') is not None:
    from turtle_brick.view.server import check, PageServer, refusal
    import viser

needs_viser = pytest.mark.skipif(
    viewer.find_spec('viser') is None,
    reason='viser, which draws the page, is not installed here')

HOST = '127.0.0.1'
HERE = ('localhost:8080', '127.0.0.1:8080', '[::1]:8080', '192.168.1.7:80', 'LocalHost')
ELSEWHERE = ('evil.example', 'evil.example:8080', 'localhost.evil.example', '', ':8080',
             'me@evil.example', '[localhost]:8080x')


def answer_to(live, order, *values):
    """Give an order as the page does, and return the answer that is shown."""
    panel = live.viewer.panel
    panel.show_answer('no answer yet', True)
    live.viewer._soon(order)(*values)
    live.wait_for(lambda: 'no answer yet' not in panel._answer.content, TIMEOUT, 'an answer')
    return unescape(re.sub('<[^>]*>', '', panel._answer.content))


def test_without_viser_it_says_how_to_get_the_version_that_the_home_has(monkeypatch, capsys):
    monkeypatch.setattr(viewer, 'find_spec', lambda name: None)
    assert viewer.main([]) == 1
    said = capsys.readouterr().err
    assert said.count('\n') == 1 and f'pip install {viewer.VISER}' in said
    requirements = Path(__file__).parents[2] / 'scripts' / 'requirements.txt'
    assert f'\n{viewer.VISER} ' in requirements.read_text()


@needs_viser
def test_only_the_pages_of_this_machine_are_let_in():
    for host in HERE:
        assert refusal(HOST, [host], []) == refusal(HOST, [host], [f'http://{host}']) == ''
        for other in {*HERE, *ELSEWHERE} - {host}:
            assert refusal(HOST, [host], [f'http://{other}']), (host, other)
        assert refusal(HOST, [host], [f'http://{host}', 'null'])
    for host in ELSEWHERE:
        assert refusal(HOST, [host], [f'http://{host}']), 'a name that has been made to lead here'
    assert refusal(HOST, [], []) and refusal(HOST, ['localhost', 'localhost'], [])


@needs_viser
def test_the_names_of_this_machine_are_its_own():
    name = socket.gethostname().lower()
    assert not refusal('0.0.0.0', [f'{name}:8080'], [f'http://{name}:8080'])
    assert not refusal('0.0.0.0', [f'{name}.local'], [])
    assert not refusal('Robot.Lab', ['robot.lab:8080'], [])
    assert refusal(HOST, ['robot.lab:8080'], [])


@needs_viser
def test_a_foreign_page_can_do_nothing():
    server = PageServer(HOST, 0, 'test')
    upgrade = {'Upgrade': 'websocket', 'Connection': 'Upgrade', 'Sec-WebSocket-Version': '13',
               'Sec-WebSocket-Key': 'AAAAAAAAAAAAAAAAAAAAAA==',
               'Sec-WebSocket-Protocol': f'viser-v{viser.__version__}'}
    for headers, status in (({}, 200), (upgrade, 101)):
        for foreign in ({}, {'Host': 'evil.example'}, {'Origin': 'http://evil.example'}):
            connection = http.client.HTTPConnection(HOST, server.port, timeout=20.0)
            connection.request('GET', '/', headers={**headers, **foreign})
            assert connection.getresponse().status == (403 if foreign else status)
            connection.close()
    server.viser.stop()


@needs_viser
def test_an_address_that_cannot_be_is_named():
    for host, port, named in ((HOST, 65536, 'port is 65536'), ('x' * 64, 8080, 'x' * 64),
                              ('192.0.2.1', 8080, "host is '192.0.2.1'")):
        with pytest.raises(ParameterError, match=named):
            check(host, port)


@needs_viser
def test_it_serves_on_the_next_free_port_and_ends_quietly(domain_id):
    with socket.create_server(('127.0.0.1', 0)) as taken:
        port = taken.getsockname()[1]
        command = [executable('turtle_brick', 'viewer'), '--ros-args', '-p', f'port:={port}']
        with process(command, domain_id, stop=signal.SIGTERM) as running:
            url, found = running.wait_for_output(
                r'Viewer: (http://127\.0\.0\.1:(\d+))\n', TIMEOUT).groups()
            with urllib.request.urlopen(url, timeout=TIMEOUT) as page:
                assert page.status == 200 and b'<html' in page.read()
    assert int(found) > port
    warning, said = running.output.splitlines()
    assert f'Port {port} is not free: the page is on {found}' in warning
    assert said == f'Viewer: {url}'


@needs_viser
def test_what_is_asked_for_on_the_page_is_done_and_what_becomes_of_it_is_shown(domain_id, capfd):
    with graph(domain_id, quiet=True) as live:
        live.viewer = live.add(viewer.Viewer, '-p', 'port:=0', parameters=False)
        place, drop = partial(answer_to, live, live.viewer.place), partial(
            answer_to, live, live.viewer.drop)
        assert drop() == 'drop: nobody offers /drop'
        world = live.add_arena().world
        goals, tilts = live.record('goal_pose', PoseStamped), live.record('tilt', Tilt)
        live.wait_for(lambda: all(client.service_is_ready() for client in live.viewer.clients)
                      and all(live.viewer.count_subscribers(topic) == 2
                              for topic in ('goal_pose', 'tilt')), TIMEOUT, 'they meet')
        assert 'ground' in place((5.0, 5.0, -1.0))
        assert '#c92a2a' in live.viewer.panel._answer.content, 'in red'
        assert place((5.0, 5.0, 3.0)) == 'place: the brick hovers at (5, 5, 3)'
        drop((4.0, 5.0, 3.0))
        live.wait_for(lambda: world.phase is Phase.GROUNDED, TIMEOUT, 'it is down')
        assert world.brick[:2] == (4.0, 5.0)
        assert drop() == 'drop: the brick is on the ground: place it first'

        live.viewer._soon(live.viewer.go)(3.0, 4.0)
        live.viewer._soon(live.viewer.tilt)(0.25)
        live.wait_for(lambda: goals.messages and live.viewer.panel._tilt.value == 0.25, TIMEOUT,
                      'goal and slider')
        assert goals.last.header.frame_id == 'world'
        assert (goals.last.pose.position.x, goals.last.pose.position.y) == (3.0, 4.0)
        assert goals.last.pose.orientation.w == 1.0 and tilts.last.angle == 0.25
        assert [timer.timer_period_ns for timer in live.viewer.timers] == [1_000_000_000 // 30]
    assert [line for line in capfd.readouterr().err.splitlines() if 'Viewer: ' not in line] == []
