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
The page in the browser: a scene of shapes that move, and a panel beside it. No ROS.

viser serves the page from its own threads. Calls from here leave the latest state with it and
never wait. What is done on the page comes back through a function that viser calls in one of
those threads.
"""

from collections.abc import Callable
import errno
import socket
from typing import ContextManager

import rich
from turtle_brick.view.commands import Command
from turtle_brick.view.web_guard import Door, EVERYWHERE, LoopEvent
from turtle_brick.view.web_panel import Panel
from turtle_brick.view.web_scene import Scene
import viser

TITLE = 'turtle_brick'

PORTS = 100
"""How many ports are tried, beginning with the wanted one."""


class AddressError(ValueError):
    """No page can be served on an address."""


def free_port(host: str, port: int) -> int:
    """
    Find a port to serve on.

    :param host: the name or address of the interface
    :param port: the wanted one; 0 for any
    :return: The wanted one, or the next one that is free.
    :raises AddressError: none of them is free, or there is no such interface
    """
    if not 0 <= port <= 65535:
        raise AddressError(f'port is {port}, but must be from 0 to 65535')
    try:
        family, kind, _, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
    except (OSError, UnicodeError) as error:
        raise AddressError(f'host is {host!r}, which is no address here: {error}') from None
    for candidate in range(port, min(port + PORTS, 65536)):
        with socket.socket(family, kind) as probe:
            # As the server itself does: a port that has just been given up counts as free.
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((address[0], candidate, *address[2:]))
                probe.listen()
                return probe.getsockname()[1]
            except OSError as error:
                if error.errno == errno.EADDRINUSE:
                    continue
                raise AddressError(f'host is {host!r} and port {candidate}, where this machine '
                                   f'cannot listen: {error.strerror}') from None
    raise AddressError(f'port is {port}, but it and the next {PORTS - 1} are taken')


def make_server(host: str, port: int, title: str) -> tuple[viser.ViserServer, Door]:
    """
    Make a server of pages, with a door that is still closed.

    :param host: the interface to serve on
    :param port: the wanted port; the next free one is taken
    :param title: of the page
    :raises AddressError: no page can be served there
    """
    rich.get_console().quiet = True  # viser talks to it
    door = Door(host)
    with door.guarding():
        server = viser.ViserServer(host, free_port(host, port), title, verbose=False)
    # There is no public way to the event that viser sets in the wrong thread.
    server._websock_server._broadcast_buffer.message_event = LoopEvent()
    return server, door


class WebView:
    """The page: a scene and a panel."""

    def __init__(self, host: str, port: int, on_command: Callable[[Command], None]) -> None:
        """
        Serve the page.

        :param host: the interface to serve on
        :param port: the wanted port; the next free one is taken
        :param on_command: called with everything that is to be done, on another thread
        :raises AddressError: the page cannot be served there
        """
        self.server, door = make_server(host, port, TITLE)
        self.port = self.server.get_port()
        """The port that it got."""
        shown = host if host not in EVERYWHERE else socket.gethostname()
        shown = f'[{shown}]' if ':' in shown else shown
        self.url = f'http://{shown}:{self.port}'
        """The address for a browser."""
        self.scene = Scene(self.server)
        self.panel = Panel(self.server, self.scene, on_command)
        door.is_open = True

    def together(self) -> ContextManager[None]:
        """Return a context whose changes the browsers see in one instant."""
        return self.server.atomic()

    def is_shown(self) -> bool:
        """Tell whether a browser shows the page."""
        return bool(self.server.get_clients())

    @property
    def changes(self) -> int:
        """How often something has changed on the page."""
        return self.scene.changes + self.panel.changes

    def close(self) -> None:
        """Close all connections and stop serving."""
        self.server.stop()
