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
The page in the browser: a scene of shapes that move, and a panel to act and to read. No ROS.

It is made with viser, which serves the page from threads of its own. Calls from here only leave
the latest state with it and never wait; what is done on the page comes back through a function
that is called on one of those threads.
"""

from collections.abc import Callable
from collections.abc import Sequence
import errno
from html import escape
from math import inf
from math import pi
import socket
from time import monotonic
from typing import Any
from typing import ContextManager
from typing import NamedTuple
from typing import TypedDict
from urllib.parse import quote

import numpy
import rich
from turtle_brick.geometry import Pose
from turtle_brick.geometry import Quaternion
from turtle_brick.geometry import Vector
from turtle_brick.view.urdf_scene import Shape
from turtle_brick.view.web_guard import BUTTONS
from turtle_brick.view.web_guard import Door
from turtle_brick.view.web_guard import EVERYWHERE
from turtle_brick.view.web_guard import LoopEvent
import viser

TITLE = 'turtle_brick'

PORTS = 100
"""How many ports are tried, from the wanted one on."""

CAMERA = (5.54, -11.5, 8.2)
"""Where one looks from at first (m in the world): the whole arena is in sight, with what is said
of a brick in its corners,"""

LOOK_AT = (5.54, 5.5, 3.2)
"""... and the air above it, and this is what one looks at."""

FIELD_OF_VIEW = 0.82
"""Vertical (rad)."""

GROUND = (229, 232, 226)
LINES = (196, 201, 194)
ZENITH = (164, 196, 232)
HORIZON = (240, 244, 248)
GREEN = (46, 125, 70)
"""Colors (0 to 255) of the ground, the lines on it (one per metre), the sky and the controls."""

LAMP = (-4.0, -12.0, 7.0)
"""Where a lamp stands that lights up what faces the viewer (m); the sun is overhead."""

HANDS_OFF = 1.0
"""How long (s) a slider is left alone after somebody has moved it."""

FAR = 200.0
"""Farthest point of the ground (m) to which a click can send the robot."""


class Place(NamedTuple):
    """Put the brick at a point of the world (m)."""

    x: float
    y: float
    z: float


class Drop(NamedTuple):
    """Let the brick fall."""


class DropAtRandom(NamedTuple):
    """Put the brick anywhere, and let it fall."""


class SetTilt(NamedTuple):
    """Tilt the platform by an angle (rad)."""

    angle: float


class SendTo(NamedTuple):
    """Send the robot to a point of the ground (m in the world)."""

    x: float
    y: float


Command = Place | Drop | DropAtRandom | SetTilt | SendTo


class AddressError(ValueError):
    """An address on which no page can be served."""


def free_port(host: str, port: int) -> int:
    """
    Find a port to serve on.

    :param host: the name or address of the interface
    :param port: the wanted one; 0 for any
    :return: The wanted one, or the next one that is free.
    :raises AddressError: none of them can be had
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
            # as the server itself does, so that a port that has just been left counts as free
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
    Make a server of pages, and its door, which is still closed.

    :param host: the interface to serve on
    :param port: the wanted port; the next free one is taken
    :param title: what stands over the page
    :raises AddressError: no page can be served there
    """
    rich.get_console().quiet = True  # viser talks to it
    door = Door(host)
    with door.guarding():
        server = viser.ViserServer(host, free_port(host, port), title, verbose=False)
    # A private name, as there is no other way to the event that it sets in the wrong thread.
    server._websock_server._broadcast_buffer.message_event = LoopEvent()
    return server, door


class WebView:
    """The page: what is seen, what can be read and what can be done."""

    def __init__(self, host: str, port: int, on_command: Callable[[Command], None]) -> None:
        """
        Serve the page.

        :param host: the interface to serve on
        :param port: the wanted port; the next free one is taken
        :param on_command: called with everything that is to be done, on another thread
        :raises AddressError: the page cannot be served there
        """
        self.server, door = make_server(host, port, TITLE)
        shown = host if host not in EVERYWHERE else socket.gethostname()
        shown = f'[{shown}]' if ':' in shown else shown
        self.port = self.server.get_port()
        self.url = f'http://{shown}:{self.port}'
        self.scene = Scene(self.server)
        self.panel = Panel(self.server, on_command)
        door.is_open = True

    def together(self) -> ContextManager[None]:
        """Return a context whose changes browsers see at once, not one after the other."""
        return self.server.atomic()

    @property
    def changes(self) -> int:
        """How often something has changed on the page."""
        return self.scene.changes + self.panel.changes

    def close(self) -> None:
        """Let go of every browser, and serve no more."""
        self.server.stop()


class Thing:
    """Shapes that move together."""

    def __init__(self, node: Any, shapes: Sequence[Shape], axes: bool) -> None:
        """Know what the browsers have been told of it."""
        self.node = node
        self.shapes = tuple(shapes)
        self.axes = axes
        self.pose: Pose | None = None


class Where(TypedDict):
    """Where a shape is, as viser takes it."""

    position: Vector
    wxyz: Quaternion


class Looks(Where):
    """... and what a solid looks like."""

    opacity: float | None
    color: tuple[int, int, int]
    scale: Vector


class Scene:
    """What is seen: things with a name, each somewhere in the world or nowhere."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Begin with the empty ground."""
        self._server = server
        self._things: dict[str, Thing] = {}
        self.changes = 0
        server.initial_camera.position = CAMERA
        server.initial_camera.look_at = LOOK_AT
        server.initial_camera.fov = FIELD_OF_VIEW
        server.scene.add_grid(
            '/ground', infinite_grid=True, cell_size=1.0, section_size=1.0, cell_color=LINES,
            section_color=LINES, plane_color=GROUND, plane_opacity=1.0, shadow_opacity=0.45,
            fade_distance=60.0, position=(0.0, 0.0, -1e-3))
        server.scene.set_background_image(sky(), format='png')
        server.scene.add_light_directional(
            '/lamp', color=(255, 250, 240), intensity=1.1, position=LAMP)

    def put(self, name: str, shapes: Sequence[Shape], axes: bool = False) -> None:
        """
        Make or change a thing. It is nowhere until it is moved somewhere.

        :param name: tells it from others
        :param shapes: what it looks like, in its own frame
        :param axes: whether its frame is drawn, with its name
        """
        thing = self._things.get(name)
        if thing is not None and thing.shapes == tuple(shapes) and thing.axes == axes:
            return
        self.changes += 1
        pose = thing.pose if thing is not None else None
        self.remove(name)
        # One step in viser's tree, whatever a name holds: no thing is a part of another.
        path = f'/things/{quote(name, safe="")}'
        node = self._server.scene.add_frame(
            path, show_axes=axes, axes_length=0.6, axes_radius=0.018, visible=False)
        if axes:
            self._server.scene.add_label(
                f'{path}/name', name.rpartition('/')[2], font_screen_scale=1.2)
        for number, shape in enumerate(shapes):
            self._add(f'{path}/{number}', shape)
        self._things[name] = Thing(node, shapes, axes)
        self.move(name, pose)

    def move(self, name: str, pose: Pose | None) -> None:
        """Move a thing to a pose in the world; None hides it."""
        thing = self._things[name]
        if pose == thing.pose:
            return
        self.changes += 1
        if pose is not None:
            thing.node.position = pose.position
            x, y, z, w = pose.orientation
            thing.node.wxyz = (w, x, y, z)
        if (pose is None) != (thing.pose is None):
            thing.node.visible = pose is not None
        thing.pose = pose

    def remove(self, name: str) -> None:
        """Remove a thing, if it is there."""
        thing = self._things.pop(name, None)
        if thing is not None:
            self.changes += 1
            thing.node.remove()

    def names(self) -> list[str]:
        """Return the names of all things."""
        return list(self._things)

    def _add(self, path: str, shape: Shape) -> None:
        """Add a shape to a thing."""
        scene = self._server.scene
        x, y, z, w = shape.pose.orientation
        where: Where = {'position': shape.pose.position, 'wxyz': (w, x, y, z)}
        red, green, blue = (round(255 * min(max(part, 0.0), 1.0)) for part in shape.color[:3])
        color = (red, green, blue)
        looks: Looks = {
            **where, 'opacity': max(shape.color[3], 0.0) if shape.color[3] < 1.0 else None,
            'color': color, 'scale': shape.size}
        if shape.kind == 'box':
            scene.add_box(path, **looks)
        elif shape.kind == 'cylinder':
            scene.add_cylinder(path, radius=0.5, height=1.0, radial_segments=48, **looks)
        elif shape.kind == 'sphere':
            scene.add_icosphere(path, radius=0.5, **looks)
        elif shape.kind == 'text':
            scene.add_label(path, shape.text, font_size_mode='scene', anchor='center-center',
                            font_scene_height=shape.size[2], **where)
        elif shape.kind == 'lines':
            ends = numpy.array(shape.points, dtype=numpy.float32).reshape((-1, 2, 3))
            scene.add_line_segments(path, ends, color, thickness=shape.size[0], **where)
        else:
            raise ValueError(f'there is no shape of the kind {shape.kind!r}')


class Panel:
    """What can be read and done."""

    def __init__(self, server: viser.ViserServer, on_command: Callable[[Command], None]) -> None:
        """
        Lay it out.

        :param server: of the page
        :param on_command: called with everything that is to be done, on another thread
        """
        self._dragged = -inf
        self.changes = 0
        gui = server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=GREEN)
        gui.main_panel.dock_right()
        with gui.add_folder('Brick'):
            self._brick = gui.add_html('')
            self._place = gui.add_vector3('place (m)', (0.0, 0.0, 0.0), step=0.1)
            buttons = gui.add_button_group('', BUTTONS)
            self._answer = gui.add_html('')
        with gui.add_folder('Robot'):
            self._account = gui.add_html('')
            limit = round(pi / 2.0, 2)
            slider = gui.add_slider('tilt (rad)', -limit, limit, 0.01, 0.0)
            send = gui.add_checkbox('go where I click', True)
        with gui.add_folder('Rates'):
            self._rates = gui.add_html('')
        self._frames = gui.add_checkbox('frames', False)
        self._slider = slider

        @buttons.on_click
        def _(event: viser.GuiEvent) -> None:
            if event.target.value == 'Place':
                on_command(Place(*self._place.value))
            elif event.target.value == 'Drop':
                on_command(Drop())
            elif event.target.value == 'Drop at random':
                on_command(DropAtRandom())

        @slider.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:  # else it was moved from here
                self._dragged = monotonic()
                on_command(SetTilt(min(max(slider.value, -limit), limit)))

        @server.scene.on_click()
        def _(event: viser.SceneClickEvent) -> None:
            point = ground_under(event.ray_origin, event.ray_direction)
            if send.value and point is not None:
                on_command(SendTo(*point))

    @property
    def frames(self) -> bool:
        """Whether frames are to be seen."""
        return self._frames.value

    def suggest_place(self, position: Vector) -> None:
        """Fill in a place for the brick (m)."""
        x, y, z = (round(part, 2) for part in position)
        self._place.value = (x, y, z)  # type: ignore[misc]

    def show_brick(self, text: str, color: tuple[float, ...] | None) -> None:
        """Say what the brick does, and in which color."""
        mark = ''
        if color is not None:
            rgb = ','.join(str(round(255 * part)) for part in color[:3])
            mark = f'<span style="color:rgb({rgb})">&#9632;</span> '
        self._show(self._brick, f'{mark}{escape(text)}', 'brick')

    def show_account(self, text: str, alarm: bool) -> None:
        """Say what the robot is up to."""
        self._show(self._account, _colored(escape(text), alarm), 'account')

    def show_answer(self, text: str, good: bool) -> None:
        """Say what came of the last thing that was done."""
        self._show(self._answer, _colored(escape(text), not good), 'answer')

    def show_rates(self, rates: Sequence[tuple[str, float | None]]) -> None:
        """Say how often each of some things comes (Hz), None for one that does not."""
        rows = ''.join(
            f'<tr><td style="width:11em">{escape(name)}</td><td style="text-align:right">'
            f'{"no messages" if rate is None else f"{rate:.1f} Hz"}</td></tr>'
            for name, rate in rates)
        self._show(self._rates, f'<table>{rows}</table>', 'rates')

    def show_tilt(self, angle: float) -> None:
        """Move the slider to where the platform is sent (rad), unless somebody is at it."""
        if monotonic() - self._dragged < HANDS_OFF:
            return
        limit = self._slider.max
        shown = round(min(max(angle, -limit), limit), 2)
        if shown != self._slider.value:
            self.changes += 1
            self._slider.value = shown  # type: ignore[misc]

    def _show(self, element: Any, content: str, name: str) -> None:
        """Change a text, if it is another one."""
        content = (f'<div data-turtle-brick="{name}" style="padding:0.2em 1em;font-size:0.9em">'
                   f'{content}</div>')
        if content != element.content:
            self.changes += 1
            element.content = content


def _colored(text: str, alarm: bool) -> str:
    """Return a text in red if it is an alarm."""
    return f'<span style="color:#c92a2a;font-weight:600">{text}</span>' if alarm else text


def sky() -> numpy.ndarray:
    """Return a picture of a clear sky, uint8 of shape (height, width, 3)."""
    above_horizon = numpy.linspace(1.0, -1.4, 256).clip(0.0)[:, None, None]
    colors = HORIZON + above_horizon * numpy.subtract(ZENITH, HORIZON)
    return numpy.broadcast_to(colors, (256, 16, 3)).astype(numpy.uint8)


def ground_under(origin: Vector, direction: Vector) -> tuple[float, float] | None:
    """Return where a ray (m in the world) meets the ground, None where it is too far away."""
    if direction[2] >= 0.0 or origin[2] <= 0.0:
        return None
    length = -origin[2] / direction[2]
    x, y = origin[0] + length * direction[0], origin[1] + length * direction[1]
    return (x, y) if abs(x) <= FAR and abs(y) <= FAR else None
