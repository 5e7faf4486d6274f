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

"""The panel of the page: what can be read and done beside the scene. No ROS."""

from collections.abc import Callable, Mapping, Sequence
from html import escape
from math import ceil, inf, pi
from time import monotonic
from typing import NamedTuple

import numpy
from turtle_brick.core.geometry import Color, Vector
from turtle_brick.core.time_steps import NANOSECONDS
from turtle_brick.physics import Phase
from turtle_brick.view.measures import Curves
from turtle_brick.view.scene import ABOVE, look, NEAR, Scene
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

CAMERAS = {'Near': NEAR, 'From above': ABOVE}


class Orders(NamedTuple):
    """What the buttons do. viser calls it in a thread of its own."""

    place: Callable[[float, float, float], None]
    """Place the brick at a point of the world (m)."""
    drop: Callable[[], None]
    """Drop the brick."""
    drop_at_random: Callable[[], None]
    """Place the brick at random, and drop it."""
    tilt: Callable[[float], None]
    """Tilt the platform by an angle (rad)."""
    go: Callable[[float, float], None]
    """Send the robot to a point of the ground (m in the world)."""


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
        with gui.add_folder('Brick'):
            self._brick = gui.add_html('')
            self._legend = gui.add_html('')
            self._place = gui.add_vector3('place (m)', (0.0, 0.0, 0.0), step=0.1)
            buttons = gui.add_button_group('', ('Place', 'Drop', 'Drop at random'))
            self._answer = gui.add_html('')
        with gui.add_folder('Robot'):
            self._account = gui.add_html('')
            self._tilt = gui.add_slider('tilt (rad)', -STEEPEST, STEEPEST, 0.01, 0.0)
            goes = gui.add_checkbox('go on click', True)
        with gui.add_folder('View'):
            cameras = gui.add_button_group('', tuple(CAMERAS))
            self._follow = gui.add_checkbox('follow robot', False)
            self._frames = gui.add_checkbox('frames', False)
        with gui.add_folder(f'Last {Curves.LENGTH * Curves.PERIOD // NANOSECONDS} s'):
            series = (viser.uplot.Series(), *(
                viser.uplot.Series(label=label, stroke=color, width=2) for label, color in CURVES))
            self._plotted: Sequence[Sequence[float | None]] = Curves(len(CURVES)).columns()
            self._plot = gui.add_uplot(
                _arrays(self._plotted), series, scales=_scales(LEAST_TOP),
                legend={'live': False}, height=140, padding=(8, 16, 0, 0))
        with gui.add_folder('Rates'):
            self._rates = gui.add_html('')
        self._dragged = -inf

        @buttons.on_click
        def _(event: viser.GuiEvent) -> None:
            match event.target.value:
                case 'Place':
                    orders.place(*self._place.value)
                case 'Drop':
                    orders.drop()
                case 'Drop at random':
                    orders.drop_at_random()

        @self._tilt.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:  # else it was moved from here
                self._dragged = monotonic()
                orders.tilt(self._tilt.value)

        @cameras.on_click
        async def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                look(event.client, CAMERAS[event.target.value])

        @server.scene.on_click()
        def _(event: viser.SceneClickEvent) -> None:
            point = scene.ground_at(event)
            if goes.value and point is not None:
                orders.go(*point)

    @property
    def frames(self) -> bool:
        """Whether frames are to be shown."""
        return self._frames.value

    @property
    def follow(self) -> bool:
        """Whether the robot is to be followed."""
        return self._follow.value

    def suggest_place(self, position: Vector) -> None:
        """Fill in a place for the brick (m)."""
        x, y, z = (round(part, 2) for part in position)
        self._place.value = (x, y, z)  # type: ignore[misc]

    def show_brick(self, text: str, color: Color | None) -> None:
        """Show what the brick does, and in which color."""
        self._brick.content = _block('brick', _swatch(text, color) if color else escape(text))

    def show_legend(self, colors: Mapping[Phase, Color]) -> None:
        """Show which color tells what."""
        swatches = ' '.join(_swatch(phase.value, color) for phase, color in colors.items())
        self._legend.content = _block(
            'legend', f'<small style="color:#868e96">{swatches}</small>')

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
            self._tilt.value = shown  # type: ignore[misc]

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
