# SPDX-License-Identifier: Apache-2.0

"""The 3D scene on the page (objects, ground and cameras). This module does not use a ROS node."""

from collections import deque
from collections.abc import Mapping, Sequence
from itertools import count
from math import dist
from typing import Any

import numpy
from turtle_graph.client.geometry import CENTER, Pose, Vector
from turtle_graph.view.camera import ARENA_VIEW, CORNERS, FIELD_OF_VIEW, View
from turtle_graph.view.shapes import SceneObject, Shape
import viser

GROUND_COLOR = (229, 232, 226)
GRID_COLOR = (196, 201, 194)
SKY_COLOR = (214, 228, 242)
"""Colors (0 to 255) of the ground, its grid (one line per meter) and the sky."""

INITIAL_POSE = ARENA_VIEW.camera_pose([*CORNERS, (*CENTER, 8.0)], 1.0)
"""Position (m) of a new camera and the point (m) at the center of its picture."""

POSITION_TOLERANCE = 1e-3
"""Distance (m) below which two camera positions count as equal."""

LABEL_ANCHORS: dict[str, Any] = {
    'world': 'bottom-right', 'odom': 'top-right', 'stem': 'top-left', 'wheel': 'top-right',
    'platform': 'bottom-right', 'brick': 'top-left'}
"""Corner of each frame's label that is placed at the frame's origin (default: bottom-left)."""


class BrowserCamera:
    """A browser's camera, which follows a view until the user moves the camera."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._camera = client.camera
        self._camera.on_update(self._on_update)
        self.set_view(ARENA_VIEW)

    def set_view(self, view: View) -> None:
        """Start following a view."""
        self._view: View | None = view
        self._requested: deque[Vector] = deque(maxlen=300)
        self._is_following = False

    def keep_in_view(self, points: Sequence[Vector], has_arena: bool) -> None:
        """Move the camera to show `points` (m) and the points in the arena if the view has any."""
        if self._view is None:
            return
        fixed = self._view.fixed_points if has_arena else ()
        visible = [*fixed, *points] if self._view.follows or not fixed else fixed
        if not visible:
            return
        previous = self._requested[-1] if self._requested else None
        aspect = self._camera.image_width / max(self._camera.image_height, 1)
        position, target = self._view.camera_pose(visible, aspect, previous)
        if previous is None or dist(previous, position) > POSITION_TOLERANCE:
            self._camera.position, self._camera.look_at = position, target
            self._requested.append(position)

    async def _on_update(self, camera: viser.CameraHandle) -> None:
        """Stop adjusting the camera if the browser reports a position that was not requested."""
        if dist(camera.position, INITIAL_POSE[0]) < POSITION_TOLERANCE:
            # The user has reset the camera, or a narrow page has reset it after loading.
            self.set_view(ARENA_VIEW)
            return
        is_following = any(dist(camera.position, position) < POSITION_TOLERANCE
                           for position in self._requested)
        # The browser may first report camera positions from before the view was set.
        if self._is_following and not is_following:
            self._view = None
        self._is_following = is_following


class Scene:
    """The named objects in the scene and one camera for each browser."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._scene = server.scene
        self._get_clients = server.get_clients
        self._cameras: dict[int, BrowserCamera] = {}
        self._shown: dict[str, tuple[Any, SceneObject]] = {}
        self._numbers = count()
        initial = server.initial_camera
        initial.fov = FIELD_OF_VIEW
        initial.position, initial.look_at = INITIAL_POSE
        self._scene.add_grid(
            '/ground', infinite_grid=True, cell_size=1.0, section_size=1.0, cell_color=GRID_COLOR,
            section_color=GRID_COLOR, plane_color=GROUND_COLOR, plane_opacity=1.0,
            shadow_opacity=0.45, fade_distance=60.0, position=(0.0, 0.0, -1e-3))
        self._scene.set_background_image(numpy.full((1, 1, 3), SKY_COLOR, numpy.uint8))
        # Without a graphics card, viser's environment map takes ten seconds of processor time.
        self._scene.configure_environment_map(None)
        self._scene.add_light_hemisphere('/daylight', ground_color=GROUND_COLOR, intensity=2.0)

    def show(self, objects: Mapping[str, SceneObject]) -> None:
        """Replace the objects in the scene and send only the changes to the browsers."""
        for name, (node, shown) in list(self._shown.items()):
            if name not in objects or objects[name]._replace(pose=shown.pose) != shown:
                node.remove()
                del self._shown[name]
        for name, scene_object in objects.items():
            if name not in self._shown:
                self._shown[name] = (self._add(scene_object), scene_object)
            node, shown = self._shown[name]
            if shown.pose != scene_object.pose:
                node.position, node.wxyz = scene_object.pose.position, _wxyz(scene_object.pose)
                self._shown[name] = (node, scene_object)

    def set_view(self, client: viser.ClientHandle, view: View) -> None:
        """Set the view in one browser."""
        self._cameras[client.client_id].set_view(view)

    def keep_in_view(self, points: Sequence[Vector], has_arena: bool) -> None:
        """Update the cameras of all browsers. Without an arena, they show only `points` (m)."""
        self._cameras = {number: self._cameras.get(number) or BrowserCamera(client)
                         for number, client in self._get_clients().items()}
        for camera in self._cameras.values():
            camera.keep_in_view(points, has_arena)

    def _add(self, scene_object: SceneObject) -> Any:
        # A new scene node that reuses a removed node's name can keep the old orientation.
        path = f'/objects/{next(self._numbers)}'
        pose, label = scene_object.pose, scene_object.label
        node = self._scene.add_frame(
            path, show_axes=bool(label), axes_length=0.6, axes_radius=0.018,
            position=pose.position, wxyz=_wxyz(pose))
        if label:
            self._scene.add_label(f'{path}/name', label, font_screen_scale=1.2,
                                  anchor=LABEL_ANCHORS.get(label, 'bottom-left'))
        for number, shape in enumerate(scene_object.shapes):
            self._add_shape(f'{path}/{number}', shape)
        return node

    def _add_shape(self, path: str, shape: Shape) -> None:
        pose: dict[str, Any] = {'position': shape.pose.position, 'wxyz': _wxyz(shape.pose)}
        red, green, blue, alpha = (min(max(value, 0.0), 1.0) for value in shape.color)
        color = (round(255 * red), round(255 * green), round(255 * blue))
        opacity = alpha if alpha < 1.0 else None
        solid = {**pose, 'color': color, 'opacity': opacity, 'scale': shape.size}
        match shape.kind:
            case 'box':
                self._scene.add_box(path, **solid)
            case 'cylinder':
                self._scene.add_cylinder(path, radius=0.5, height=1.0, radial_segments=48, **solid)
            case 'sphere':
                self._scene.add_icosphere(path, radius=0.5, **solid)
            case 'text':
                self._scene.add_label(
                    path, shape.text, font_size_mode='scene', anchor='center-center',
                    font_scene_height=shape.size[2], **pose)
            case 'line':
                segments = numpy.array(list(zip(shape.points, shape.points[1:])))
                self._scene.add_line_segments(
                    path, segments.reshape(-1, 2, 3), color, thickness=shape.size[0], **pose)


def _wxyz(pose: Pose) -> tuple[float, float, float, float]:
    """Return the orientation of a pose in viser's component order (w, x, y, z)."""
    x, y, z, w = pose.orientation
    return w, x, y, z
