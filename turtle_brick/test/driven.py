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

"""The arena and a robot of the test's own, in a time that the test drives: no clock, no haste."""

from collections.abc import Callable
from time import monotonic
from typing import Any

from live_graph import LiveGraph, PATIENCE
from rclpy.node import Node
from rclpy.time import Time
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger
from tf2_ros import TransformBroadcaster
from turtle_brick.arena import Arena
from turtle_brick.core.geometry import from_pitch, from_yaw, multiply, Pose
from turtle_brick.core.parameters import load
from turtle_brick.core.time_steps import NANOSECONDS
from turtle_brick.physics import Phase, STEP
from turtle_brick.ros.tf import latest, PLATFORM, transform_message, WORLD
from turtle_brick_interfaces.srv import Place

PARAMETERS = load()

TICK = 20_000_000
"""By how much (ns) the time goes on at once: as long as the catcher's period, five steps."""

BEHIND = 2 * TICK + 2 * STEP
"""How far (ns) the arena may be behind: after a jump rclpy 7.1 calls a timer a few times too
often, and then it is not due for as many periods."""

LONGEST = 30.0
"""How long (s) anything may take in that time."""


AGAIN = 0.2
"""Time (s) after which what nobody seems to have heard is said again."""


class Stage:
    """
    The arena, perhaps the catcher, and a platform, in simulated time.

    The time goes on by a tick when all nodes have heard of the last and the arena has done what is
    due, however long that takes on a busy machine, and much sooner than the same time would pass.
    """

    def __init__(self, live: LiveGraph, *node_types: type[Node]) -> None:
        """Bring up the arena, and nodes of these types, with a level platform at (5, 5)."""
        self.live = live
        self.now = 50 * NANOSECONDS
        self.platform: tuple[float, ...] | None = (5.0, 5.0, 0.0, 0.0)
        """Where the platform is (m), its yaw and its tilt (rad); None: nobody says so."""
        self.nodes: list[Any] = [
            live.add(kind, '-p', 'use_sim_time:=true') for kind in (Arena, *node_types)]
        self.arena = self.nodes[0]
        self.broadcaster = TransformBroadcaster(live.listener)
        self.clock = live.publisher('/clock', Clock, readers=len(self.nodes))
        self.bricks = live.record_transforms('brick')
        self.tick()

    @property
    def world(self):
        """Return the arena's physics."""
        return self.arena.world

    @property
    def platform_pose(self) -> Pose:
        """Return the platform's pose in the world."""
        x, y, yaw, tilt = self.platform
        return Pose((x, y, PARAMETERS.platform_height - PARAMETERS.platform_thickness),
                    multiply(from_yaw(yaw), from_pitch(tilt)))

    def move(self, seconds: float) -> None:
        """Move the platform, as the time goes on."""

    def tick(self, by: int = TICK) -> None:
        """Let the time go on (ns), or jump, and every node do what is due."""
        self.now += by
        self.move(by / NANOSECONDS)
        stamp = Time(nanoseconds=self.now).to_msg()
        self.say(lambda: self.clock.publish(Clock(clock=stamp)), lambda node:
                 node.get_clock().now().nanoseconds == self.now)
        if self.platform:
            transform = transform_message(WORLD, PLATFORM, self.platform_pose, stamp)
            self.say(lambda: self.broadcaster.sendTransform(transform), lambda node:
                     (seen := latest(node.tf_buffer, PLATFORM)) and seen.header.stamp == stamp)
        if by > 0:
            self.live.wait_for(lambda: self.now - (self.arena.step_clock.last or 0) <= BEHIND,
                               PATIENCE, 'the steps up to now')
        self.live.hear()

    def say(self, send: Callable[[], None], is_heard: Callable[[Any], Any]) -> None:
        """Send what may get lost until all nodes have heard it."""
        sent = 0.0

        def all_hear() -> bool:
            nonlocal sent
            if monotonic() > sent + AGAIN:
                send()
                sent = monotonic()
            return all(map(is_heard, self.nodes))

        self.live.wait_for(all_hear, PATIENCE, 'all nodes to hear')

    def run(self, seconds: float) -> None:
        """Let a time (s) go by."""
        for _ in range(round(seconds * NANOSECONDS / TICK)):
            self.tick()

    def until(self, condition: Callable[[], Any] | Phase, what: str = '') -> None:
        """Let the time go on until something is so, or the brick is in a phase."""
        if isinstance(condition, Phase):
            phase, condition, what = condition, lambda: self.world.phase is phase, condition.value
        end = self.now + LONGEST * NANOSECONDS
        while not condition():
            assert self.now < end, what
            self.tick()

    def place(self, x: float, y: float, z: float) -> Place.Response:
        """Ask the arena to place the brick (m)."""
        request = Place.Request()
        request.location.x, request.location.y, request.location.z = (
            float(x), float(y), float(z))
        return self.live.call('place', Place, request)

    def drop(self) -> Trigger.Response:
        """Ask the arena to drop the brick."""
        return self.live.call('drop', Trigger)
