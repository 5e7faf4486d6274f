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

"""The scene of the page: shapes that move, the ground, and where it is seen from. No ROS."""

from collections.abc import Sequence
from typing import Any, NamedTuple, TypedDict
from urllib.parse import quote

import numpy
from turtle_brick.core.geometry import Pose, Quaternion, Vector
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER
from turtle_brick.view.urdf_scene import Shape
from turtle_brick.view.web_guard import VIEW_BUTTONS
import viser


class View(NamedTuple):
    """How a camera is set up, in the world."""

    position: Vector
    """Where it is (m)."""
    look_at: Vector
    """What it looks at (m), which stays in place while one turns the view."""
    field_of_view: float
    """Its vertical angle (rad)."""


NEAR = View((ARENA_CENTER - 2.1, ARENA_CENTER - 4.2, 2.2), (ARENA_CENTER, ARENA_CENTER, 2.75),
            1.26)
"""The robot in the arena's center is near, and the brick is in sight at its start in the air."""

ABOVE = View((ARENA_CENTER, ARENA_CENTER - 0.01, 24.0), (ARENA_CENTER, ARENA_CENTER, 0.0), 0.54)
"""The whole arena, like turtlesim's window: from far away, so that the perspective is weak."""

VIEWS = dict(zip(VIEW_BUTTONS, (NEAR, ABOVE), strict=True))

GROUND = (229, 232, 226)
LINES = (196, 201, 194)
ZENITH = (164, 196, 232)
HORIZON = (240, 244, 248)
"""Colors (0 to 255) of the ground, the lines on it (one per meter) and the sky."""

LAMP = (-4.0, -12.0, 7.0)
"""Position (m) of a lamp for the sides that face the viewer; the sun is overhead."""

FAR = 200.0
"""Farthest point of the ground (m) to which a click can send the robot."""


class Thing:
    """Shapes that move together."""

    def __init__(self, node: Any, shapes: Sequence[Shape], axes: bool) -> None:
        """
        Remember what the browsers have been told.

        :param node: of viser's scene
        :param shapes: in its frame
        :param axes: whether its frame is drawn
        """
        self.node = node
        self.shapes = tuple(shapes)
        self.axes = axes
        self.pose: Pose | None = None


class Where(TypedDict):
    """The pose of a shape, in viser's terms."""

    position: Vector
    wxyz: Quaternion


class Looks(Where):
    """The pose and the looks of a solid, in viser's terms."""

    opacity: float | None
    color: tuple[int, int, int]
    scale: Vector


class Scene:
    """Things with names, each somewhere in the world or nowhere."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Begin with the empty ground."""
        self.changes = 0
        """How often something has changed."""
        self.focus = (ARENA_CENTER, ARENA_CENTER)
        """The point of the world (m) that the cameras see in the arena's center."""
        self._server = server
        self._things: dict[str, Thing] = {}
        initial = server.initial_camera
        initial.position, initial.look_at, initial.fov = NEAR
        scene = server.scene
        self._world = scene.add_frame('/world', show_axes=False)
        scene.add_grid(
            '/world/ground', infinite_grid=True, cell_size=1.0, section_size=1.0,
            cell_color=LINES, section_color=LINES, plane_color=GROUND, plane_opacity=1.0,
            shadow_opacity=0.45, fade_distance=60.0, position=(0.0, 0.0, -1e-3))
        scene.set_background_image(sky(), format='png')
        scene.add_light_directional('/lamp', color=(255, 250, 240), intensity=1.1, position=LAMP)

    def put(self, name: str, shapes: Sequence[Shape], axes: bool = False) -> None:
        """
        Make or change a thing. A new one is nowhere until it is moved.

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
        # One step in viser's tree, whatever characters the name has: no thing is part of another.
        path = f'/world/things/{quote(name, safe="")}'
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

    def focus_on(self, x: float, y: float) -> None:
        """
        Have all cameras see a point of the world (m) in the arena's center.

        The world is moved under the cameras. So it moves in the same instant as the things in it,
        and everybody can turn his view meanwhile.
        """
        if (x, y) != self.focus:
            self.changes += 1
            self.focus = (x, y)
            self._world.position = (ARENA_CENTER - x, ARENA_CENTER - y, 0.0)

    def clicked(self, event: viser.SceneClickEvent) -> tuple[float, float] | None:
        """Return the point of the ground (m) that was clicked, None if it is too far away."""
        point = ground_under(event.ray_origin, event.ray_direction)
        if point is None:
            return None
        return point[0] + self.focus[0] - ARENA_CENTER, point[1] + self.focus[1] - ARENA_CENTER

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


def look(client: viser.ClientHandle, view: View) -> None:
    """Set up the camera of a browser."""
    with client.atomic():
        client.camera.position = view.position
        client.camera.look_at = view.look_at
        client.camera.fov = view.field_of_view


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
