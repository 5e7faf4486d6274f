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
arena: the walls, and a brick that can be placed and dropped.

Broadcasts:
    world -> brick, the brick's center, once per step of the physics, 250 times per second; while
        the brick rides, platform -> brick instead, which moves with the platform to the instant

Publishes:
    walls (visualization_msgs/MarkerArray, latched): the boundary of the arena
    brick_marker (visualization_msgs/Marker, latched): the brick, in its own frame; its text
        and its color tell what it does; again each second

Services:
    place (turtle_brick_interfaces/Place): put the brick somewhere, where it hovers
    drop (std_srvs/Trigger): let a hovering or floating brick fall

Subscribes:
    /tf, /tf_static: where the platform is, whatever robot it belongs to

Parameters: those of config/turtle.yaml, read-only; it uses gravity_accel, platform_radius,
platform_thickness, brick_size, brick_start and wall_height.
"""

import sys
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from std_srvs.srv import Trigger
from tf2_ros import Buffer
from tf2_ros import TransformBroadcaster
from turtle_brick.frames import BRICK
from turtle_brick.frames import is_old
from turtle_brick.frames import LATCHED
from turtle_brick.frames import latest
from turtle_brick.frames import OthersListener
from turtle_brick.frames import PLATFORM
from turtle_brick.frames import pose_of
from turtle_brick.frames import set_stamp
from turtle_brick.frames import set_transform
from turtle_brick.frames import WORLD
from turtle_brick.geometry import Pose
from turtle_brick.geometry import Vector
from turtle_brick.node_parameters import declare_parameters
from turtle_brick.physics import Phase
from turtle_brick.physics import STEP
from turtle_brick.physics import World
from turtle_brick.spinning import run
from turtle_brick.step_clock import due_instant
from turtle_brick.step_clock import StepClock
from turtle_brick.turtlesim_kinematics import ARENA_SIZE
from turtle_brick_interfaces.srv import Place
from visualization_msgs.msg import Marker
from visualization_msgs.msg import MarkerArray

REMINDER = 250
"""Steps after which the brick's marker is published again: rviz2 drops for good what reaches it
before the transform does, as may happen while it discovers the two."""

WALL_THICKNESS = 0.1
"""Thickness of the walls (m), which stand outside the arena."""

Color = tuple[float, float, float, float]
"""Red, green, blue and alpha, in [0, 1]."""

WALL_COLOR = (0.55, 0.62, 0.72, 1.0)

BRICK_COLORS = {
    Phase.HOVERING: (0.80, 0.25, 0.15, 1.0),
    Phase.FALLING: (1.00, 0.50, 0.00, 1.0),
    Phase.RIDING: (0.20, 0.70, 0.25, 1.0),
    Phase.FLOATING: (0.65, 0.35, 0.85, 1.0),
    Phase.GROUNDED: (0.45, 0.30, 0.25, 1.0),
}


class Arena(Node):
    """Simulate the environment of the robot."""

    def __init__(self, **node_options: Any) -> None:
        """
        Let the brick hover at its start.

        :param node_options: passed on to rclpy.node.Node
        :raises ParameterError: a parameter is missing or inadmissible
        """
        super().__init__('arena', **node_options)
        parameters = declare_parameters(self)
        self.world = World.from_parameters(parameters)
        self.clock_of_steps = StepClock(STEP)
        self.restarts = 0
        self.shown: Phase | None = None
        self.steps_shown = 0

        self.tf_buffer = Buffer(node=self)
        self.tf_listener = OthersListener(self.tf_buffer, self, BRICK)
        self.platform: TransformStamped | None = None
        self.platform_pose: Pose | None = None
        self.tf_broadcaster = TransformBroadcaster(self)
        self.transforms: list[TransformStamped] = []

        self.walls_publisher = self.create_publisher(MarkerArray, 'walls', LATCHED)
        self.walls_publisher.publish(walls(ARENA_SIZE, parameters.wall_height))
        self.marker = box(BRICK, 'brick', 0, Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)),
                          parameters.brick_size)
        self.marker.frame_locked = True
        self.marker_publisher = self.create_publisher(Marker, 'brick_marker', LATCHED)

        place = self.create_service(Place, 'place', self.on_place)
        drop = self.create_service(Trigger, 'drop', self.on_drop)
        x, y, z = parameters.brick_start
        self.commands = (
            f'ros2 service call {place.service_name} turtle_brick_interfaces/srv/Place '
            f'"{{location: {{x: {x:g}, y: {y:g}, z: {z:g}}}}}"',
            f'ros2 service call {drop.service_name} std_srvs/srv/Trigger')
        """What to type to place the brick and to drop it."""
        self.get_logger().info(
            '\n  '.join(('To place the brick and to drop it:', *self.commands)))
        self.timer = self.create_timer(STEP * 1e-9, self.on_timer)

    def on_place(self, request: Place.Request, response: Place.Response) -> Place.Response:
        """Put the brick somewhere, unless that can't be."""
        location = (request.location.x, request.location.y, request.location.z)
        try:
            self.world.brick = location
        except ValueError as error:
            response.success, response.message = False, str(error)
        else:
            response.success = True
            response.message = 'the brick hovers at ({:g}, {:g}, {:g})'.format(*location)
        return response

    def on_drop(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Let the brick fall from the next step on, unless it can't."""
        try:
            self.world.release()
        except ValueError as error:
            response.success, response.message = False, str(error)
        else:
            response.success = True
            response.message = 'the brick falls from ({:g}, {:g}, {:g})'.format(*self.world.brick)
        return response

    def on_timer(self) -> None:
        """Take every step that is due, and say where the brick was at each of them."""
        now = self.get_clock().now().nanoseconds
        if now == 0:
            return  # Simulated time that has not begun.
        # A brick that rides is a step ahead: with its latest transform no older than the
        # platform's, whoever looks both up sees them at one instant.
        ahead = STEP if self.world.phase is Phase.RIDING else 0
        instants = self.clock_of_steps.due(now + ahead, due_instant(self.timer, now))
        if self.clock_of_steps.restarts != self.restarts:
            self.restarts = self.clock_of_steps.restarts
            self.get_logger().warning('The clock has jumped: the physics goes on from now')
        if not instants:
            return
        self.look_at_platform()
        while len(self.transforms) < len(instants):
            self.transforms.append(TransformStamped(child_frame_id=BRICK))
        for instant, message in zip(instants, self.transforms):
            self.world.platform = self.platform_at(instant)
            self.world.step()
            self.say_where(instant, message)
        self.tf_broadcaster.sendTransform(self.transforms[:len(instants)])
        self.steps_shown += len(instants)
        if self.world.phase is not self.shown:
            self.show(self.world.phase)
        elif self.steps_shown >= REMINDER:
            self.publish_marker()

    def look_at_platform(self) -> None:
        """Take note of where the platform is, if there is news of it."""
        if self.tf_listener.news:
            self.tf_listener.news = False
            self.platform = latest(self.tf_buffer, PLATFORM)
            self.platform_pose = (
                pose_of(self.platform.transform) if self.platform is not None else None)

    def platform_at(self, instant: int) -> Pose | None:
        """Return where the platform is at an instant (ns), None if nothing recent tells."""
        if self.platform is None or is_old(self.platform, instant):
            return None
        return self.platform_pose

    def say_where(self, instant: int, message: TransformStamped) -> None:
        """Write into a message where the brick is at an instant (ns)."""
        place = self.world.on_platform
        set_stamp(message.header.stamp, instant)
        message.header.frame_id = WORLD if place is None else PLATFORM
        set_transform(message.transform,
                      place or Pose(self.world.brick, self.world.orientation))

    def show(self, phase: Phase) -> None:
        """Say what the brick does, and give it the color of that."""
        if self.shown is not None:
            self.get_logger().info(
                'The brick is {} at ({:.5g}, {:.5g}, {:.5g})'.format(
                    phase.value, *self.world.brick))
        self.shown = phase
        self.marker.text = phase.value
        set_color(self.marker, BRICK_COLORS[phase])
        self.publish_marker()

    def publish_marker(self) -> None:
        """Show the brick."""
        self.marker_publisher.publish(self.marker)
        self.steps_shown = 0


def set_color(marker: Marker, color: Color) -> None:
    """Give a marker a color."""
    marker.color.r, marker.color.g, marker.color.b, marker.color.a = color


def box(frame: str, namespace: str, number: int, pose: Pose, size: Vector) -> Marker:
    """Return the marker of a box with its center at a pose of a frame; no stamp: at any time."""
    marker = Marker()
    marker.header.frame_id = frame
    marker.ns = namespace
    marker.id = number
    marker.type = Marker.CUBE
    marker.action = Marker.ADD
    position, orientation = marker.pose.position, marker.pose.orientation
    position.x, position.y, position.z = pose.position
    orientation.x, orientation.y, orientation.z, orientation.w = pose.orientation
    marker.scale.x, marker.scale.y, marker.scale.z = size
    return marker


def walls(size: float, height: float) -> MarkerArray:
    """Return the walls around the square from (0, 0) to (size, size) of the world (m)."""
    middle, outside = size / 2.0, WALL_THICKNESS / 2.0
    long_side = size + 2.0 * WALL_THICKNESS
    along_x, along_y = (long_side, WALL_THICKNESS, height), (WALL_THICKNESS, size, height)
    markers = MarkerArray()
    for number, (x, y, scale) in enumerate((
            (middle, -outside, along_x), (middle, size + outside, along_x),
            (-outside, middle, along_y), (size + outside, middle, along_y))):
        wall = box(WORLD, 'walls', number,
                   Pose((x, y, height / 2.0), (0.0, 0.0, 0.0, 1.0)), scale)
        set_color(wall, WALL_COLOR)
        markers.markers.append(wall)
    return markers


def main(args: list[str] | None = None) -> int:
    """Run the node until it is told to stop."""
    return run(Arena, args)


if __name__ == '__main__':
    sys.exit(main())
