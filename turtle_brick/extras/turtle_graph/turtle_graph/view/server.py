# SPDX-License-Identifier: Apache-2.0

"""The web server for the page. This module does not depend on ROS."""

import asyncio
from collections.abc import Callable
import socket
from threading import Thread
from typing import TypeVar

import rich
import viser

Result = TypeVar('Result')


class PageServer:
    """Serves a viser page. Anyone who can connect to the port can use the page."""

    def __init__(self, host: str, port: int, title: str) -> None:
        """
        Serve an empty page.

        :param host: name or address of the network interface
        :param port: preferred port. If this port is in use, the server uses the next free port.
        :param title: heading of the page and of the browser tab
        :raises ValueError: if the host or the port cannot be used
        """
        check_address(host, port)
        rich.get_console().quiet = True  # This hides messages from viser.
        self.viser = viser.ViserServer(host, port, title, verbose=False)
        self.port = self.viser.get_port()
        """Port of the page."""
        name = socket.gethostname() if host in ('0.0.0.0', '::') else host
        if ':' in name:
            name = f'[{name}]'
        self.url = f'http://{name}:{self.port}'
        """Address of the page."""

    def stop(self) -> None:
        """
        Stop the server without waiting for the browsers to disconnect.

        viser.stop() waits up to 6 s for idle browser connections, so it runs in another thread.
        """
        Thread(target=self.viser.stop, daemon=True).start()

    def update(self, function: Callable[[], Result]) -> Result:
        """
        Call a function that changes the page, and send all changes to the browsers together.

        The function runs in viser's thread. If another thread changed the page while a browser
        was connecting, viser could raise "deque mutated during iteration".
        """
        async def run() -> Result:
            with self.viser.atomic():
                return function()

        return asyncio.run_coroutine_threadsafe(run(), self.viser.get_event_loop()).result()


def check_address(host: str, port: int) -> None:
    """Raise ValueError for an unusable address. Without this check, viser would try 1000 ports."""
    if not 0 <= port <= 65535:
        raise ValueError(f'port is {port}, but must be from 0 to 65535')
    try:
        family, _, _, _, address = socket.getaddrinfo(
            host, 0, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
        socket.create_server(address, family=family).close()
    except (OSError, UnicodeError) as error:
        raise ValueError(
            f'host is {host!r}, but a page cannot be served there: {error}') from None
