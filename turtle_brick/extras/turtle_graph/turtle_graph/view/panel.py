# SPDX-License-Identifier: Apache-2.0

"""The panel beside the scene, with text, curves, buttons and a slider."""

from collections.abc import Callable, Sequence
from html import escape
from math import inf, pi
from random import uniform
from time import monotonic
from typing import Any

import numpy
from turtle_graph.client.geometry import ARENA_SIZE, Vector
from turtle_graph.view.camera import ARENA_VIEW, ground_point, NEAR_VIEW, TOP_VIEW
from turtle_graph.view.scene import Scene
import viser

GREEN = (46, 125, 70)
"""Color (red, green and blue, 0 to 255) of the controls."""

SLIDER_LIMIT = round(pi / 2.0, 2)
"""Maximum tilt angle (rad) that the slider can set in either direction."""

SLIDER_PAUSE = 1.0
"""Time (s) after a user action during which the slider does not follow the platform."""

CURVES = (('height (m)', '#e8590c'), ('distance (m)', '#1971c2'), ('speed (m/s)', '#2f9e44'))
"""Labels and colors of the curves."""

REPLAY_SPEEDS = {'Replay': 1.0, 'Replay at 1/8': 0.125}
"""Playback speed for each replay button, relative to real time."""

VIEWS = {'Arena': ARENA_VIEW, 'Near': NEAR_VIEW, 'From above': TOP_VIEW}
"""View for each camera button."""

RANDOM_RANGES = ((0.5, ARENA_SIZE - 0.5), (0.5, ARENA_SIZE - 0.5), (3.0, 9.0))
"""Ranges of x, y and z (m) for random drops."""


class Panel:
    """The panel of the page. Most attributes are viser handles for the controls."""

    def __init__(self, server: viser.ViserServer, scene: Scene, execute: Callable[..., None],
                 shows_frames: bool = False) -> None:
        """Create controls that make calls such as `execute('tilt', 0.5)` in viser's threads."""
        self._scene = scene
        self._execute = execute
        self._slider_time = -inf
        self._suggestion: Vector | None = None
        gui = server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=GREEN)
        gui.main_panel.dock_right()
        self._add_brick_folder(gui)
        self.response = gui.add_html('')
        self._add_robot_folder(gui)
        with gui.add_folder('View'):
            gui.add_button_group('', tuple(VIEWS)).on_click(self._on_view)
            self.frames = gui.add_checkbox('show frames', shows_frames)
            self.fixed_frame = gui.add_html('')
            self.hidden_links = gui.add_html('')
        self._add_plot_folder(gui)
        with gui.add_folder('Rates'):
            self.rates = gui.add_html('')
        server.scene.on_click()(self._on_scene_click)

    def _add_brick_folder(self, gui: viser.GuiApi) -> None:
        with gui.add_folder('Brick') as self.brick_folder:
            self.brick = gui.add_html('')
            self.hint = gui.add_html('')
            with gui.add_form(None) as form:
                # The control has the type Any because mypy regards its value as read-only.
                self.position: Any = gui.add_text('x, y, z (m)', '')
            form.on_submit(self._on_submit)
            for names in (('Place', 'Drop', 'Drop at random'), tuple(REPLAY_SPEEDS)):
                gui.add_button_group('', names).on_click(self._on_button)

    def _add_robot_folder(self, gui: viser.GuiApi) -> None:
        with gui.add_folder('Robot') as self.robot_folder:
            self.status = gui.add_html('')
            self.tilt: Any = gui.add_slider('tilt (rad)', -SLIDER_LIMIT, SLIDER_LIMIT, 0.01, 0.0)
            self.drive = gui.add_checkbox('click the ground to drive', True)
        self.tilt.on_update(self._on_tilt)

    def _add_plot_folder(self, gui: viser.GuiApi) -> None:
        self._series = (viser.uplot.Series(), *(
            viser.uplot.Series(label=label, stroke=color, width=2) for label, color in CURVES))
        with gui.add_folder('Last 12 seconds') as self.plot_folder:
            self.plot = gui.add_uplot(
                tuple(numpy.zeros((1 + len(CURVES), 1))), self._series,
                scales={'x': {'time': False, 'range': (-12.0, 0.0)}}, legend={'live': False},
                height=140, padding=(8, 16, 0, 0))

    def suggest_position(self, position: Vector) -> None:
        """Write a position (m) into the input field unless a user has changed the field."""
        x, y, z = (round(coordinate, 3) for coordinate in position)
        if (x, y, z) != self._suggestion:
            if not self._is_edited():
                self.position.value = f'{x:.10g}, {y:.10g}, {z:.10g}'
            self._suggestion = (x, y, z)

    def show_sections(self, arena: bool, robot: bool, catcher: bool) -> None:
        """Show only the sections for the nodes that are running."""
        self.brick_folder.visible = arena
        self.robot_folder.visible = robot or catcher
        self.status.visible = catcher
        self.tilt.visible = self.drive.visible = robot
        self.plot_folder.visible = arena or robot

    def show_brick(self, text: str, hint: str) -> None:
        """Show the state of the brick and an explanation, which may be empty."""
        self.brick.content = _html('brick', text)
        self.hint.content = _html('hint', hint)
        self.hint.visible = bool(hint)

    def show_fixed_frame(self, frame: str, is_known: bool) -> None:
        """Show the name of the fixed frame. An unknown frame is shown as an error."""
        text = f'Fixed frame: {frame}' if is_known else f'Fixed frame {frame} does not exist'
        self.fixed_frame.content = _html('fixed_frame', text, not is_known)

    def show_hidden_links(self, links: Sequence[str], reason: str) -> None:
        """Show as an error which links of the robot are hidden for a given reason, if any."""
        text = f'Not shown because {reason}: {", ".join(links)}'
        self.hidden_links.content = _html('hidden_links', text, True)
        self.hidden_links.visible = bool(links)

    def show_status(self, text: str, is_alarm: bool) -> None:
        """Show the status of the current catch attempt, in red for an alarm."""
        self.status.content = _html('status', text, is_alarm)

    def show_response(self, text: str, is_success: bool) -> None:
        """Show the response to the last command, in red for an error."""
        self.response.content = _html('response', text, not is_success)

    def show_rates(self, rates: Sequence[tuple[str, float]]) -> None:
        """Show labeled message rates (Hz). A rate of 0 is shown as 'no messages'."""
        self.rates.content = ''.join(
            _html('rate', f'{name}: {rate:.1f} Hz' if rate else f'{name}: no messages')
            for name, rate in rates)

    def show_tilt(self, angle: float) -> None:
        """Move the slider to the platform angle (rad) unless a user has just moved the slider."""
        shown = round(min(max(angle, -SLIDER_LIMIT), SLIDER_LIMIT), 2)
        if monotonic() - self._slider_time >= SLIDER_PAUSE and shown != self.tilt.value:
            self.tilt.value = shown

    def show_curves(self, points: Sequence[tuple[float, ...]]) -> None:
        """Plot points that each contain a time (s) and one value per curve (NaN if unknown)."""
        # A chart with a NaN would be empty. Only curves with a known latest value are plotted.
        values = numpy.array(points)
        known = numpy.flatnonzero(~numpy.isnan(values[-1]))
        complete = ~numpy.isnan(values[:, known]).any(axis=1)
        times, *curves = values[complete][:, known].T
        series = tuple(self._series[number] for number in known)
        if series != self.plot.series:
            self.plot.series = series
        self.plot.data = (times - times[-1], *curves)

    def press(self, button: str) -> None:
        """Execute the action of a button in the brick section of the panel."""
        if button in REPLAY_SPEEDS:
            self._execute('replay', REPLAY_SPEEDS[button])
        elif button == 'Drop at random':
            self._execute('drop', tuple(uniform(*limits) for limits in RANDOM_RANGES))
        elif button == 'Drop' and not self._is_edited():
            self._execute('drop')
        else:
            text = self.position.value
            # viser can lose text typed within 50 ms before Enter, so show the received text.
            self.position.value = ''
            self.position.value = text
            try:
                position = parse_position(text)
            except ValueError as error:
                self.show_response(str(error), False)
                return
            self._execute('place' if button == 'Place' else 'drop', position)

    async def _on_submit(self, _: viser.GuiEvent) -> None:
        self.press('Place')

    async def _on_button(self, event: viser.GuiEvent) -> None:
        self.press(event.target.value)

    def _on_tilt(self, event: viser.GuiEvent) -> None:
        if event.client is not None:  # The client is None if show_tilt moved the slider.
            self._slider_time = monotonic()
            self._execute('tilt', self.tilt.value)

    async def _on_view(self, event: viser.GuiEvent) -> None:
        if event.client is not None:
            self._scene.set_view(event.client, VIEWS[event.target.value])

    def _on_scene_click(self, event: viser.SceneClickEvent) -> None:
        point = ground_point(event.ray_origin, event.ray_direction)
        if self.drive.visible and self.drive.value and point is not None:
            self._execute('drive', *point)

    def _is_edited(self) -> bool:
        try:
            return parse_position(self.position.value) != self._suggestion
        except ValueError:
            return self._suggestion is not None


def parse_position(text: str) -> Vector:
    """Parse a position (m) such as '1, 2, 3', or raise ValueError if the text is invalid."""
    try:
        x, y, z = map(float, text.strip(' ()').replace(',', ' ').split())
    except ValueError:
        raise ValueError(f'{text!r} is not a position. Enter x, y and z in meters, for example '
                         '7.5, 7, 1.66.') from None
    return (x, y, z)


def _html(name: str, text: str, is_alarm: bool = False) -> str:
    """Wrap text in an HTML element that tests can find by name. An alarm is red."""
    color = 'color:#c92a2a;font-weight:600;' if is_alarm else ''
    return (f'<div data-turtle-brick="{name}" style="{color}padding:0.2em 1em;font-size:0.9em">'
            f'{escape(text)}</div>')
