# SPDX-License-Identifier: Apache-2.0
"""Test the viewer in a running graph without a browser."""

from contextlib import contextmanager
from functools import partial
from html import unescape
from importlib.util import find_spec
import re
import signal
import socket
import urllib.request

from geometry_msgs.msg import PoseStamped, Vector3
from installed import is_standin
from live_graph import LATCHED, LiveGraph, process, TIMEOUT
import pytest
from std_msgs.msg import Float32
from std_srvs.srv import Empty
from turtle_brick.physics import BrickState
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_tools.graph import executable
from turtle_graph.client.domains import reserved_domain
from turtle_graph.view import viewer
from turtle_graph.view.settings import Settings
from visualization_msgs.msg import Marker, MarkerArray

# A module-level skip would make the launch_testing plugin skip other modules too.
pytestmark = pytest.mark.skipif(find_spec('viser') is None, reason='viser is not installed')

WAITING = 'waiting for the response'


CAMERA = {
    'type': 'ViewerCameraMessage', 'position': (1.0, 1.0, 1.0), 'look_at': (0.0, 0.0, 0.0),
    'up_direction': (0.0, 0.0, 1.0), 'wxyz': (1.0, 0.0, 0.0, 0.0), 'fov': 0.75, 'near': 0.1,
    'far': 100.0, 'image_width': 800, 'image_height': 600}
"""The first message from a page."""


@contextmanager
def open_page(live):
    """Connect to the viewer as a page in a browser does."""
    import msgspec
    from websockets.sync.client import connect
    version = viewer.VISER.replace('==', '-v')
    with connect(live.viewer.server.url.replace('http', 'ws'), subprotocols=[version]) as page:
        page.send(msgspec.msgpack.encode(CAMERA))
        live.wait_for(live.viewer.server.viser.get_clients, TIMEOUT, 'the page')
        yield


def response_to(live, command, *arguments):
    """Execute a command as the page does, and return the displayed response."""
    panel = live.viewer.panel
    panel.show_response(WAITING, True)
    live.viewer.schedule(command, *arguments)
    live.wait_for(lambda: WAITING not in panel.response.content, TIMEOUT, 'a response')
    return unescape(re.sub('<[^>]*>', '', panel.response.content))


@pytest.mark.parametrize('package, name', [
    ('turtle_graph', 'viewer'), pytest.param('rviz2', 'rviz2', marks=pytest.mark.skipif(
        not is_standin('rviz2'), reason='the installed rviz2 is the real one'))])
def test_page_is_served_only_to_this_machine_on_the_next_free_port(
        domain_id, monkeypatch, package, name):
    for variable in ('DISPLAY', 'WAYLAND_DISPLAY'):  # Do not open a browser.
        monkeypatch.delenv(variable, raising=False)
    with socket.create_server(('127.0.0.1', 0)) as taken:
        port = taken.getsockname()[1]
        command = [executable(package, name), '-d', 'nowhere.rviz', '--fullscreen',
                   '--ros-args', '-p', f'port:={port}']
        with process(command, domain_id, stop=signal.SIGTERM) as running:
            url, served = running.wait_for_output(
                name + r': (http://127\.0\.0\.1:(\d+))\n', TIMEOUT).groups()
            with urllib.request.urlopen(url, timeout=TIMEOUT) as page:
                assert page.status == 200 and b'<html' in page.read()
            with pytest.raises(ConnectionRefusedError):
                socket.create_connection(('127.0.0.2', int(served)), TIMEOUT)
    assert int(served) > port
    assert running.output.splitlines() == [
        f'{name}: nowhere.rviz: No such file or directory. The page uses default settings.',
        f'{name}: {url}']


def test_markers_and_commands_of_other_types_work(domain_id):
    marker = Marker(type=Marker.CUBE, scale=Vector3(x=1.0, y=2.0, z=3.0))
    marker.header.frame_id = 'map'
    with LiveGraph(domain_id, quiet=True) as live:
        live.viewer = live.add(viewer.Viewer, '-p', 'port:=0', parameters=False,
                               settings=Settings('map'))
        assert response_to(live, 'drop') == 'drop: the /drop service is not available'
        latched = live.listener.create_publisher(MarkerArray, 'my/boxes', LATCHED)
        latched.publish(MarkerArray(markers=[marker]))
        live.listener.create_service(Empty, 'drop', lambda request, response: response)
        tilts = live.record('tilt', Float32)
        scene = live.viewer.server.viser.scene
        live.wait_for(lambda: any(client.service_is_ready() for client in live.viewer.clients)
                      and live.viewer.count_publishers('tilt'), TIMEOUT, 'discovery')
        assert response_to(live, 'drop') == 'drop: done'
        live.viewer.schedule('tilt', 0.25)
        with open_page(live):
            live.wait_for(lambda: scene.get_handle_by_name('/objects/0/0'), TIMEOUT, 'the marker')
            assert scene.get_handle_by_name('/objects/0/0').scale == (1.0, 2.0, 3.0)
            live.wait_for(lambda: tilts.messages and live.viewer.panel.tilt.value == 0.25,
                          TIMEOUT, 'the tilt')


@pytest.fixture(scope='module')
def shown():
    """Run an arena and a viewer that stops receiving state streams as soon as its page closes."""
    with reserved_domain() as domain, pytest.MonkeyPatch.context() as patch, \
            LiveGraph(domain, quiet=True) as live:
        patch.setattr(viewer, 'IDLE_DELAY', 0.0)
        live.viewer = live.add(viewer.Viewer, '-p', 'port:=0', parameters=False)
        live.world = live.add_arena().world
        yield live


def test_state_streams_are_received_only_while_a_page_is_open(shown):
    scene = shown.viewer.server.viser.scene

    def count_objects():
        names = (f'/objects/{number}' for number in range(100))
        return sum(scene.get_handle_by_name(name) is not None for name in names)

    for _ in range(2):
        shown.wait_for(lambda: shown.viewer.count_subscribers('/tf') == 1, TIMEOUT, 'idle')
        assert count_objects() == shown.viewer.count_subscribers('odom') == 0
        with open_page(shown):
            shown.wait_for(lambda: count_objects() == 5, TIMEOUT, 'the walls and the brick')
            assert shown.viewer.count_subscribers('/tf') == 2, 'the arena and the viewer'
            assert shown.viewer.count_subscribers('odom') == 1


def test_commands_on_the_page_are_executed_and_their_responses_shown(shown, capfd):
    place, drop = partial(response_to, shown, 'place'), partial(response_to, shown, 'drop')
    goals, tilts = shown.record('goal_pose', PoseStamped), shown.record('tilt', Tilt)
    shown.wait_for(lambda: sum(client.service_is_ready() for client in shown.viewer.clients) == 2
                   and all(shown.viewer.count_subscribers(topic) == 2
                           for topic in ('goal_pose', 'tilt')), TIMEOUT, 'discovery')
    assert 'ground' in place((5.0, 5.0, -1.0))
    assert '#c92a2a' in shown.viewer.panel.response.content, 'a failure is red'
    assert place((5.0, 5.0, 3.0)).startswith('place: the brick hovers at (5, 5, 3)')
    drop((4.0, 5.0, 3.0))
    shown.wait_for(lambda: shown.world.state is BrickState.GROUNDED, TIMEOUT, 'the fall')
    assert shown.world.brick[:2] == (4.0, 5.0)
    assert drop().startswith('drop: the brick is on the ground')

    shown.viewer.schedule('drive', 3.0, 4.0)
    shown.viewer.schedule('tilt', 0.25)
    with open_page(shown):
        shown.wait_for(lambda: goals.messages and shown.viewer.panel.tilt.value == 0.25,
                       TIMEOUT, 'the goal and the slider')
    assert goals.last.header.frame_id == 'world'
    assert (goals.last.pose.position.x, goals.last.pose.position.y) == (3.0, 4.0)
    assert goals.last.pose.orientation.w == 1.0 and tilts.last.angle == 0.25
    assert 50_000_000 in [timer.timer_period_ns for timer in shown.viewer.timers]
    assert [line for line in capfd.readouterr().err.splitlines()
            if not re.search('arena.: Refused to', line)] == []
