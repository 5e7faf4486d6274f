# SPDX-License-Identifier: Apache-2.0

"""Drawable shapes from the robot description and from markers. Lengths are in meters."""

from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from math import inf
from typing import NamedTuple
from xml.etree import ElementTree

from turtle_graph.client.geometry import ORIGIN, Pose, Vector
from turtle_graph.client.messages import nanoseconds_of, read_pose, read_vector
from turtle_graph.client.urdf import read_urdf, Visual
from visualization_msgs.msg import Marker

Color = tuple[float, float, float, float]
"""Red, green, blue and opacity, each from 0 to 1."""

RED: Color = (1.0, 0.0, 0.0, 1.0)
"""Color of a URDF visual element that has no defined material, as in rviz2."""

MAX_NUMBER = 1e6
"""Maximum absolute value of any number used for drawing."""

SOLIDS = ('box', 'cylinder', 'sphere')
"""Drawable kinds of URDF geometry."""

MARKER_KINDS = {Marker.CUBE: 'box', Marker.SPHERE: 'sphere', Marker.CYLINDER: 'cylinder',
                Marker.LINE_STRIP: 'line', Marker.TEXT_VIEW_FACING: 'text'}
"""Kind of shape for each drawable marker type."""

MARKER_TYPES = {getattr(Marker, name): name for name in (
    'ARROW', 'LINE_LIST', 'CUBE_LIST', 'SPHERE_LIST', 'POINTS', 'MESH_RESOURCE', 'TRIANGLE_LIST')}
"""Names of the marker types that cannot be drawn."""


class Shape(NamedTuple):
    """A colored solid, line or text in a frame."""

    kind: str  # 'box', 'cylinder' (along z), 'sphere', 'line' or 'text' (facing the camera).
    size: Vector  # Size (m) along x, y and z, where x is the line width and z is the text height.
    color: Color
    pose: Pose = ORIGIN  # Pose of the center of the shape.
    text: str = ''
    points: tuple[Vector, ...] = ()  # Points (m) on a line.


class SceneObject(NamedTuple):
    """Shapes that move together."""

    shapes: tuple[Shape, ...]
    pose: Pose  # Pose of the shapes' frame in the fixed frame.
    label: str = ''  # Text beside the axes of the frame. Without text, the axes are hidden.


class RobotShapes(NamedTuple):
    """The visible parts of a robot."""

    root: str  # Name of the link without a parent.
    links: dict[str, tuple[Shape, ...]]  # Shapes in the frame of each link.
    skipped: frozenset[str] = frozenset()  # Kinds of geometry that cannot be drawn.


class Markers:
    """The current markers. Times (ns) come from a monotonic clock."""

    def __init__(self) -> None:
        # Frame, shape and expiration time (ns) of each marker, by topic, namespace and ID.
        self._shown: dict[tuple[str, str, int], tuple[str, Shape, float]] = {}

    def update(self, topic: str, message: Marker, now: int) -> None:
        """Add, change or remove a marker, or raise ValueError if the marker cannot be drawn."""
        if message.action == Marker.DELETEALL:
            self._shown = {key: shown for key, shown in self._shown.items() if key[0] != topic}
        key = (topic, message.ns, message.id)
        self._shown.pop(key, None)
        if message.action == Marker.ADD:
            end = now + (nanoseconds_of(message.lifetime) or inf)
            # Like rviz2, the page accepts frame names with a leading slash.
            frame = message.header.frame_id.removeprefix('/')
            self._shown[key] = (frame, shape_of(message), end)

    def objects(self, now: int, pose_of: Callable[[str], Pose | None]) -> dict[str, SceneObject]:
        """Return all markers in known frames as objects keyed by name. Remove expired markers."""
        self._shown = {key: shown for key, shown in self._shown.items() if now < shown[2]}
        return {f'{topic}/{namespace}/{number}': SceneObject((shape,), pose)
                for (topic, namespace, number), (frame, shape, _) in self._shown.items()
                if (pose := pose_of(frame)) is not None}


def is_drawable(*numbers: float) -> bool:
    """Return whether the absolute value of each number is at most MAX_NUMBER."""
    return all(abs(number) <= MAX_NUMBER for number in numbers)


def shape_of(message: Marker) -> Shape:
    """Return the shape of a marker, or raise ValueError if the marker cannot be drawn."""
    if message.type not in MARKER_KINDS:
        name = MARKER_TYPES.get(message.type, 'unknown')
        raise ValueError(f'the page cannot draw markers of type {name}')
    pose = read_pose(message.pose.position, message.pose.orientation)
    size = read_vector(message.scale)
    color = (message.color.r, message.color.g, message.color.b, message.color.a)
    points = tuple(map(read_vector, message.points))
    if not is_drawable(*size, *color, *chain(*pose), *chain(*points)):
        raise ValueError('it contains a number that is too large or not finite')
    return Shape(MARKER_KINDS[message.type], size, color, pose, message.text, points)


def robot_shapes(description: str) -> RobotShapes:
    """Return the shapes in a robot description, or raise ValueError if the URDF is invalid."""
    try:
        robot = read_urdf(description)
    except ElementTree.ParseError as error:
        raise ValueError(f'robot_description is not valid XML: {error}') from None
    children = {joint.child for joint in robot.joints}
    roots = [name for name in robot.links if name not in children]
    if len(roots) != 1:
        raise ValueError(f'robot_description must have one root link, but has {roots}')
    colors = {name: _color(rgba) for name, rgba in robot.colors.items()}
    links = {name: _link_shapes(visuals, colors) for name, visuals in robot.links.items()}
    kinds = {visual.kind for visuals in robot.links.values() for visual in visuals}
    return RobotShapes(roots[0], links, frozenset(kinds.difference(SOLIDS, {''})))


def _link_shapes(visuals: Sequence[Visual], colors: Mapping[str, Color]) -> tuple[Shape, ...]:
    """
    Return the shapes of a link in the colors that urdfdom and rviz2 give them.

    A visual without a material, or with an empty material name, has the color of the first visual.
    """
    shapes: list[Shape] = []
    first_color = None
    for number, visual in enumerate(visuals):
        name = visual.material
        if name is None:
            break  # urdfdom ignores the rest of a link after a material without a name.
        color = colors.get(name)
        if number == 0:
            first_color = color if name or not visual.color else _color(visual.color)
        color = (color or RED) if first_color and name else (first_color or RED)
        if visual.kind in SOLIDS:
            shapes.append(Shape(visual.kind, _size(visual), color, visual.pose))
    if not is_drawable(*chain(*(chain(shape.size, *shape.pose) for shape in shapes))):
        raise ValueError('robot_description contains a number that is too large')
    return tuple(shapes)


def _color(rgba: Sequence[float]) -> Color:
    if len(rgba) != 4 or not is_drawable(*rgba):
        raise ValueError('rgba of <color> is ' + repr(' '.join(f'{value:g}' for value in rgba)))
    red, green, blue, alpha = rgba
    return red, green, blue, alpha


def _size(visual: Visual) -> Vector:
    """Return the extent (m) of a solid along its x, y and z axes."""
    if visual.kind == 'box':
        x, y, z = visual.size
        return x, y, z
    diameter = 2.0 * visual.size[0]
    return diameter, diameter, visual.size[1] if visual.kind == 'cylinder' else diameter
