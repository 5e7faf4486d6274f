# SPDX-License-Identifier: Apache-2.0

from contextlib import contextmanager
from functools import partial
from html import unescape
from pathlib import Path
import re
import signal
import socket
import sys
import urllib.request

from geometry_msgs.msg import PoseStamped, Vector3
from installed import is_standin
from live_graph import graph, LATCHED, process, TIMEOUT
import pytest
from std_msgs.msg import Float32
from std_srvs.srv import Empty
from turtle_brick.physics import BrickState
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_tools.graph import executable
from turtle_graph.client.spinning import STOP_SIGNALS
from turtle_graph.view import viewer
from turtle_graph.view.settings import Settings
from visualization_msgs.msg import Marker, MarkerArray

# A module-level skip would make the launch_testing plugin skip other modules too.
if viewer.find_spec('viser') is not None:
    from turtle_graph.view.server import check_address

needs_viser = pytest.mark.skipif(
    viewer.find_spec('viser') is None, reason='viser is not installed')

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


def test_without_viser_the_viewer_prints_how_to_install_it(monkeypatch, capsys):
    monkeypatch.setattr(viewer, 'find_spec', lambda name: None)
    assert viewer.main([]) == 1
    error = capsys.readouterr().err
    assert error.count('\n') == 1 and f'pip install {viewer.VISER}' in error
    requirements = Path(__file__).parents[4] / 'scripts' / 'requirements.txt'
    assert f'\n{viewer.VISER} ' in requirements.read_text()


@pytest.mark.parametrize('number', STOP_SIGNALS)
def test_signal_during_the_creation_of_a_node_ends_the_program(domain_id, number):
    # Python may run the handler of a signal that another thread receives only when the main thread
    # waits the next time, so this node waits for short times, as nodes do.
    code = """
import time

from turtle_graph.client.spinning import run_node

def create():
    print("creating", flush=True)
    while True:
        time.sleep(0.01)

run_node(create, "test")
"""
    command = [sys.executable, '-c', code]
    with process(command, domain_id, stop=number, timeout=30.0) as running:
        running.wait_for_output('creating', TIMEOUT)


@needs_viser
def test_invalid_address_is_named_in_the_error():
    for host, port, named in (('127.0.0.1', 65536, 'port is 65536'), ('x' * 64, 8080, 'x' * 64),
                              ('192.0.2.1', 8080, "host is '192.0.2.1'")):
        with pytest.raises(ValueError, match=named):
            check_address(host, port)


@needs_viser
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


@needs_viser
def test_commands_on_the_page_are_executed_and_their_responses_shown(domain_id, capfd):
    with graph(domain_id, quiet=True) as live:
        live.viewer = live.add(viewer.Viewer, '-p', 'port:=0', parameters=False)
        place = partial(response_to, live, 'place')
        drop = partial(response_to, live, 'drop')
        assert drop() == 'drop: the /drop service is not available'
        world = live.add_arena().world
        goals, tilts = live.record('goal_pose', PoseStamped), live.record('tilt', Tilt)
        live.wait_for(lambda: sum(client.service_is_ready() for client in live.viewer.clients) == 2
                      and all(live.viewer.count_subscribers(topic) == 2
                              for topic in ('goal_pose', 'tilt')), TIMEOUT, 'discovery')
        assert 'ground' in place((5.0, 5.0, -1.0))
        assert '#c92a2a' in live.viewer.panel.response.content, 'a failure is red'
        assert place((5.0, 5.0, 3.0)).startswith('place: the brick hovers at (5, 5, 3)')
        drop((4.0, 5.0, 3.0))
        live.wait_for(lambda: world.state is BrickState.GROUNDED, TIMEOUT, 'the end of the fall')
        assert world.brick[:2] == (4.0, 5.0)
        assert drop().startswith('drop: the brick is on the ground')

        live.viewer.schedule('drive', 3.0, 4.0)
        live.viewer.schedule('tilt', 0.25)
        with open_page(live):
            live.wait_for(lambda: goals.messages and live.viewer.panel.tilt.value == 0.25,
                          TIMEOUT, 'the goal and the slider')
        assert goals.last.header.frame_id == 'world'
        assert (goals.last.pose.position.x, goals.last.pose.position.y) == (3.0, 4.0)
        assert goals.last.pose.orientation.w == 1.0 and tilts.last.angle == 0.25
        assert 50_000_000 in [timer.timer_period_ns for timer in live.viewer.timers]
    assert [line for line in capfd.readouterr().err.splitlines()
            if not re.search('viewer: |arena.: Refused to', line)] == []


@needs_viser
def test_markers_and_commands_of_other_types_work(domain_id):
    marker = Marker(type=Marker.CUBE, scale=Vector3(x=1.0, y=2.0, z=3.0))
    marker.header.frame_id = 'map'
    with graph(domain_id, quiet=True) as live:
        live.viewer = live.add(viewer.Viewer, '-p', 'port:=0', parameters=False,
                               settings=Settings('map'))
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


@needs_viser
def test_state_streams_are_received_only_while_a_page_is_open(domain_id, monkeypatch):
    monkeypatch.setattr(viewer, 'IDLE_DELAY', 0.0)
    with graph(domain_id, quiet=True) as live:
        live.viewer = live.add(viewer.Viewer, '-p', 'port:=0', parameters=False)
        live.add_arena()
        scene = live.viewer.server.viser.scene

        def count_objects():
            names = (f'/objects/{number}' for number in range(100))
            return sum(scene.get_handle_by_name(name) is not None for name in names)

        for _ in range(2):
            live.wait_for(lambda: live.viewer.count_subscribers('/tf') == 1, TIMEOUT, 'idle')
            assert count_objects() == live.viewer.count_subscribers('odom') == 0
            with open_page(live):
                live.wait_for(lambda: count_objects() == 5, TIMEOUT, 'the walls and the brick')
                assert live.viewer.count_subscribers('/tf') == 2, 'the arena and the viewer'
                assert live.viewer.count_subscribers('odom') == 1
