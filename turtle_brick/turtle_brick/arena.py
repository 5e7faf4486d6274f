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
    world -> brick: the brick's center, once per step of the physics, 250 times per second; while
        the brick rides platform -> brick instead, so that it moves with the platform exactly

Publishes:
    walls (visualization_msgs/MarkerArray, latched): the boundary of the arena
    brick_marker (visualization_msgs/Marker, latched): the brick in its own frame, with its phase
        as text and color; once per second and when the phase changes. The page in the browser
        takes the phase from that text, which rviz2 does not show
    brick_state (std_msgs/String, latched): hovering, falling, riding, floating or grounded;
        published at the start and when it changes

Services:
    place (turtle_brick_interfaces/Place): let the brick hover at a point of the world (m)
    drop (std_srvs/Trigger): let a hovering or floating brick fall

Subscribes:
    /tf, /tf_static: the frame platform, whatever robot it belongs to

Parameters, read-only:
    gravity_accel (double, m/s^2): acceleration due to gravity
    platform_radius, platform_thickness (double, m): the platform that the brick can land on
    brick_size (double[3], m): size of the brick along its own x, y and z
    brick_start (double[3], m): where the center of the brick hovers at first, in the world
    wall_height (double, m): height of the walls
"""

from time import monotonic
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.time import Time
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_ros import Buffer, TransformBroadcaster
from turtle_brick.core.geometry import Color, Pose, Vector
from turtle_brick.core.parameters import ArenaParameters
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.time_steps import due_time, SECONDS_PER_NS, StepClock
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.physics import Phase, STEP_NS, World
from turtle_brick.ros.node_main import init, spin
from turtle_brick.ros.node_parameters import declare_parameters
from turtle_brick.ros.tf import (BRICK, GuardedListener, LATCHED, PLATFORM, recent_pose,
                                 transform_message, WORLD)
from turtle_brick_interfaces.srv import Place
from visualization_msgs.msg import Marker, MarkerArray

MARKER_PERIOD = 1.0
"""Time (s) after which the brick's marker is published again: rviz2 drops for good a marker that
arrives before its frame is known, as may happen during discovery."""

WALL_THICKNESS = 0.1
"""Thickness of the walls (m), which stand outside the arena."""

WALL_COLOR: Color = (0.55, 0.62, 0.72, 1.0)

BRICK_COLORS: dict[Phase, Color] = {
    Phase.HOVERING: (0.80, 0.25, 0.15, 1.0),
    Phase.FALLING: (1.00, 0.50, 0.00, 1.0),
    Phase.RIDING: (0.20, 0.70, 0.25, 1.0),
    Phase.FLOATING: (0.65, 0.35, 0.85, 1.0),
    Phase.GROUNDED: (0.45, 0.30, 0.25, 1.0),
}
"""The color tells what the brick does."""


class Arena(Node):
    """Simulate the environment of the robot."""

    def __init__(self, **node_options: Any) -> None:
        """
        Let the brick hover at its start.

        :param node_options: passed on to rclpy.node.Node
        :raises ParameterError: a parameter is missing or inadmissible
        """
        super().__init__('arena', **node_options)
        parameters = declare_parameters(self, ArenaParameters)
        self.world = World.from_parameters(parameters)
        self.phase = self.world.phase
        """The brick's phase at the last step."""
        self.step_clock = StepClock(STEP_NS)
        self.last_run = monotonic()
        """When the physics ran last, by a clock that nobody sets (s)."""
        self.is_answering = False
        """Whether the answer to `drop` may still be on its way out."""

        self.tf_buffer = Buffer()
        self.tf_listener = GuardedListener(self.tf_buffer, self)
        self.tf_broadcaster = TransformBroadcaster(self)

        self.walls_publisher = self.create_publisher(MarkerArray, 'walls', LATCHED)
        self.walls_publisher.publish(walls(ARENA_SIZE, parameters.wall_height))
        self.marker_publisher = self.create_publisher(Marker, 'brick_marker', LATCHED)
        self.state_publisher = self.create_publisher(String, 'brick_state', LATCHED)
        self.publish_marker()
        self.publish_state()

        place = self.create_service(Place, 'place', self.on_place)
        drop = self.create_service(Trigger, 'drop', self.on_drop)
        self.get_logger().info('\n  '.join((
            'To place the brick and to drop it:',
            *commands(place.service_name, drop.service_name, parameters.brick_start))))

        self.create_timer(MARKER_PERIOD, self.publish_marker)
        self.timer = self.create_timer(STEP_NS * SECONDS_PER_NS, self.on_timer)

    def on_place(self, request: Place.Request, response: Place.Response) -> Place.Response:
        """Place the brick, or say why it can't be there."""
        location = (request.location.x, request.location.y, request.location.z)
        try:
            self.world.brick = location
        except ValueError as error:
            response.message = str(error)
        else:
            response.success = True
            response.message = 'the brick hovers at ({:g}, {:g}, {:g})'.format(*location)
        return response

    def on_drop(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Let the brick fall from the first step after the answer on, or say why it can't."""
        self.on_timer()  # What is due already shows the brick as it was before.
        try:
            self.world.release()
        except ValueError as error:
            response.message = str(error)
        else:
            response.success = True
            response.message = 'the brick falls from ({:g}, {:g}, {:g})'.format(*self.world.brick)
            self.is_answering = True
        return response

    def on_timer(self) -> None:
        """Take every step that is due, and broadcast where the brick was at each of them."""
        now = self.get_clock().now().nanoseconds
        if now == 0:
            return  # Simulated time that has not begun.
        # A brick that rides is a step ahead: its latest transform is then no older than the
        # platform's, and a lookup of the latest sees both at one instant.
        ahead = STEP_NS if self.world.phase is Phase.RIDING else 0
        instants = self.step_clock.due(now + ahead, due_time(self.timer, now))
        jump = self.step_clock.jump * SECONDS_PER_NS
        stood, self.last_run = monotonic() - self.last_run, monotonic()
        if jump:
            what = ('The clock was set back by' if jump < 0.0 else
                    'This node was stopped, or the machine too busy to run it, for'
                    if stood > jump / 2.0 else 'The clock went ahead by')
            self.get_logger().warning(f'{what} {abs(jump):.3g} s: the physics goes on from now')
        if not instants:
            return
        # By now the answer is out. Where that took long, only the latest step is not before it.
        begin = instants[-1] if self.is_answering else instants[0]
        self.is_answering = False
        self.tf_broadcaster.sendTransform(
            [self.step(instant, is_held=instant < begin) for instant in instants])
        if self.world.phase is not self.phase:
            self.phase = self.world.phase
            self.get_logger().info('The brick is {} at ({:.2f}, {:.2f}, {:.2f})'.format(
                self.phase.value, *self.world.brick))
            self.publish_marker()
            self.publish_state()

    def step(self, instant: int, is_held: bool) -> TransformStamped:
        """Take the step that belongs to an instant (ns), or hold; return where the brick is."""
        pose = recent_pose(self.tf_buffer, PLATFORM, instant)
        self.world.platform = Platform(pose) if pose else None
        if not is_held:
            self.world.step()
        stamp = Time(nanoseconds=instant).to_msg()
        if self.world.pose_on_platform is not None:
            return transform_message(PLATFORM, BRICK, self.world.pose_on_platform, stamp)
        return transform_message(
            WORLD, BRICK, Pose(self.world.brick, self.world.orientation), stamp)

    def publish_marker(self) -> None:
        """Show the brick and its phase."""
        self.marker_publisher.publish(brick_marker(self.phase, self.world.size))

    def publish_state(self) -> None:
        """Publish the state of the brick."""
        self.state_publisher.publish(String(data=self.phase.value))


def brick_marker(phase: Phase, size: Vector) -> Marker:
    """Return the brick (m) in its own frame, with its phase as text and color."""
    marker = box(BRICK, 'brick', 0, (0.0, 0.0, 0.0), size, BRICK_COLORS[phase])
    marker.text = phase.value
    marker.frame_locked = True
    return marker


def commands(place: str, drop: str, brick: Vector) -> tuple[str, str]:
    """Return what to type to place the brick (m) and to drop it, by the names of the services."""
    x, y, z = brick
    return (f'ros2 service call {place} turtle_brick_interfaces/srv/Place '
            f'"{{location: {{x: {x:g}, y: {y:g}, z: {z:g}}}}}"',
            f'ros2 service call {drop} std_srvs/srv/Trigger')


def box(frame: str, namespace: str, number: int, center: Vector, size: Vector, color: Color
        ) -> Marker:
    """Return the marker of a box in a frame (m), without a stamp: it holds at any time."""
    marker = Marker(ns=namespace, id=number, type=Marker.CUBE, action=Marker.ADD)
    marker.header.frame_id = frame
    position = marker.pose.position
    position.x, position.y, position.z = center
    marker.scale.x, marker.scale.y, marker.scale.z = size
    marker.color.r, marker.color.g, marker.color.b, marker.color.a = color
    return marker


def walls(size: float, height: float) -> MarkerArray:
    """Return the walls around the square from (0, 0) to (size, size) of the world (m)."""
    middle, outside = size / 2.0, WALL_THICKNESS / 2.0
    along_x = (size + 2.0 * WALL_THICKNESS, WALL_THICKNESS, height)
    along_y = (WALL_THICKNESS, size, height)
    places = ((middle, -outside, along_x), (middle, size + outside, along_x),
              (-outside, middle, along_y), (size + outside, middle, along_y))
    return MarkerArray(markers=[
        box(WORLD, 'walls', number, (x, y, height / 2.0), scale, WALL_COLOR)
        for number, (x, y, scale) in enumerate(places)])


def main(args: list[str] | None = None) -> None:
    """Run the node until it is interrupted."""
    with init(args):
        spin(Arena())


if __name__ == '__main__':
    main()
