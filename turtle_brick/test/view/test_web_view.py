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
"""The page itself: where it is served, what it holds, and browsers that are slow or gone."""

from importlib.util import find_spec
from itertools import product
from math import isclose, isnan, tan
import re
import socket
import struct
from types import SimpleNamespace
import urllib.request

from hypothesis import given
from hypothesis import strategies as st
import numpy
import pytest
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.geometry import from_yaw, IDENTITY, Pose
from turtle_brick.core.parameters import load
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, ARENA_SIZE
from turtle_brick.physics import Phase
from turtle_brick.view.urdf_scene import Shape
from turtle_brick.view.viewing import History

# Not skipped as a whole, which launch_testing's plugin would take for all files beside it as well.
if find_spec('viser') is not None:
    from turtle_brick.view.web_scene import ABOVE, ground_under, NEAR
    from turtle_brick.view.web_view import AddressError, free_port, WebView

pytestmark = pytest.mark.skipif(
    find_spec('viser') is None,
    reason='viser, which draws the page, is not installed here')

HOST = '127.0.0.1'
RED = (1.0, 0.0, 0.0, 1.0)
COORDINATES = st.floats(-50.0, 50.0)


def seen_from(view, point):
    """Return where a point of the world (m) is seen, in heights of the picture from its middle."""
    forward = numpy.subtract(view.look_at, view.position)
    forward /= numpy.linalg.norm(forward)
    right = numpy.cross(forward, (0.0, 0.0, 1.0))
    right /= numpy.linalg.norm(right)
    ray = numpy.subtract(point, view.position)
    scale = 0.5 / tan(view.field_of_view / 2.0) / (ray @ forward)
    return scale * (ray @ right), scale * (ray @ numpy.cross(right, forward))


@pytest.fixture(scope='module')
def view():
    """Serve a page."""
    view = WebView(HOST, 0, lambda command: None)
    yield view
    view.close()


def test_a_port_that_is_taken_is_passed_over():
    with socket.create_server((HOST, 0)) as taken:
        port = taken.getsockname()[1]
        assert free_port(HOST, port) > port
    assert free_port(HOST, port) == port
    assert free_port(HOST, 0) > 0


@pytest.mark.parametrize(('host', 'port', 'named'), [
    (HOST, -1, '-1'), (HOST, 65536, '65536'), ('x' * 64, 8080, 'x' * 64),
    ('192.0.2.1', 8080, '192.0.2.1')])
def test_an_address_that_cannot_be_is_named(host, port, named):
    with pytest.raises(AddressError, match=named):
        free_port(host, port)


def test_the_page_is_served(view):
    with urllib.request.urlopen(view.url, timeout=10.0) as page:
        assert page.status == 200
        assert b'<html' in page.read()


@given(st.tuples(COORDINATES, COORDINATES, st.floats(0.1, 50.0)), COORDINATES, COORDINATES)
def test_a_click_is_on_the_ground_that_it_points_at(eye, x, y):
    ray = (x - eye[0], y - eye[1], -eye[2])
    assert ground_under(eye, ray) == pytest.approx((x, y), abs=1e-9)
    assert ground_under(eye, (ray[0], ray[1], eye[2])) is None
    assert ground_under((eye[0], eye[1], -eye[2]), ray) is None


def test_a_click_at_the_horizon_is_no_goal():
    assert ground_under((0.0, 0.0, 1.0), (1.0, 0.0, -1e-3)) is None


def test_things_are_made_moved_hidden_and_removed(view):
    scene, nodes = view.scene, view.server.scene
    shapes = [Shape(kind, (1.0, 2.0, 3.0), RED, Pose((1.0, 0.0, 0.0), from_yaw(1.0)))
              for kind in ('box', 'cylinder', 'sphere')]
    shapes.append(Shape('text', (0.5, 0.5, 0.5), RED, text='<b>text</b>'))
    shapes.append(Shape('lines', (0.1, 0.1, 0.1), RED, points=((0, 0, 0), (1, 1, 1))))
    scene.put('thing', shapes)
    node = nodes.get_handle_by_name('/world/things/thing')
    assert not node.visible
    parts = [nodes.get_handle_by_name(f'/world/things/thing/{number}') for number in range(5)]
    assert all(part.scale == (1.0, 2.0, 3.0) for part in parts[:3])
    assert parts[0].color == (255, 0, 0)
    scene.move('thing', Pose((1.0, 2.0, 3.0), from_yaw(0.5)))
    assert node.visible
    assert tuple(node.position) == (1.0, 2.0, 3.0)
    x, y, z, w = from_yaw(0.5)
    assert tuple(node.wxyz) == pytest.approx((w, x, y, z))
    scene.move('thing', None)
    assert not node.visible

    scene.move('thing', Pose((4.0, 0.0, 0.0), IDENTITY))
    scene.put('thing', shapes)
    assert nodes.get_handle_by_name('/world/things/thing') is node, 'nothing changed'
    scene.put('thing', shapes[:1])
    node = nodes.get_handle_by_name('/world/things/thing')
    assert node.visible and tuple(node.position) == (4.0, 0.0, 0.0), 'it stays where it was'
    assert nodes.get_handle_by_name('/world/things/thing/1') is None
    scene.remove('thing')
    scene.remove('thing')
    assert nodes.get_handle_by_name('/world/things/thing') is None
    assert 'thing' not in scene.names()


def test_what_is_followed_stays_where_it_is_before_the_cameras(view):
    scene, nodes = view.scene, view.server.scene
    world = nodes.get_handle_by_name('/world')
    scene.put('robot', [Shape('box', (1.0, 1.0, 1.0), RED)])
    robot = nodes.get_handle_by_name('/world/things/robot')
    for x, y in ((1.0, 2.0), (9.0, -3.5), (ARENA_CENTER, ARENA_CENTER)):
        before = view.changes
        scene.move('robot', Pose((x, y, 0.5), IDENTITY))
        scene.focus_on(x, y)
        assert view.changes == before + 2
        seen = [a + b for a, b in zip(world.position, robot.position)]
        assert seen == pytest.approx([ARENA_CENTER, ARENA_CENTER, 0.5])
        click = SimpleNamespace(ray_origin=(ARENA_CENTER + 1.0, ARENA_CENTER, 5.0),
                                ray_direction=(0.0, 0.0, -1.0))
        assert scene.clicked(click) == pytest.approx((x + 1.0, y)), 'a click is in the world'
    assert tuple(world.position) == (0.0, 0.0, 0.0), 'as in the beginning'
    before = view.changes
    scene.focus_on(ARENA_CENTER, ARENA_CENTER)
    assert view.changes == before
    scene.remove('robot')


def test_the_robot_is_near_and_the_brick_in_sight_in_the_first_view():
    parameters = load()
    foot = seen_from(NEAR, (*CENTER, 0.0))[1]
    top = seen_from(NEAR, (*CENTER, parameters.platform_height))[1]
    assert top - foot >= 0.25 and foot > -0.5
    across, up = seen_from(NEAR, parameters.brick_start)
    assert up < 0.48 and abs(across) < 0.48, 'even where the page is as wide as it is high'
    for corner in product((0.0, ARENA_SIZE), repeat=2):
        across, up = seen_from(ABOVE, (*corner, 0.0))
        assert 0.4 < abs(across) < 0.48 and 0.4 < abs(up) < 0.48


def test_the_curves_are_plotted_as_they_are(view):
    panel, history = view.panel, History(3)
    panel.show_history(history)
    before = view.changes
    panel.show_history(history)
    assert view.changes == before, 'nothing new is not sent'
    for number, (highest, top) in enumerate(((3.0, 10.0), (25.0, 30.0), (10.0, 30.0))):
        history.add((1000 + number) * History.PERIOD, (highest, None, 1.0))
        panel.show_history(history)
        assert panel._plot.scales['y']['range'] == (0.0, top)
        plotted = [[None if isnan(value) else value for value in column]
                   for column in panel._plot.data]
        assert plotted == history.columns()
    history.add(0, (1.0, 1.0, 1.0))
    panel.show_history(history)
    assert panel._plot.scales['y']['range'] == (0.0, 10.0)


def test_the_legend_is_in_the_colors(view):
    view.panel.show_legend({phase: (number / 255.0, 0.0, 1.0, 1.0)
                            for number, phase in enumerate(Phase)})
    swatches = re.findall(r'color:rgb\((\d+),0,255\)">&#9632;</span> ([a-z ]+)<',
                          view.panel._legend.content)
    assert swatches == [(str(number), phase.value) for number, phase in enumerate(Phase)]


def test_a_shape_of_no_known_kind_is_refused(view):
    with pytest.raises(ValueError, match='pyramid'):
        view.scene.put('other', [Shape('pyramid', (1.0, 1.0, 1.0), RED)])


def test_texts_are_no_html(view):
    panel = view.panel
    panel.show_answer('place: <script>alert(1)</script>', False)
    assert '&lt;script&gt;' in panel._answer.content
    panel.show_account('Unreachable', True)
    assert '#c92a2a' in panel._account.content
    panel.show_account('Waiting', False)
    assert '#c92a2a' not in panel._account.content
    panel.show_rates([('odom', 99.96), ('cmd_vel', None)])
    assert '100.0 Hz' in panel._rates.content and 'no messages' in panel._rates.content


def test_the_slider_follows_the_platform_within_its_range(view):
    for angle, shown in ((0.7, 0.7), (9.0, view.panel._slider.max), (0.0, 0.0)):
        view.panel.show_tilt(angle)
        assert isclose(view.panel._slider.value, shown)


def test_a_browser_that_reads_nothing_or_is_gone_holds_nothing_up(view):
    import viser
    from websockets.sync.client import connect

    def visitor():
        return connect(view.url.replace('http', 'ws'), max_size=None,
                       subprotocols=[f'viser-v{viser.__version__}'])

    view.scene.put('brick', [Shape('box', (1.0, 1.0, 1.0), RED)])
    with visitor() as reader:
        deaf = socket.create_connection((HOST, view.port))
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        deaf.sendall(
            (f'GET / HTTP/1.1\r\nHost: {HOST}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n'
             'Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n'
             f'Sec-WebSocket-Protocol: viser-v{viser.__version__}\r\n\r\n').encode())
        gone = visitor()
        assert gone.recv(timeout=10.0) and reader.recv(timeout=10.0)
        # An abrupt end: a reset, as of a machine that has been switched off.
        gone.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack('ii', 1, 0))
        gone.socket.close()
        backlog = view.server._websock_server._broadcast_buffer.message_from_id
        before, history = len(backlog), History(3)
        for step in range(3000):
            with view.together():
                view.scene.move('brick', Pose((0.0, 0.0, 1.0 + step), IDENTITY))
                view.scene.focus_on(step, step)
                history.add(step * History.PERIOD, (step, step, step))
                view.panel.show_history(history)
                view.panel.show_brick(f'step {step}', None)
        assert len(backlog) <= before + 10, 'only the latest state waits for a browser'
        last, heard = b'step 2999', b''
        import zstandard
        while last not in heard:
            raw = reader.recv(timeout=10.0)
            length = int.from_bytes(raw[8:16], 'little')
            heard = zstandard.ZstdDecompressor().decompress(raw[16:16 + length])
        deaf.close()
