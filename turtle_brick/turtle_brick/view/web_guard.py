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
Who may talk to the server of the page, and what a browser may send to it. No ROS.

viser serves everybody, obeys every message and prints tracebacks. Whoever has the page open may
place and drop bricks. A foreign page in the same browser may not, and nobody may do more than the
page itself can. So every request and every message is checked here first.
"""

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from ipaddress import ip_address
import logging
import re
import socket
from typing import Any

import msgspec
from websockets.asyncio import server as websockets_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

EVERYWHERE = ('0.0.0.0', '::', '')
"""Hosts that stand for all interfaces."""

VISITORS = 32
"""How many browsers may show the page at the same time."""

LARGEST_MESSAGE = 8 * 2**20
"""The largest message (bytes) that a browser may send: a rendered picture, for a video."""

LARGEST_NUMBER = 1e9
"""The largest number in a message."""

BRICK_BUTTONS = ('Place', 'Drop', 'Drop at random')
VIEW_BUTTONS = ('Near', 'From above')
"""The texts of the buttons, the only ones that a browser may send."""

Check = Callable[[Any], bool]


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and abs(value) <= LARGEST_NUMBER


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _are_numbers(count: int) -> Check:
    return lambda value: (
        isinstance(value, list) and len(value) == count and all(map(_is_number, value)))


def _is_value(value: Any) -> bool:
    """Return whether a control of the page can have a value."""
    return (isinstance(value, bool) or _is_number(value) or _are_numbers(3)(value)
            or _is_text(value) and value in BRICK_BUTTONS + VIEW_BUTTONS)


FORMS: dict[str, dict[str, Check]] = {
    'ViewerCameraMessage': {
        'wxyz': _are_numbers(4), 'position': _are_numbers(3), 'look_at': _are_numbers(3),
        'up_direction': _are_numbers(3), 'fov': _is_number, 'near': _is_number, 'far': _is_number,
        'image_height': _is_number, 'image_width': _is_number},
    'ScenePointerMessage': {
        'event_type': lambda value: value == 'click', 'ray_origin': _are_numbers(3),
        'ray_direction': _are_numbers(3),
        'screen_pos': lambda value: (
            isinstance(value, list) and len(value) == 1 and _are_numbers(2)(value[0])),
        'modifier': lambda value: value is None or _is_text(value)},
    # Of what a control has, a browser may change its value, and nothing else.
    'GuiUpdateMessage': {
        'uuid': _is_text,
        'updates': lambda value: (
            isinstance(value, dict) and list(value) == ['value'] and _is_value(value['value']))},
    'GetRenderResponseMessage': {
        'payload': lambda value: isinstance(value, bytes), 'render_uuid': _is_text}}
"""
The messages of viser that the page sends, with a check of each field.

msgspec 0.22 can't check them: in a union of bounded numbers, texts and tuples it reads the bounds
of the numbers from the wrong place.
"""


def is_admissible(raw: Any) -> bool:
    """Return whether a message is one that the page sends."""
    if not isinstance(raw, bytes):
        return False
    try:
        message = msgspec.msgpack.decode(raw)
    except (ValueError, TypeError, RecursionError):
        return False
    if not isinstance(message, dict):
        return False
    kind = message.pop('type', None)
    form = FORMS.get(kind) if isinstance(kind, str) else None
    return (form is not None and message.keys() == form.keys()
            and all(check(message[name]) for name, check in form.items()))


class Door:
    """Guards the server of the page: it lets in who uses the page's own address."""

    def __init__(self, host: str) -> None:
        """
        Begin closed.

        :param host: the interface on which the page is served
        """
        self.is_open = False
        """Whether anybody is let in."""
        self._names = {'localhost', host.lower()}
        if host in EVERYWHERE:
            name = socket.gethostname().lower()
            self._names |= {name, f'{name}.local'}

    def refusal(self, hosts: list[str], origins: list[str]) -> str | None:
        """
        Return why a request is refused, None if it is not.

        A foreign page has a foreign origin. With DNS rebinding, a foreign name that resolves to
        this machine, the origin equals the host; but then the host is that foreign name. So only
        our own names and numeric addresses are accepted.

        :param hosts: its headers Host, of which there should be one
        :param origins: its headers Origin; a browser sends one with each WebSocket, other programs
            need not
        """
        host = hosts[0].lower() if len(hosts) == 1 else ''
        if not self._is_ours(host):
            return f'The page is not at {host[:100]!r}.'
        for origin in origins:
            if origin.lower() not in (f'http://{host}', f'https://{host}'):
                return f'The page is at {host!r}, and not for pages from {origin[:100]!r}.'
        return None

    def _is_ours(self, host: str) -> bool:
        """Return whether a host, with or without a port, is this machine."""
        found = re.fullmatch(r'(?:\[([^\]]*)\]|([^:@]*))(?::\d*)?', host)
        name = found and (found[1] or found[2])
        if not name:
            return False
        if name in self._names:
            return True
        try:
            ip_address(name)
        except ValueError:
            return False
        return True

    @contextmanager
    def guarding(self) -> Iterator[None]:
        """
        Return a context in which a viser.ViserServer gets this door.

        viser passes no options on to the websockets server that it makes. So `serve` is replaced
        while viser calls it. All that it is given is public.
        """
        serve = websockets_server.serve

        def guarded(*arguments: Any, process_request: Callable, **options: Any) -> Any:
            def process(connection: ServerConnection, request: Request) -> Response | None:
                response = self._turn_away(connection, request) or process_request(
                    connection, request)
                if response is not None:
                    # No other page may embed this one and trick its visitors into a click.
                    response.headers['Content-Security-Policy'] = "frame-ancestors 'self'"
                return response

            # Errors in a browser's task are nothing for the terminal.
            asyncio.get_running_loop().set_exception_handler(lambda loop, context: None)
            options.update(max_size=LARGEST_MESSAGE, logger=_silent_logger())
            return serve(*arguments, process_request=process,
                         create_connection=GuardedConnection, **options)

        websockets_server.serve = guarded  # type: ignore[assignment,misc]
        try:
            yield
        finally:
            websockets_server.serve = serve  # type: ignore[misc]

    def _turn_away(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the response to a refused request, None if it is let in."""
        reason = self.refusal(
            request.headers.get_all('Host'), request.headers.get_all('Origin'))
        if reason is not None:
            return connection.respond(403, f'{reason}\n')
        if not self.is_open or len(connection.server.connections) >= VISITORS:
            return connection.respond(503, 'Not now: please come again.\n')
        return None


class GuardedConnection(ServerConnection):
    """A connection that ignores messages that are not admissible."""

    async def recv(self, decode: bool | None = None) -> Any:
        """Return the next admissible message."""
        while not is_admissible(message := await super().recv(decode)):
            pass
        return message


class LoopEvent(asyncio.Event):
    """
    An event that ignores `set` outside its loop.

    viser's buffer sets its event in the thread that changes something. asyncio does not allow
    this: if a browser begins to wait in that moment, it raises "deque mutated during iteration".
    Right afterwards viser sets it again in the loop, and this wakes the waiting browsers.
    """

    def set(self) -> None:  # noqa: A003
        """Wake all who wait, if called in the loop."""
        try:
            asyncio.get_running_loop()
        except RuntimeError:
            return
        super().set()


def _silent_logger() -> logging.Logger:
    """Return a logger without output."""
    logger = logging.getLogger(__name__)
    logger.propagate = False
    logger.disabled = True
    return logger
