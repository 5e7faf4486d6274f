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

from collections import deque
from collections.abc import Mapping, Sequence
from math import dist
from typing import Any
from urllib.parse import quote

import numpy
from turtle_brick.core.geometry import Pose, Vector
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER
from turtle_brick.view.camera import FIELD_OF_VIEW, NEAR, View
from turtle_brick.view.shapes import Shape, Thing
import viser

GROUND = (229, 232, 226)
LINES = (196, 201, 194)
SKY = (214, 228, 242)
"""Colors (0 to 255) of the ground, the lines on it (one per meter) and the sky."""

TOUCHED = 1e-3
"""How far (m) from where it was set a camera has to be to have been moved in its browser."""

LABELS: dict[str, Any] = {
    'world': 'bottom-right', 'odom': 'top-right', 'base_link': 'bottom-left', 'brick': 'top-left'}
"""Which corner of a frame's name is at its origin, so that names at one place do not overlap."""


class Eye:
    """The camera of a browser: it has a view until somebody turns it there."""

    def __init__(self, client: viser.ClientHandle) -> None:
        """Begin near."""
        self._camera = client.camera
        self._camera.on_update(self._on_update)
        self.look(NEAR)

    def look(self, view: View) -> None:
        """Take a view."""
        self._view: View | None = view
        self._set: deque[Vector] = deque(maxlen=300)
        self._is_obeyed = False

    def keep_in_sight(self, points: Sequence[Vector]) -> None:
        """Have points (m) in the picture, if the view is not of something else."""
        if self._view is None or not (points := self._view.sights or points):
            return
        last = self._set[-1] if self._set else None
        aspect = self._camera.image_width / max(self._camera.image_height, 1)
        position, target = self._view.camera(points, aspect, last)
        if last is None or dist(last, position) > TOUCHED:
            self._camera.position, self._camera.look_at = position, target
            self._set.append(position)

    async def _on_update(self, camera: viser.CameraHandle) -> None:
        """Learn where the camera is in the browser: if obeyed, where it was set some time ago."""
        is_obeyed = any(dist(camera.position, place) < TOUCHED for place in self._set)
        if self._is_obeyed and not is_obeyed:
            self._view = None
        self._is_obeyed = is_obeyed


class Scene:
    """Things with names, each somewhere in the world."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Begin with the empty ground."""
        self._scene = server.scene
        self._clients = server.get_clients
        self._eyes: dict[int, Eye] = {}
        self._shown: dict[str, tuple[Any, Thing]] = {}
        initial = server.initial_camera
        initial.fov = FIELD_OF_VIEW
        initial.position, initial.look_at = NEAR.camera(
            [(ARENA_CENTER, ARENA_CENTER, height) for height in (0.0, 8.0)], 1.0)
        self._scene.add_grid(
            '/ground', infinite_grid=True, cell_size=1.0, section_size=1.0,
            cell_color=LINES, section_color=LINES, plane_color=GROUND, plane_opacity=1.0,
            shadow_opacity=0.45, fade_distance=60.0, position=(0.0, 0.0, -1e-3))
        self._scene.set_background_image(numpy.full((1, 1, 3), SKY, numpy.uint8))
        # Without a graphics card, viser's own surroundings take ten seconds of a processor.
        self._scene.configure_environment_map(None)
        self._scene.add_light_hemisphere('/daylight', ground_color=GROUND, intensity=2.0)

    def show(self, things: Mapping[str, Thing]) -> None:
        """Show these things and no others; only what has changed is sent to the browsers."""
        for name, (node, before) in list(self._shown.items()):
            if name not in things or things[name]._replace(pose=before.pose) != before:
                node.remove()
                del self._shown[name]
        for name, thing in things.items():
            node, before = self._shown.get(name) or (self._add(name, thing), thing)
            if before.pose != thing.pose:
                node.position, node.wxyz = thing.pose.position, _wxyz(thing.pose)
            self._shown[name] = (node, thing)

    def look(self, client: viser.ClientHandle, view: View) -> None:
        """Have a browser look from some side."""
        self._eyes[client.client_id].look(view)

    def keep_in_sight(self, points: Sequence[Vector]) -> None:
        """Have points (m) in the picture of each browser that looks from near."""
        self._eyes = {number: self._eyes.get(number) or Eye(client)
                      for number, client in self._clients().items()}
        for eye in self._eyes.values():
            eye.keep_in_sight(points)

    def _add(self, name: str, thing: Thing) -> Any:
        """Add a thing, and return its node."""
        # One step in viser's tree, whatever characters the name has: no thing is part of another.
        path = f'/things/{quote(name, safe="")}'
        node = self._scene.add_frame(
            path, show_axes=bool(thing.label), axes_length=0.6, axes_radius=0.018,
            position=thing.pose.position, wxyz=_wxyz(thing.pose))
        if thing.label:
            self._scene.add_label(f'{path}/name', thing.label, font_screen_scale=1.2,
                                  anchor=LABELS[thing.label])
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
