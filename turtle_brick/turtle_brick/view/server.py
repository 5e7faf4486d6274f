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

"""
The server of the page, and who may talk to it. No ROS.

viser serves everybody. Whoever has the page open may place and drop bricks, but a foreign page in
the same browser may not: each request has to name this machine as its host, and a browser that
sends an origin has to have the page from there.
"""

import asyncio
from collections.abc import Callable
from ipaddress import ip_address
import socket
from typing import Any, TypeVar
from unittest.mock import patch
from urllib.parse import urlsplit

import rich
from turtle_brick.core.parameters import ParameterError
import viser
from websockets.asyncio import server as websockets_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

Result = TypeVar('Result')


class PageServer:
    """
    Serves a page, drawn with viser, to whoever uses the page's own address.

    viser has no option to refuse a request, nor passes any on to the websockets server that it
    makes: so `serve`, of websockets, is replaced by a guarded one while viser begins to serve.
    """

    def __init__(self, host: str, port: int, title: str) -> None:
        """
        Begin to serve an empty page.

        :param host: the interface to serve on
        :param port: the wanted port; the next free one is taken
        :param title: of the page
        :raises ParameterError: no page can be served there
        """
        serve = websockets_server.serve

        def guarded_serve(*arguments: Any, process_request: Callable, **options: Any) -> Any:
            def process(connection: ServerConnection, request: Request) -> Response | None:
                reason = refusal(host, request.headers.get_all('Host'),
                                 request.headers.get_all('Origin'))
                return connection.respond(403, f'{reason}\n') if reason else process_request(
                    connection, request)

            return serve(*arguments, process_request=process, **options)

        check(host, port)
        rich.get_console().quiet = True  # viser talks to it
        with patch.object(websockets_server, 'serve', guarded_serve):
            self.viser = viser.ViserServer(host, port, title, verbose=False)
        self.port = self.viser.get_port()
        """The port that it got."""
        name = socket.gethostname() if host in ('0.0.0.0', '::') else host
        self.url = f'http://{f"[{name}]" if ":" in name else name}:{self.port}'
        """The address for a browser."""

    def change(self, draw: Callable[[], Result]) -> Result:
        """
        Make changes that the browsers see in one instant, and return what the function returns.

        They are made in viser's own thread: from another one, a change may meet a browser that
        begins to wait for changes, and raise "deque mutated during iteration".
        """
        async def change() -> Result:
            with self.viser.atomic():
                return draw()

        return asyncio.run_coroutine_threadsafe(change(), self.viser.get_event_loop()).result()


def refusal(host: str, hosts: list[str], origins: list[str]) -> str:
    """
    Return why a request is refused, nothing if it is not.

    A foreign page has a foreign origin. With DNS rebinding, a foreign name that resolves to this
    machine, the origin equals the host; but then the host is that foreign name. So only our own
    names and numeric addresses are accepted.

    :param host: the interface on which the page is served
    :param hosts: the request's headers Host, of which there should be one
    :param origins: its headers Origin; a browser sends one with each WebSocket, other programs
        need not
    """
    if len(hosts) != 1 or not _is_ours(hosts[0], host):
        return f'The page is not at {", ".join(hosts)!r}.'
    for origin in origins:
        if origin.lower() != f'http://{hosts[0]}'.lower():
            return f'The page is at {hosts[0]!r}, and not for pages from {origin!r}.'
    return ''


def _is_ours(address: str, host: str) -> bool:
    """Return whether an address, with or without a port, is of the machine that serves a host."""
    machine = socket.gethostname().lower()
    try:
        name = urlsplit(f'//{address}').hostname or ''
        return name in ('localhost', host.lower(), machine, f'{machine}.local') or bool(
            ip_address(name))
    except ValueError:
        return False


def check(host: str, port: int) -> None:
    """
    Check that a page can be served somewhere: viser itself would go on to other ports for long.

    :param host: the name or address of the interface
    :param port: the wanted one
    :raises ParameterError: there is no such interface or port
    """
    if not 0 <= port <= 65535:
        raise ParameterError(f'port is {port}, but must be from 0 to 65535')
    try:
        family, _, _, _, address = socket.getaddrinfo(
            host, 0, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
        socket.create_server(address, family=family).close()
    except (OSError, UnicodeError) as error:
        raise ParameterError(
            f'host is {host!r}, but no page can be served there: {error}') from None
