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
arena: simulate the brick, broadcast its pose, and publish markers for the brick and the walls.

Broadcasts:
    world -> brick: pose of the brick (origin at its center) at each physics step (250 Hz)
    platform -> brick: replaces world -> brick while the brick rides on the platform, so that the
        brick does not lag behind the platform in tf2 and rviz2; view_frames then shows platform as
        the parent of brick

Publishes, latched:
    walls (visualization_msgs/MarkerArray): walls around the arena
    brick_marker (visualization_msgs/Marker): the brick, in a color that shows its state;
        published every second and when the state changes
    brick_state (std_msgs/String): hovering, falling, riding, floating or grounded; published at
        the start and when the state changes

Services:
    place (turtle_brick_interfaces/Place): move the brick to a point (m) in the world frame
    drop (std_srvs/Trigger): release a hovering or floating brick

Subscribes:
    /tf, /tf_static: pose of the platform

Parameters, read-only (the arena declares all parameters in config/turtle.yaml and uses these):
    gravity_accel (float, m/s^2): acceleration of a falling or sliding brick
    platform_radius (float, m): distance from the platform's axis within which a brick lands
    platform_thickness (float, m): distance from the origin of the platform frame to its top
    brick_size (three floats, m): length, width and height of the brick
    brick_start (three floats, m): initial location of the brick's center in the world frame
    wall_height (float, m): height of the walls
"""

from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.time import Time
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_ros import Buffer, TransformBroadcaster
from turtle_brick.core.geometry import Color, Pose, Vector
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.tilting_platform import Platform
from turtle_brick.core.time_steps import SECONDS_PER_NS, StepClock
from turtle_brick.core.turtlesim_arena import ARENA_SIZE, nearest_in_arena
from turtle_brick.physics import BrickState, STEP_NS, World
from turtle_brick.ros.node_main import declare_parameters, run_node
from turtle_brick.ros.tf import (BRICK, due_time, GuardedListener, LATCHED, PLATFORM, pose_of,
                                 recent_world_to, transform_message, WARNING_PERIOD, WORLD)
from turtle_brick_interfaces.srv import Place
from visualization_msgs.msg import Marker, MarkerArray

LOOKAHEAD_NS = STEP_NS
"""Time (ns) by which a riding brick is simulated ahead of the clock, at most one step. Viewers
look up the latest time common to all transforms from world to the brick, as `latest_world_to` in
ros/tf.py does. The platform's transforms determine this time, so the brick never lags behind."""

MARKER_PERIOD = 1.0
"""Interval (s) for republishing the brick marker, which rviz2 ignores in an unknown frame."""

WALL_THICKNESS = 0.1
"""Thickness (m) of the walls."""

WALL_COLOR: Color = (0.55, 0.62, 0.72, 1.0)

BRICK_COLORS: dict[BrickState, Color] = {
    BrickState.HOVERING: (0.80, 0.25, 0.15, 1.0),
    BrickState.FALLING: (1.00, 0.50, 0.00, 1.0),
    BrickState.RIDING: (0.20, 0.70, 0.25, 1.0),
    BrickState.FLOATING: (0.65, 0.35, 0.85, 1.0),
    BrickState.GROUNDED: (0.45, 0.30, 0.25, 1.0),
}


class Arena(Node):
    """Simulate the brick, broadcast its pose, and publish markers for the brick and the walls."""

    def __init__(self, **node_options: Any) -> None:
        super().__init__('arena', **node_options)
        parameters = declare_parameters(self)

        self.world = make_world(parameters)
        self.brick_state = self.world.state
        """State last published on `brick_state`."""
        self.step_clock = StepClock(STEP_NS)
        self.holds_brick_for_one_batch = False
        """Whether the next batch, which may precede `drop`'s response, keeps the brick still."""

        self.tf_buffer = Buffer()
        self.tf_listener = GuardedListener(self.tf_buffer, self)
        self.tf_broadcaster = TransformBroadcaster(self)

        self.walls_publisher = self.create_publisher(MarkerArray, 'walls', LATCHED)
        self.marker_publisher = self.create_publisher(Marker, 'brick_marker', LATCHED)
        self.state_publisher = self.create_publisher(String, 'brick_state', LATCHED)
        self.walls_publisher.publish(wall_markers(ARENA_SIZE, parameters.wall_height))
        self.publish_marker()
        self.publish_state()

        place = self.create_service(Place, 'place', self.on_place)
        drop = self.create_service(Trigger, 'drop', self.on_drop)
        x, y, z = parameters.brick_start
        self.get_logger().info(
            'To place and drop the brick:\n'
            f'  ros2 service call {place.service_name} turtle_brick_interfaces/srv/Place '
            f'"{{location: {{x: {x:g}, y: {y:g}, z: {z:g}}}}}"\n'
            f'  ros2 service call {drop.service_name} std_srvs/srv/Trigger')

        self.create_timer(MARKER_PERIOD, self.publish_marker)
        self.timer = self.create_timer(STEP_NS * SECONDS_PER_NS, self.on_timer)

    def on_place(self, request: Place.Request, response: Place.Response) -> Place.Response:
        """Place the brick, or respond to the `place` request with the reason for refusing it."""
        location = (request.location.x, request.location.y, request.location.z)
        try:
            self.world.brick = location
        except ValueError as error:
            response.message = str(error)
            self.get_logger().warning(f'Refused to place the brick: {error}')
        else:
            response.success = True
            response.message = 'the brick hovers at ({:g}, {:g}, {:g})'.format(*location)
            if nearest_in_arena(*location[:2]) != location[:2]:
                response.message += ', outside the arena'
        return response

    def on_drop(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Release the brick, or respond to the `drop` request with the reason for refusing it."""
        try:
            self.world.release()
        except ValueError as error:
            response.message = str(error)
            self.get_logger().warning(f'Refused to drop the brick: {error}')
        else:
            response.success = True
            response.message = 'the brick falls from ({:g}, {:g}, {:g})'.format(*self.world.brick)
            self.holds_brick_for_one_batch = True
        return response

    def on_timer(self) -> None:
        """Execute all due physics steps, and publish the brick's transforms and new state."""
        now = self.get_clock().now().nanoseconds
        if now == 0:
            return  # Simulated time has not started.
        transforms = self.advance(now, due_time(self.timer, now))
        if transforms:
            self.tf_broadcaster.sendTransform(transforms)
            self.publish_changes()
            self.log_gap()

    def advance(self, now: int, start: int) -> list[TransformStamped]:
        """
        Execute all physics steps due by `now` (ns), and return a brick transform for each step.

        A brick can land on a platform whose transforms stopped arriving up to MAX_AGE_NS ago.

        :param start: time (ns) of the first step, used only when the step clock (re)starts
        """
        ahead = LOOKAHEAD_NS if self.world.state is BrickState.RIDING else 0
        transforms = []
        for time in self.step_clock.due(now + ahead, start):
            found = recent_world_to(self.tf_buffer, PLATFORM, time)
            self.world.platform = Platform(pose_of(found.transform)) if found else None
            if not self.holds_brick_for_one_batch:
                self.world.step()
            transforms.append(self.brick_transform(time))
        if transforms:
            self.holds_brick_for_one_batch = False
        return transforms

    def brick_transform(self, time: int) -> TransformStamped:
        """Return the transform of the brick after the physics step at a given time (ns)."""
        stamp = Time(nanoseconds=time).to_msg()
        if self.world.pose_on_platform is not None:
            return transform_message(PLATFORM, BRICK, self.world.pose_on_platform, stamp)
        return transform_message(
            WORLD, BRICK, Pose(self.world.brick, self.world.orientation), stamp)

    def publish_changes(self) -> None:
        """Publish the brick's state and marker if the state changed."""
        if self.world.state is not self.brick_state:
            self.brick_state = self.world.state
            self.get_logger().info('The brick is {} at ({:.2f}, {:.2f}, {:.2f})'.format(
                self.brick_state.value, *self.world.brick))
            self.publish_marker()
            self.publish_state()

    def log_gap(self) -> None:
        """Log a gap in the physics steps."""
        if self.step_clock.jump:
            self.get_logger().warning(
                f'The clock advanced by {self.step_clock.jump * SECONDS_PER_NS:.3g} s since the '
                'last physics step, because it was set or the machine is overloaded. The '
                'simulation continues from the current time.',
                throttle_duration_sec=WARNING_PERIOD)

    def publish_marker(self) -> None:
        """Publish the marker of the brick."""
        self.marker_publisher.publish(brick_marker(self.brick_state, self.world.size))
        if self.count_publishers('brick_marker') > 1:
            self.get_logger().warning(
                'Another arena uses the same topics. Set ROS_DOMAIN_ID to a number that no one '
                'else uses, or start one arena with namespace:=NAME.', once=True)

    def publish_state(self) -> None:
        """Publish the state of the brick."""
        self.state_publisher.publish(String(data=self.brick_state.value))


def make_world(parameters: Parameters) -> World:
    """Return a world with the configured brick and platform, and a timestep of STEP_NS."""
    world = World(parameters.brick_start, parameters.gravity_accel, parameters.platform_radius,
                  STEP_NS * SECONDS_PER_NS)
    world.size, world.thickness = parameters.brick_size, parameters.platform_thickness
    return world


def brick_marker(state: BrickState, size: Vector) -> Marker:
    """Return a marker for a brick of a given size (m) in a given state."""
    marker = box_marker(BRICK, 'brick', 0, (0.0, 0.0, 0.0), size, BRICK_COLORS[state])
    marker.frame_locked = True
    return marker


def box_marker(frame: str, namespace: str, number: int, center: Vector, size: Vector,
               color: Color) -> Marker:
    """Return a box marker with a zero timestamp. All lengths are in meters."""
    marker = Marker(ns=namespace, id=number, type=Marker.CUBE, action=Marker.ADD)
    marker.header.frame_id = frame
    position = marker.pose.position
    position.x, position.y, position.z = center
    marker.scale.x, marker.scale.y, marker.scale.z = size
    marker.color.r, marker.color.g, marker.color.b, marker.color.a = color
    return marker


def wall_markers(size: float, height: float) -> MarkerArray:
    """Return markers for walls around the square from (0, 0) to (size, size). Lengths are in m."""
    middle, outside = size / 2.0, WALL_THICKNESS / 2.0
    along_x = (size + 2.0 * WALL_THICKNESS, WALL_THICKNESS, height)
    along_y = (WALL_THICKNESS, size, height)
    walls = ((middle, -outside, along_x), (middle, size + outside, along_x),
             (-outside, middle, along_y), (size + outside, middle, along_y))
    return MarkerArray(markers=[
        box_marker(WORLD, 'walls', number, (x, y, height / 2.0), scale, WALL_COLOR)
        for number, (x, y, scale) in enumerate(walls)])


def main(args: list[str] | None = None) -> None:
    """Run the arena until Ctrl-C or SIGTERM."""
    run_node(Arena, args)
