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

"""The panel of the page: what can be read and done beside the scene."""

from collections.abc import Callable, Sequence
from html import escape
from math import ceil, inf, pi
from time import monotonic
from typing import Any, NamedTuple

import numpy
from turtle_brick.arena import BRICK_COLORS
from turtle_brick.core.geometry import Color, Vector
from turtle_brick.core.time_steps import NANOSECONDS
from turtle_brick.view.camera import ABOVE, ground_under, NEAR
from turtle_brick.view.measures import Curves
from turtle_brick.view.scene import Scene
import viser

GREEN = (46, 125, 70)
"""Color (0 to 255) of the controls."""

STEEPEST = round(pi / 2.0, 2)
"""The end of the slider (rad)."""

HANDS_OFF = 1.0
"""How long (s) the slider is left alone after somebody has moved it."""

CURVES = (('height (m)', '#e8590c'), ('distance (m)', '#1971c2'), ('speed (m/s)', '#2f9e44'))
"""What is plotted of brick and robot, and in which color."""

LEAST_TOP = 10.0
"""The plot reaches from 0 to this, or to the next multiple of it."""

VIEWS = {'Near': NEAR, 'From above': ABOVE}


class Orders(NamedTuple):
    """What the buttons do. viser calls it in a thread of its own."""

    place: Callable[[float, float, float], None]
    """Place the brick at a point of the world (m)."""
    drop_from: Callable[[float, float, float], None]
    """Place it there, and drop it."""
    drop: Callable[[], None]
    """Drop the brick."""
    drop_at_random: Callable[[], None]
    """Place the brick at random, and drop it."""
    tilt: Callable[[float], None]
    """Tilt the platform by an angle (rad)."""
    go: Callable[[float, float], None]
    """Send the robot to a point of the ground (m in the world)."""
    refuse: Callable[[str], None]
    """Say why something is not done."""


class Panel:
    """What can be read and done."""

    def __init__(self, server: viser.ViserServer, scene: Scene, orders: Orders) -> None:
        """
        Lay it out.

        :param server: of the page
        :param scene: of the page, which is clicked on
        :param orders: what is called when something is to be done
        """
        gui = server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=GREEN)
        gui.main_panel.dock_right()
        with gui.add_folder('Brick') as self._arena_part:
            self._brick = gui.add_html('')
            swatches = ' '.join(
                _swatch(phase.value, color) for phase, color in BRICK_COLORS.items())
            gui.add_html(_block('legend', f'<small style="color:#868e96">{swatches}</small>'))
            with gui.add_form(None) as form:
                # Any: mypy takes the value of an input for read-only.
                self._place: Any = gui.add_text('x, y, z (m)', '')
            buttons = gui.add_button_group('', ('Place', 'Drop', 'Drop at random'))
        self._answer = gui.add_html('')
        with gui.add_folder('Robot') as self._robot_part:
            self._account = gui.add_html('')
            self._tilt: Any = gui.add_slider('tilt (rad)', -STEEPEST, STEEPEST, 0.01, 0.0)
            self._beyond = gui.add_html('', visible=False)
            self._goes = gui.add_checkbox('click the ground to drive', True)
        with gui.add_folder('View'):
            cameras = gui.add_button_group('', tuple(VIEWS))
            self._frames = gui.add_checkbox('frames', False)
        with gui.add_folder(
                f'Last {Curves.LENGTH * Curves.PERIOD // NANOSECONDS} s') as self._plot_part:
            series = (viser.uplot.Series(), *(
                viser.uplot.Series(label=label, stroke=color, width=2) for label, color in CURVES))
            self._plotted: Sequence[Sequence[float | None]] = Curves(len(CURVES)).columns()
            self._plot = gui.add_uplot(
                _arrays(self._plotted), series, scales=_scales(LEAST_TOP),
                legend={'live': False}, height=140, padding=(8, 16, 0, 0))
        with gui.add_folder('Rates'):
            self._rates = gui.add_html('')
        self._dragged = -inf
        self._suggested: Vector | None = None
        self._orders = orders

        @form.on_submit
        async def _(_: viser.GuiEvent) -> None:
            self._on_button('Place')

        @buttons.on_click
        async def _(event: viser.GuiEvent) -> None:
            self._on_button(event.target.value)

        @self._tilt.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:  # else it was moved from here
                self._dragged = monotonic()
                self._on_tilt(self._tilt.value)

        @cameras.on_click
        async def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                scene.look(event.client, VIEWS[event.target.value])

        @server.scene.on_click()
        def _(event: viser.SceneClickEvent) -> None:
            point = ground_under(event.ray_origin, event.ray_direction)
            if self._goes.visible and self._goes.value and point is not None:
                orders.go(*point)

    @property
    def frames(self) -> bool:
        """Whether frames are to be shown."""
        return self._frames.value

    def suggest_place(self, position: Vector) -> None:
        """Fill in a place for the brick (m), unless somebody has written another one."""
        place = _to_millimeters(position)
        if place != self._suggested:
            if not self._is_edited():
                self._place.value = '{:.10g}, {:.10g}, {:.10g}'.format(*place)
            self._suggested = place

    def show_parts(self, arena: bool, robot: bool, catcher: bool) -> None:
        """Show the parts of those nodes that are there."""
        self._arena_part.visible = arena
        self._robot_part.visible = robot or catcher
        self._account.visible = catcher
        self._tilt.visible = self._goes.visible = robot
        self._plot_part.visible = arena or robot

    def show_brick(self, text: str, color: Color | None) -> None:
        """Show what the brick does, and in which color."""
        self._brick.content = _block('brick', _swatch(text, color) if color else escape(text))

    def show_account(self, text: str, alarm: bool) -> None:
        """Show what the robot does about the brick."""
        self._account.content = _block('account', _colored(text, alarm))

    def show_answer(self, text: str, good: bool) -> None:
        """Show the result of the last order."""
        self._answer.content = _block('answer', _colored(text, not good))

    def show_rates(self, rates: Sequence[tuple[str, float | None]]) -> None:
        """Show how often (Hz) each of some things comes, None for one that does not."""
        rows = ''.join(
            f'<tr><td style="width:11em">{escape(name)}</td><td style="text-align:right">'
            f'{"no messages" if rate is None else f"{rate:.1f} Hz"}</td></tr>'
            for name, rate in rates)
        self._rates.content = _block('rates', f'<table>{rows}</table>')

    def show_tilt(self, angle: float) -> None:
        """Move the slider to the angle (rad) of the platform, unless somebody is at it."""
        shown = round(min(max(angle, -STEEPEST), STEEPEST), 2)
        if monotonic() - self._dragged >= HANDS_OFF and shown != self._tilt.value:
            self._tilt.value = shown
        self._beyond.visible = abs(angle) > STEEPEST
        self._beyond.content = _block(
            'beyond', f'The tilt is {angle:g} rad, beyond the slider')

    def show_curves(self, columns: Sequence[Sequence[float | None]]) -> None:
        """Plot what there was: the times (s), then the values of each of CURVES."""
        if columns == self._plotted:
            return
        self._plotted = columns
        highest = max((value for curve in columns[1:] for value in curve if value is not None),
                      default=0.0)
        # Viser's chart fits its scale to new times, but not to new values.
        scales = _scales(LEAST_TOP * max(1, ceil(highest / LEAST_TOP)))
        if scales != self._plot.scales:
            self._plot.scales = scales
        self._plot.data = _arrays(columns)

    def _is_edited(self) -> bool:
        """Tell whether somebody has written another place than the suggested one."""
        try:
            return _to_millimeters(place_of(self._place.value)) != self._suggested
        except ValueError:
            return self._suggested is not None

    def _on_button(self, name: str) -> None:
        """Do what a button says; "Drop" places the brick first where is written, if new."""
        if name == 'Drop at random':
            self._orders.drop_at_random()
        elif name == 'Drop' and not self._is_edited():
            self._orders.drop()
        else:
            text = self._place.value
            # Sent back, because viser may lose what is written in the last 50 ms before Enter.
            self._place.value = ''
            self._place.value = text
            try:
                place = place_of(text)
            except ValueError as error:
                self._orders.refuse(str(error))
            else:
                (self._orders.place if name == 'Place' else self._orders.drop_from)(*place)

    def _on_tilt(self, angle: float) -> None:
        """Tilt the platform by an angle (rad), which may be written beside the slider."""
        if abs(angle) <= STEEPEST:
            self._orders.tilt(angle)
        else:
            self._orders.refuse(f'tilt: {angle:g} rad is beyond the slider, which reaches from '
                                f'{-STEEPEST} to {STEEPEST} rad')


def place_of(text: str) -> Vector:
    """
    Return the place (m) that is written.

    :raises ValueError: there is none; the text says why
    """
    try:
        x, y, z = map(float, text.strip(' ()').split(','))
    except ValueError:
        raise ValueError(f'place: {text!r} is no place: write x, y and z in meters, '
                         'as in 7.5, 7, 1.66') from None
    return (x, y, z)


def _to_millimeters(place: Vector) -> Vector:
    """Return a place (m), rounded."""
    x, y, z = place
    return round(x, 3), round(y, 3), round(z, 3)


def _block(name: str, content: str) -> str:
    """Return content as HTML, with a name by which it is found on the page."""
    return (f'<div data-turtle-brick="{name}" style="padding:0.2em 1em;font-size:0.9em">'
            f'{content}</div>')


def _colored(text: str, alarm: bool) -> str:
    """Return a text as HTML, in red if it is an alarm."""
    text = escape(text)
    return f'<span style="color:#c92a2a;font-weight:600">{text}</span>' if alarm else text


def _swatch(text: str, color: Color) -> str:
    """Return a text as HTML, behind a square in a color."""
    rgb = ','.join(str(round(255 * part)) for part in color[:3])
    return (f'<span style="white-space:nowrap"><span style="color:rgb({rgb})">&#9632;</span> '
            f'{escape(text)}</span>')


def _arrays(columns: Sequence[Sequence[float | None]]) -> tuple[numpy.ndarray, ...]:
    """Return columns as a plot takes them, with NaN for what is unknown."""
    return tuple(numpy.array(column, dtype=float) for column in columns)


def _scales(top: float) -> dict[str, viser.uplot.Scale]:
    """Return the scales of a plot from 0 to a top."""
    return {'x': {'time': False}, 'y': {'range': (0.0, top)}}
