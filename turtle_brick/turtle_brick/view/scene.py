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

"""The scene of the page: things in the world, the ground, and where it is seen from. No ROS."""

from collections.abc import Mapping
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy
from turtle_brick.core.geometry import Pose, Vector
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER
from turtle_brick.view.shapes import Shape, Thing
import viser


class Camera(NamedTuple):
    """How a camera is set up, in the world."""

    position: Vector
    """Where it is (m)."""
    look_at: Vector
    """What it looks at (m), which stays in place while one turns the view."""
    field_of_view: float
    """Its vertical angle (rad)."""


NEAR = Camera((ARENA_CENTER - 2.1, ARENA_CENTER - 4.2, 2.2), (ARENA_CENTER, ARENA_CENTER, 2.75),
              1.26)
"""The robot in the arena's center is near, and the brick is in sight at its start in the air."""

ABOVE = Camera((ARENA_CENTER, ARENA_CENTER - 0.01, 24.0), (ARENA_CENTER, ARENA_CENTER, 0.0), 0.54)
"""The whole arena, like turtlesim's window: from far away, so that the perspective is weak."""

GROUND = (229, 232, 226)
LINES = (196, 201, 194)
ZENITH = (164, 196, 232)
HORIZON = (240, 244, 248)
"""Colors (0 to 255) of the ground, the lines on it (one per meter) and the sky."""

LAMP = (-4.0, -12.0, 7.0)
"""Position (m) of a lamp for the sides that face the viewer; the sun is overhead."""

FAR = 200.0
"""Farthest point of the ground (m) to which a click can send the robot."""


class Scene:
    """Things with names, each somewhere in the world."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Begin with the empty ground."""
        self._scene = server.scene
        self._focus = (ARENA_CENTER, ARENA_CENTER)
        self._shown: dict[str, tuple[Any, Thing]] = {}
        initial = server.initial_camera
        initial.position, initial.look_at, initial.fov = NEAR
        self._world = self._scene.add_frame('/world', show_axes=False)
        self._scene.add_grid(
            '/world/ground', infinite_grid=True, cell_size=1.0, section_size=1.0,
            cell_color=LINES, section_color=LINES, plane_color=GROUND, plane_opacity=1.0,
            shadow_opacity=0.45, fade_distance=60.0, position=(0.0, 0.0, -1e-3))
        self._scene.set_background_image(sky(), format='png')
        self._scene.add_light_directional(
            '/lamp', color=(255, 250, 240), intensity=1.1, position=LAMP)

    def show(self, things: Mapping[str, Thing]) -> None:
        """Show these things and no others; only what has changed is sent to the browsers."""
        for name in self._shown.keys() - things.keys():
            self._shown.pop(name)[0].remove()
        for name, thing in things.items():
            if name not in self._shown:
                self._shown[name] = (self._add(name, thing), thing)
                continue
            node, before = self._shown[name]
            if before._replace(pose=thing.pose) != thing:
                node.remove()
                self._shown[name] = (self._add(name, thing), thing)
            elif before.pose != thing.pose:
                node.position, node.wxyz = thing.pose.position, _wxyz(thing.pose)
                self._shown[name] = (node, thing)

    def focus_on(self, x: float, y: float) -> None:
        """
        Have all cameras see a point of the world (m) in the arena's center.

        The world is moved under the cameras. So it moves in the same instant as the things in it,
        and everybody can turn his view meanwhile.
        """
        if (x, y) != self._focus:
            self._focus = (x, y)
            self._world.position = (ARENA_CENTER - x, ARENA_CENTER - y, 0.0)

    def ground_at(self, event: viser.SceneClickEvent) -> tuple[float, float] | None:
        """Return the point of the ground (m) that was clicked, None if it is too far away."""
        point = ground_under(event.ray_origin, event.ray_direction)
        if point is None:
            return None
        return (point[0] + self._focus[0] - ARENA_CENTER,
                point[1] + self._focus[1] - ARENA_CENTER)

    def _add(self, name: str, thing: Thing) -> Any:
        """Add a thing, and return its node."""
        # One step in viser's tree, whatever characters the name has: no thing is part of another.
        path = f'/world/things/{quote(name, safe="")}'
        node = self._scene.add_frame(
            path, show_axes=bool(thing.label), axes_length=0.6, axes_radius=0.018,
            position=thing.pose.position, wxyz=_wxyz(thing.pose))
        if thing.label:
            self._scene.add_label(f'{path}/name', thing.label, font_screen_scale=1.2)
        for number, shape in enumerate(thing.shapes):
            self._add_shape(f'{path}/{number}', shape)
        return node

    def _add_shape(self, path: str, shape: Shape) -> None:
        """Add a shape to a thing."""
        where: dict[str, Any] = {'position': shape.pose.position, 'wxyz': _wxyz(shape.pose)}
        red, green, blue = (round(255 * min(max(part, 0.0), 1.0)) for part in shape.color[:3])
        opacity = max(shape.color[3], 0.0) if shape.color[3] < 1.0 else None
        solid = {**where, 'color': (red, green, blue), 'opacity': opacity, 'scale': shape.size}
        match shape.kind:
            case 'box':
                self._scene.add_box(path, **solid)
            case 'cylinder':
                self._scene.add_cylinder(
                    path, radius=0.5, height=1.0, radial_segments=48, **solid)
            case 'sphere':
                self._scene.add_icosphere(path, radius=0.5, **solid)
            case 'text':
                self._scene.add_label(
                    path, shape.text, font_size_mode='scene', anchor='center-center',
                    font_scene_height=shape.size[2], **where)


def _wxyz(pose: Pose) -> tuple[float, float, float, float]:
    """Return an orientation as viser has it."""
    x, y, z, w = pose.orientation
    return w, x, y, z


def look(client: viser.ClientHandle, camera: Camera) -> None:
    """Set up the camera of a browser."""
    with client.atomic():
        client.camera.position = camera.position
        client.camera.look_at = camera.look_at
        client.camera.fov = camera.field_of_view


def sky() -> numpy.ndarray:
    """Return a picture of a clear sky, uint8 of shape (height, width, 3)."""
    above_horizon = numpy.linspace(1.0, -1.4, 256).clip(0.0)[:, None, None]
    colors = HORIZON + above_horizon * numpy.subtract(ZENITH, HORIZON)
    return numpy.broadcast_to(colors, (256, 16, 3)).astype(numpy.uint8)


def ground_under(origin: Vector, direction: Vector) -> tuple[float, float] | None:
    """Return where a ray (m) meets the plane z = 0, None where that is too far away."""
    if direction[2] >= 0.0 or origin[2] <= 0.0:
        return None
    length = -origin[2] / direction[2]
    x, y = origin[0] + length * direction[0], origin[1] + length * direction[1]
    return (x, y) if abs(x) <= FAR and abs(y) <= FAR else None
