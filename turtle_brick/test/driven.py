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

"""Run nodes step by step in simulated time, with a simulated platform."""

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import Point
from live_nodes import LiveNodes
from rclpy.clock import ClockType
from rclpy.time import Time
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from turtle_brick.arena import Arena
from turtle_brick.catcher import CatcherNode
from turtle_brick.core.geometry import from_pitch, from_yaw, multiply, Pose
from turtle_brick.core.parameters import load
from turtle_brick.core.time_steps import NS_PER_SECOND
from turtle_brick.physics import BrickState
from turtle_brick.ros.tf import BRICK, PLATFORM, transform_message, WORLD
from turtle_brick_interfaces.srv import Place

PARAMETERS = load()

TICK_NS = 20_000_000
"""Time step (ns), equal to the catcher's period and to the duration of five physics steps."""

MAX_DURATION = 30.0
"""Timeout (s, simulated time) of SteppedGraph.until()."""


def record_published(publisher: Any) -> list[Any]:
    """Return a list that collects all messages sent by a publisher after this call."""
    messages: list[Any] = []
    publish = publisher.publish

    def record(message: Any) -> None:
        messages.append(message)
        publish(message)

    publisher.publish = record
    return messages


class SteppedGraph:
    """A graph whose callbacks are called by the test, so that no message is late or lost."""

    def __init__(self, live: LiveNodes, *node_types: type[CatcherNode]) -> None:
        self.live = live
        self.now = 50 * NS_PER_SECOND
        self.platform: tuple[float, ...] | None = (5.0, 5.0, 0.0, 0.0)
        """Position (m), yaw (rad) and tilt (rad) of the platform, or None without a platform."""
        self.bricks: list[Any] = []
        """All transforms of the brick."""
        self.nodes: list[Any] = [
            live.add(kind, '-p', 'use_sim_time:=true') for kind in (Arena, *node_types)]
        for node in self.nodes:
            for timer in node.timers:
                timer.cancel()
        self.arena, *self.catchers = self.nodes
        self.world = self.arena.world
        self.tick()

    def send_transforms(self, transforms: list[Any]) -> None:
        self.bricks += [one for one in transforms if one.child_frame_id == BRICK]
        for node in self.nodes:
            node.tf_listener.callback(TFMessage(transforms=transforms))

    def move(self, time: float) -> None:
        """Move the platform for a duration (s). Subclasses override this method."""

    def tick(self, by: int = TICK_NS, updates: bool = True) -> None:
        """Advance the time by a duration (ns), and update the nodes."""
        self.now += by
        self.move(by / NS_PER_SECOND)
        now = Time(nanoseconds=self.now, clock_type=ClockType.ROS_TIME)
        for node in self.nodes:
            node.get_clock().set_ros_time_override(now)
        if self.platform:
            x, y, yaw, tilt = self.platform
            self.send_transforms([transform_message(WORLD, PLATFORM, Pose(
                (x, y, PARAMETERS.platform_height - PARAMETERS.platform_thickness),
                multiply(from_yaw(yaw), from_pitch(tilt))), now.to_msg())])
        transforms = self.arena.advance(self.now, self.now)
        if transforms:
            self.send_transforms(transforms)
            self.arena.publish_changes()
            self.arena.log_gap()
        if updates:
            for catcher in self.catchers:
                catcher.update(self.now)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * NS_PER_SECOND / TICK_NS)):
            self.tick()

    def until(self, condition: Callable[[], Any] | BrickState, what: str = '') -> None:
        if isinstance(condition, BrickState):
            state, condition, what = condition, lambda: self.world.state is state, condition.value
        end = self.now + MAX_DURATION * NS_PER_SECOND
        while not condition():
            assert self.now < end, what
            self.tick()

    def place(self, x: float, y: float, z: float) -> Place.Response:
        return self.arena.on_place(
            Place.Request(location=Point(x=x, y=y, z=z)), Place.Response())

    def drop(self) -> Trigger.Response:
        return self.arena.on_drop(Trigger.Request(), Trigger.Response())
