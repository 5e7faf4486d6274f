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
from math import inf, pi
from random import uniform
from time import monotonic
from typing import Any, NamedTuple

import numpy
from turtle_brick.core.geometry import Vector
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.view.camera import ABOVE, ground_under, NEAR
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

VIEWS = {'Near': NEAR, 'From above': ABOVE}

ANYWHERE = ((0.5, ARENA_SIZE - 0.5), (0.5, ARENA_SIZE - 0.5), (3.0, 9.0))
"""The least and the greatest x, y and z (m) of a brick that is dropped at random."""


class Orders(NamedTuple):
    """What the buttons do. viser calls it in a thread of its own."""

    place: Callable[[Vector], None]
    """Place the brick at a point of the world (m)."""
    drop: Callable[[Vector | None], None]
    """Drop the brick; if there is a point (m), place it there first."""
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
        self._orders = orders
        self._dragged = -inf
        self._suggested: Vector | None = None
        gui = server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=GREEN)
        gui.main_panel.dock_right()
        with gui.add_folder('Brick') as self._arena_part:
            self._brick = gui.add_html('')
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
            self.frames = gui.add_checkbox('frames', False)
        with gui.add_folder('Last seconds') as self._plot_part:
            series = (viser.uplot.Series(), *(
                viser.uplot.Series(label=label, stroke=color, width=2) for label, color in CURVES))
            self._plot = gui.add_uplot(
                tuple(numpy.zeros((1 + len(CURVES), 1))), series, scales={'x': {'time': False}},
                legend={'live': False}, height=140, padding=(8, 16, 0, 0))
        with gui.add_folder('Rates'):
            self._rates = gui.add_html('')

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
                orders.tilt(self._tilt.value)

        @cameras.on_click
        async def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                scene.look(event.client, VIEWS[event.target.value])

        @server.scene.on_click()
        def _(event: viser.SceneClickEvent) -> None:
            point = ground_under(event.ray_origin, event.ray_direction)
            if self._goes.visible and self._goes.value and point is not None:
                orders.go(*point)

    def suggest_place(self, position: Vector) -> None:
        """Fill in a place for the brick (m), unless somebody has written another one."""
        x, y, z = (round(coordinate, 3) for coordinate in position)
        if (x, y, z) != self._suggested:
            if not self._is_edited():
                self._place.value = f'{x:.10g}, {y:.10g}, {z:.10g}'
            self._suggested = (x, y, z)

    def show_parts(self, arena: bool, robot: bool, catcher: bool) -> None:
        """Show the parts of those nodes that are there."""
        self._arena_part.visible = arena
        self._robot_part.visible = robot or catcher
        self._account.visible = catcher
        self._tilt.visible = self._goes.visible = robot
        self._plot_part.visible = arena or robot

    def show_brick(self, text: str) -> None:
        """Show what the brick does."""
        self._brick.content = _block('brick', text)

    def show_account(self, text: str, alarm: bool) -> None:
        """Show what the robot does about the brick."""
        self._account.content = _block('account', text, alarm)

    def show_answer(self, text: str, good: bool) -> None:
        """Show what has become of the last order."""
        self._answer.content = _block('answer', text, not good)

    def show_rates(self, rates: Sequence[tuple[str, float | None]]) -> None:
        """Show how often (Hz) each of some things comes, None for one that does not."""
        self._rates.content = ''.join(
            _block('rate', f'{name}: {"no messages" if rate is None else f"{rate:.1f} Hz"}')
            for name, rate in rates)

    def show_tilt(self, angle: float) -> None:
        """Move the slider to the angle (rad) of the platform, unless somebody is at it."""
        shown = round(min(max(angle, -STEEPEST), STEEPEST), 2)
        if monotonic() - self._dragged >= HANDS_OFF and shown != self._tilt.value:
            self._tilt.value = shown
        self._beyond.visible = abs(angle) > STEEPEST
        self._beyond.content = _block(
            'beyond', f'The tilt is {angle:g} rad, beyond the slider')

    def show_curves(self, points: Sequence[tuple[float, ...]]) -> None:
        """Plot what there was: at some times (s) the values of CURVES, NaN if unknown."""
        times, *curves = numpy.transpose(points)
        self._plot.data = (times - times[-1], *curves)

    def _is_edited(self) -> bool:
        """Tell whether somebody has written another place than the suggested one."""
        try:
            return place_of(self._place.value) != self._suggested
        except ValueError:
            return self._suggested is not None

    def _on_button(self, name: str) -> None:
        """Do what a button says; "Drop" places the brick first where is written, if new."""
        if name == 'Drop at random':
            x, y, z = (uniform(*span) for span in ANYWHERE)
            self._orders.drop((x, y, z))
        elif name == 'Drop' and not self._is_edited():
            self._orders.drop(None)
        else:
            text = self._place.value
            # Sent back, because viser may lose what is written in the last 50 ms before Enter.
            self._place.value = ''
            self._place.value = text
            try:
                place = place_of(text)
            except ValueError as error:
                self.show_answer(str(error), False)
            else:
                (self._orders.place if name == 'Place' else self._orders.drop)(place)


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


def _block(name: str, text: str, alarm: bool = False) -> str:
    """Return a text as HTML, in red if it is an alarm, with a name by which it is found."""
    style = 'color:#c92a2a;font-weight:600;' * alarm + 'padding:0.2em 1em;font-size:0.9em'
    return f'<div data-turtle-brick="{name}" style="{style}">{escape(text)}</div>'
