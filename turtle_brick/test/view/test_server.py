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

import http.client
from importlib.util import find_spec
import socket
import struct

import pytest
from turtle_brick.core.parameters import ParameterError

# Not skipped as a whole, which launch_testing's plugin would take for all files beside it as well.
if find_spec('viser') is not None:
    from turtle_brick.view.server import free_port, PageServer, refusal
    import viser
    from websockets.sync.client import connect
    import zstandard

pytestmark = pytest.mark.skipif(
    find_spec('viser') is None,
    reason='viser, which draws the page, is not installed here')

HOST = '127.0.0.1'
HERE = ('localhost:8080', '127.0.0.1:8080', '[::1]:8080', '192.168.1.7:80', 'LocalHost')
ELSEWHERE = ('evil.example', 'evil.example:8080', 'localhost.evil.example', '', ':8080',
             'me@evil.example', '[localhost]:8080x')


@pytest.fixture(scope='module')
def server():
    """Serve an empty page."""
    server = PageServer(HOST, 0, 'test')
    yield server
    server.close()


def test_only_the_pages_of_this_machine_are_let_in():
    for host in HERE:
        assert refusal(HOST, [host], []) == refusal(HOST, [host], [f'http://{host}']) == ''
        for other in {*HERE, *ELSEWHERE} - {host}:
            assert refusal(HOST, [host], [f'http://{other}']), (host, other)
        assert refusal(HOST, [host], [f'http://{host}', 'null'])
    for host in ELSEWHERE:
        assert refusal(HOST, [host], [f'http://{host}']), 'a name that has been made to lead here'
    assert refusal(HOST, [], []) and refusal(HOST, ['localhost', 'localhost'], [])


def test_the_names_by_which_it_is_served_are_its_own():
    name = socket.gethostname().lower()
    for host in ('0.0.0.0', '::', ''):
        assert not refusal(host, [f'{name}:8080'], [f'http://{name}:8080'])
        assert not refusal(host, [f'{name}.local'], [])
        assert refusal(host, ['evil.example'], [])
    assert not refusal('Robot.Lab', ['robot.lab:8080'], [])
    assert refusal(HOST, ['robot.lab:8080'], [])


@pytest.mark.parametrize(('headers', 'status'), [
    ({}, 200), ({'Host': 'evil.example'}, 403), ({'Origin': 'http://evil.example'}, 403)])
@pytest.mark.parametrize('upgrade', [False, True])
def test_a_foreign_page_can_do_nothing(server, headers, status, upgrade):
    connection = http.client.HTTPConnection(HOST, server.port, timeout=20.0)
    if upgrade:
        headers = {'Upgrade': 'websocket', 'Connection': 'Upgrade', 'Sec-WebSocket-Version': '13',
                   'Sec-WebSocket-Key': 'AAAAAAAAAAAAAAAAAAAAAA==', **headers,
                   'Sec-WebSocket-Protocol': f'viser-v{viser.__version__}'}
    connection.request('GET', '/', headers=headers)
    answer = connection.getresponse()
    assert answer.status == (101 if upgrade and status == 200 else status)
    if status == 403:
        assert answer.read().startswith(b'The page is')
    connection.close()


def test_a_port_that_is_taken_is_passed_over():
    with socket.create_server((HOST, 0)) as taken:
        port = taken.getsockname()[1]
        assert free_port(HOST, port) > port
    assert free_port(HOST, port) == port
    assert free_port(HOST, 0) > 0


def test_an_address_that_cannot_be_is_named():
    for host, port, named in ((HOST, 65536, 'port is 65536'), ('x' * 64, 8080, 'x' * 64),
                              ('192.0.2.1', 8080, "host is '192.0.2.1'")):
        with pytest.raises(ParameterError, match=named):
            free_port(host, port)


def test_browsers_that_come_and_go_or_read_nothing_hold_nothing_up(server, capfd):
    address = {'uri': f'ws://{HOST}:{server.port}', 'origin': server.url, 'max_size': None,
               'subprotocols': [f'viser-v{viser.__version__}']}

    def draw():
        text.content = f'step {step}'
        return step

    text = server.change(lambda: server.viser.gui.add_html(''))
    step = 0
    with connect(**address, close_timeout=0.1) as deaf:
        deaf.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        for step in range(2000):
            assert server.change(draw) == step
            if step % 100 == 0:
                # An abrupt end: a reset, as of a machine that has been switched off.
                gone = connect(**address, close_timeout=0.1)
                gone.socket.setsockopt(
                    socket.SOL_SOCKET, socket.SO_LINGER, struct.pack('ii', 1, 0))
                gone.socket.close()
        with connect(**address) as late:
            heard = b''
            while b'step 1999' not in heard:
                raw = late.recv(timeout=20.0)
                heard = zstandard.decompress(raw[16:16 + int.from_bytes(raw[8:16], 'little')])
                assert b'step 1998' not in heard, 'only the latest state is left'
    with pytest.raises(ZeroDivisionError):
        server.change(lambda: 1 / 0)
    assert capfd.readouterr() == ('', '')
