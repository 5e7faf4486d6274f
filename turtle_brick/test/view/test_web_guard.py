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
"""Who may open the page and what a browser may send: foreign pages, bad messages are refused."""

from contextlib import contextmanager, ExitStack
import copy
from importlib.util import find_spec
from itertools import product
from math import inf, nan
import socket
import struct
from threading import Condition

from hypothesis import given
from hypothesis import strategies as st
import pytest
from turtle_brick.core.geometry import IDENTITY, Pose
from turtle_brick.view.urdf_scene import Shape

# Not skipped as a whole, which launch_testing's plugin would take for all files beside it as well.
if find_spec('viser') is not None:
    import msgspec
    from turtle_brick.view.commands import DropAtRandom, SendTo, SetTilt
    from turtle_brick.view.web_guard import (BRICK_BUTTONS, Door, is_admissible, LARGEST_MESSAGE,
                                             LoopEvent, VIEW_BUTTONS, VISITORS)
    from turtle_brick.view.web_scene import VIEWS
    from turtle_brick.view.web_view import WebView
    import viser
    from websockets.exceptions import ConnectionClosed, InvalidStatus
    from websockets.sync.client import connect
    import zstandard

pytestmark = pytest.mark.skipif(
    find_spec('viser') is None,
    reason='viser, which draws the page, is not installed here')

TIMEOUT = 20.0

CAMERA = {'type': 'ViewerCameraMessage', 'wxyz': [1, 0.0, 0.0, 0.0], 'position': [5.5, -11.5, 8.2],
          'look_at': [5, 5, 3.2], 'up_direction': [0, 0, 1], 'fov': 0.82, 'near': 0.01,
          'far': 1000, 'image_height': 480, 'image_width': 960}
CLICK = {'type': 'ScenePointerMessage', 'event_type': 'click', 'ray_origin': [3.0, 2.0, 5.0],
         'ray_direction': [0, 0, -1], 'screen_pos': [[0.5, 0.25]], 'modifier': None}
UPDATE = {'type': 'GuiUpdateMessage', 'uuid': 'a', 'updates': {'value': 0.5}}
RENDER = {'type': 'GetRenderResponseMessage', 'payload': b'png', 'render_uuid': 'b'}


def packed(message):
    """Return a message as it is sent."""
    return msgspec.msgpack.encode(message)


def unpacked(raw):
    """Return the messages of the page, which are sent compressed."""
    length = int.from_bytes(raw[8:16], 'little')
    return msgspec.msgpack.decode(
        zstandard.ZstdDecompressor().decompress(raw[16:16 + length]))['messages']


class Page:
    """A page that is served, and the commands from it."""

    def __init__(self):
        """Serve it."""
        self.commands = []
        self.news = Condition()
        self.view = WebView('127.0.0.1', 0, self.hear)
        self.address = f'127.0.0.1:{self.view.port}'

    def hear(self, command):
        """Note a command."""
        with self.news:
            self.commands.append(command)
            self.news.notify_all()

    def wait_for(self, command):
        """Wait for a command."""
        with self.news:
            assert self.news.wait_for(lambda: command in self.commands, TIMEOUT), self.commands

    @contextmanager
    def visitor(self, **options):
        """Return a context with the connection of a browser that shows the page."""
        with connect(f'ws://{self.address}', max_size=None, **{
                'subprotocols': [f'viser-v{viser.__version__}'],
                'origin': f'http://{self.address}', **options}) as connection:
            connection.send(packed(CAMERA))
            yield connection

    def ask(self, request):
        """Return the whole answer to a raw request."""
        with socket.create_connection(('127.0.0.1', self.view.port), TIMEOUT) as connection:
            connection.sendall(request)
            answer = b''
            while (part := connection.recv(1 << 16)):
                answer += part
            return answer

    def get(self, path, *headers):
        """Return the answer to a GET."""
        lines = [f'GET {path} HTTP/1.1', *(headers or [f'Host: {self.address}']), '', '']
        return self.ask('\r\n'.join(lines).encode())

    def tilt(self, connection, angle):
        """Move the slider, as a browser does, and wait for its command."""
        connection.send(packed({**UPDATE, 'uuid': self.uuid(self.view.panel._slider),
                                'updates': {'value': angle}}))
        self.wait_for(SetTilt(angle))

    @staticmethod
    def uuid(control):
        """Return the name of a control in the messages."""
        return control._impl.uuid


@pytest.fixture(scope='module')
def page():
    """Serve a page."""
    page = Page()
    yield page
    page.view.close()


HERE = ('localhost:8080', '127.0.0.1:8080', '[::1]:8080', '192.168.1.7:80', 'LocalHost',
        '[fe80::1]')
ELSEWHERE = ('evil.example', 'evil.example:8080', 'localhost.evil.example:8080', '', ':8080',
             'me@localhost:8080', 'localhost:8080:80', 'localhost/', '[localhost]:8080x',
             '2130706433', 'localhost ', 'localhost:8080, evil.example')


def test_only_the_pages_of_this_machine_are_let_in():
    door = Door('127.0.0.1')
    for host in HERE:
        assert door.refusal([host], []) is None
        assert door.refusal([host], [f'http://{host}']) is None
        for other in (*HERE, *ELSEWHERE, 'null'):
            if other.lower() != host.lower():
                assert door.refusal([host], [f'http://{other}']), (host, other)
                assert door.refusal([host], [other])
        assert door.refusal([host], [f'http://{host}', 'http://evil.example'])
    for host in ELSEWHERE:
        assert door.refusal([host], []), host
        assert door.refusal([host], [f'http://{host}']), 'a name that has been made to lead here'
    assert door.refusal([], []) and door.refusal(['localhost', 'localhost'], [])


def test_the_names_by_which_it_is_served_are_its_own():
    name = socket.gethostname().lower()
    for host in ('0.0.0.0', '::', ''):
        assert Door(host).refusal([f'{name}:8080'], [f'http://{name}:8080']) is None
        assert Door(host).refusal([f'{name}.local'], []) is None
        assert Door(host).refusal(['evil.example'], [])
    assert Door('Robot.Lab').refusal(['robot.lab:8080'], []) is None
    assert Door('127.0.0.1').refusal(['robot.lab:8080'], [])


@pytest.mark.parametrize('headers', [
    {'origin': 'http://evil.example'}, {'origin': 'null'}, {'origin': 'http://127.0.0.1:1'},
    {'origin': 'http://evil.example', 'host': 'evil.example'}, {'host': 'evil.example'}])
def test_a_foreign_page_can_do_nothing(page, headers):
    host = headers.get('host', page.address)
    request = [f'Host: {host}', 'Upgrade: websocket', 'Connection: Upgrade',
               'Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==', 'Sec-WebSocket-Version: 13',
               f'Sec-WebSocket-Protocol: viser-v{viser.__version__}']
    if 'origin' in headers:
        request.append(f'Origin: {headers["origin"]}')
    answer = page.get('/', *request)
    assert answer.startswith(b'HTTP/1.1 403 ')
    assert b'The page is' in answer and b'Traceback' not in answer


def test_the_page_and_programs_are_served(page):
    answer = page.get('/')
    assert answer.startswith(b'HTTP/1.1 200 ')
    assert b"frame-ancestors 'self'" in answer, 'no other page can lay itself over it'
    for number, origin in enumerate((f'http://{page.address}', None)):
        with page.visitor(origin=origin) as browser:
            page.tilt(browser, 0.5 + number / 10.0)


@pytest.mark.parametrize('path', [
    '/../../../../../../../../etc/passwd', '/%2e%2e/%2e%2e/%2e%2e/%2e%2e/%2e%2e/%2e%2e/etc/passwd',
    '//etc/passwd', '/..%5c..%5c..%5c..%5cetc%5cpasswd', '/%2fetc%2fpasswd', '/%00',
    'file:///etc/passwd', '/%252e%252e/etc/passwd', '/\\..\\..\\etc\\passwd', '/' + 'a' * 5000,
    '/../__init__.py', '/..;/__init__.py'])
def test_no_other_file_can_be_read(page, path, capfd):
    answer = page.get(path)
    assert b'root:' not in answer and b'import ' not in answer
    assert not answer.startswith(b'HTTP/1.1 200')
    assert 'Traceback' not in capfd.readouterr().err


@pytest.mark.parametrize('method', ['POST', 'PUT', 'DELETE', 'PATCH'])
def test_no_file_can_be_written(page, method, capfd):
    answer = page.ask(f'{method} /x HTTP/1.1\r\nHost: {page.address}\r\n'
                      'Content-Length: 3\r\n\r\nabc'.encode())
    assert not answer.startswith(b'HTTP/1.1 2')
    assert capfd.readouterr().err == ''


def test_what_the_page_sends_is_heard():
    for message in (CAMERA, CLICK, UPDATE, RENDER):
        assert is_admissible(packed(message))
    for value in (True, False, -1, 0.5, [1, 2.5, -3], *BRICK_BUTTONS, *VIEW_BUTTONS):
        assert is_admissible(packed({**UPDATE, 'updates': {'value': value}}))


def spoiled():
    """Yield messages of the page that have something wrong."""
    wrong = (None, nan, inf, -inf, 1e308, 2**64 - 1, 'x', '', {}, {'a': 1}, [], [1], [1, 2],
             [1, 2, nan], [1, 2, '3'], [1, 2, 3, 4, 5], [[1, 2], [3]], [[1, 2, 3]], b'123', True)
    for message in (CAMERA, CLICK, RENDER):
        for name, value in product(set(message) - {'modifier', 'uuid', 'render_uuid'}, wrong):
            if not (name == 'payload' and isinstance(value, bytes)):
                yield {**message, name: value}
    for message in (CAMERA, CLICK, UPDATE, RENDER):
        for name in message:
            yield {key: value for key, value in message.items() if key != name}
        yield {**message, 'excluded_self_client': 0}
    for value in (nan, 1e308, 'x' * 10**6, 'Lift', [1, 2], [1, 2, 3, 4], {}, None, b'Drop'):
        yield {**UPDATE, 'updates': {'value': value}}
    for name in ('__dict__', '__class__', 'update_cb', 'sync_cb', 'props', 'uuid', 'removed',
                 'gui_api', 'min', 'label', 'visible'):
        for value in (0.5, {}, [], 'Drop', None):
            yield {**UPDATE, 'updates': {name: value}}
            yield {**UPDATE, 'updates': {'value': 0.5, name: value}}
    yield {**UPDATE, 'updates': {}}
    yield {**UPDATE, 'uuid': 5}
    for kind in ('ShareUrlRequest', 'ShareUrlDisconnect', 'ReplayDoneMessage', 'Message', '', 7,
                 [], {}):
        yield {'type': kind}
    yield {'type': 'FileTransferStartUpload', 'source_component_uuid': 'a', 'transfer_uuid': 'b',
           'filename': '../../x', 'mime_type': 'text/plain', 'part_count': 1, 'size_bytes': 3}
    yield {'type': 'GuiFormDirtyMessage', 'uuid': 'a'}
    yield {'type': 'RunJavascriptMessage', 'source': 'alert(1)'}


def test_nothing_else_is_heard():
    for message in spoiled():
        assert not is_admissible(packed(message)), message
    assert not is_admissible('text')
    for raw in (b'\x91' * 10**6, b'\xdf\xff\xff\xff\xff', b'\xc9\xff\xff\xff\xff\x00', b'',
                packed(CAMERA)[:-1], packed(CAMERA) + b'\x00', packed([CAMERA])):
        assert not is_admissible(raw)


@given(st.binary(max_size=60), st.integers(0, 300), st.sampled_from([CAMERA, CLICK, UPDATE]))
def test_no_bytes_are_too_much(data, place, message):
    assert not is_admissible(data)
    raw = packed(message)
    is_admissible(raw[:place] + data + raw[place + len(data):])


def test_no_client_ends_the_page_or_reaches_the_terminal(page, capfd):
    slider = page.view.panel._slider._impl
    as_it_was = [*vars(slider)], copy.copy(slider.props), list(slider.update_cb), slider.sync_cb
    inputs = [page.uuid(control) for control in (page.view.panel._slider, page.view.panel._place,
                                                 page.view.panel._frames)]
    with page.visitor() as browser:
        page.tilt(browser, 0.1)
        before = list(page.commands)
        for message in spoiled():
            browser.send(packed(message))
            if message.get('type') == 'GuiUpdateMessage' and message.get('uuid') == 'a':
                for uuid in inputs:
                    browser.send(packed({**message, 'uuid': uuid}))
        # What is right for one control may be wrong for another.
        for uuid, value in product(inputs[1:], (0.25, 'Place', 'Drop', True)):
            browser.send(packed({**UPDATE, 'uuid': uuid, 'updates': {'value': value}}))
        browser.send('text')
        browser.send(b'\xff' * 1000)
        page.tilt(browser, 0.2)
        assert page.commands == [*before, SetTilt(0.2)]
        browser.send(packed(CLICK))
        page.wait_for(SendTo(3.0, 2.0))
    assert ([*vars(slider)], slider.props, slider.update_cb, slider.sync_cb) == as_it_was
    assert len(page.view.panel._place.value) == 3
    assert capfd.readouterr() == ('', '')


def test_a_slider_beyond_its_end_tilts_the_platform_as_far_as_it_goes(page):
    with page.visitor() as browser:
        for value in (100.0, -100.0):
            limit = page.view.panel._slider.max if value > 0 else -page.view.panel._slider.max
            browser.send(packed({**UPDATE, 'uuid': page.uuid(page.view.panel._slider),
                                 'updates': {'value': value}}))
            page.wait_for(SetTilt(limit))


def test_a_button_of_the_view_sets_the_camera_of_its_browser_only(page, capfd):
    with page.visitor() as browser, page.visitor() as other:
        page.tilt(browser, 0.7)
        page.tilt(other, 0.8)
        clients = page.view.server.get_clients()
        mine, others = (clients[number].camera for number in sorted(clients)[-2:])
        for value in ('Drop at random', 'From above'):
            browser.send(packed({**UPDATE, 'uuid': page.uuid(page.view.panel._views),
                                 'updates': {'value': value}}))
        while not any(message['type'] == 'SetCameraFovMessage' and not message['initial']
                      for message in unpacked(browser.recv(timeout=TIMEOUT))):
            pass
        view = VIEWS['From above']
        assert tuple(mine.position) == pytest.approx(view.position)
        assert (tuple(mine.look_at), mine.fov) == view[1:]
        assert (list(others.position), others.fov) == (CAMERA['position'], CAMERA['fov'])
        assert not any(isinstance(command, DropAtRandom) for command in page.commands)
    assert capfd.readouterr() == ('', '')


def test_a_message_that_is_too_long_ends_its_connection_only(page, capfd):
    with page.visitor() as other:
        with pytest.raises(ConnectionClosed), page.visitor() as browser:
            browser.send(b'\x00' * (LARGEST_MESSAGE + 1))
            while True:
                browser.recv(timeout=TIMEOUT)
        page.tilt(other, 0.3)
    assert capfd.readouterr() == ('', '')


def test_only_so_many_browsers_look_at_the_same_time(page):
    with ExitStack() as stack:
        first = stack.enter_context(page.visitor())
        with pytest.raises(InvalidStatus, match='503'):
            for _ in range(VISITORS):
                stack.enter_context(page.visitor())
        page.tilt(first, 0.6)


def test_browsers_that_come_and_go_hold_nothing_up(page, capfd):
    page.view.scene.put('brick', [Shape('box', (1.0, 1.0, 1.0), (1.0, 0.0, 0.0, 1.0))])
    handshake = (f'GET / HTTP/1.1\r\nHost: {page.address}\r\nUpgrade: websocket\r\n'
                 'Connection: Upgrade\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n'
                 'Sec-WebSocket-Version: 13\r\n'
                 f'Sec-WebSocket-Protocol: viser-v{viser.__version__}\r\n\r\n').encode()
    for number in range(100):
        connection = socket.create_connection(('127.0.0.1', page.view.port), TIMEOUT)
        connection.sendall((handshake, handshake[:number], b'\xff' * number)[number % 3])
        page.view.scene.move('brick', Pose((0.0, 0.0, 1.0 + number), IDENTITY))
        if number % 2:  # an abrupt end: a reset
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack('ii', 1, 0))
        connection.close()
    with page.visitor() as browser:
        page.tilt(browser, 0.4)
    assert capfd.readouterr() == ('', '')


def test_an_event_is_set_by_its_own_loop_only(page):
    """Check where viser keeps the event of its buffer, and what its replacement is for."""
    assert isinstance(
        page.view.server._websock_server._broadcast_buffer.message_event, LoopEvent)
    event = LoopEvent()

    class Newcomer:
        """A waiter, in the middle of whose check another one comes."""

        def done(self):
            """Return that it is done, and add a waiter."""
            event._waiters.append(self)
            return True

    event._waiters.append(Newcomer())
    event.set()
    assert not event.is_set()
