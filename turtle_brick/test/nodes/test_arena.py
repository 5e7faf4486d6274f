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

"""The arena in a live graph: a fall by its stamps, its services, its markers."""

from math import inf, nan, pi, sqrt
from threading import Event

from live_graph import graph, PATIENCE
import pytest
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger
from tf2_ros import TransformBroadcaster
from turtle_brick.arena import Arena
from turtle_brick.core.geometry import from_pitch, from_yaw, multiply, Pose
from turtle_brick.core.parameters import load
from turtle_brick.core.time_steps import NANO, nanoseconds_of
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.physics import Phase
from turtle_brick.ros.tf import latest, OLDEST, transform_message
from turtle_brick_interfaces.srv import Place
from turtle_referee.domains import reserved_domain
from visualization_msgs.msg import Marker, MarkerArray

PARAMETERS = load()
HALF_HEIGHT = PARAMETERS.brick_size[2] / 2.0
HINGE = PARAMETERS.platform_height - PARAMETERS.platform_thickness
LEVEL = (5.0, 5.0, 0.0, 0.0)


class PlatformBroadcaster(Node):
    """A platform that anybody could have: its pose in the world, 100 times per second."""

    def __init__(self, **node_options):
        """Stand level at the middle of the arena."""
        super().__init__('platform', **node_options)
        self.pose = LEVEL
        self.velocity = 0.0
        self.broadcaster = TransformBroadcaster(self)
        self.timer = self.create_timer(0.01, self.on_timer)

    def on_timer(self):
        """Say where it is."""
        x, y, yaw, tilt = self.pose
        self.pose = (x + 0.01 * self.velocity, y, yaw, tilt)
        pose = Pose((x, y, HINGE), multiply(from_yaw(yaw), from_pitch(tilt)))
        self.broadcaster.sendTransform(transform_message(
            'world', 'platform', pose, self.get_clock().now().to_msg()))


class Bench:
    """The arena, a platform, and somebody who looks and asks."""

    def __init__(self, live):
        """Bring them up."""
        self.live = live
        self.arena = live.add_arena()
        self.platform = live.add(PlatformBroadcaster, parameters=False)
        self.bricks = live.record_transforms('brick')
        self.until(lambda: self.bricks.messages and self.world.platform, 'the arena is up')

    @property
    def world(self):
        """Return the arena's physics."""
        return self.arena.world

    def until(self, condition, what):
        """Wait until something is so, or until the brick is in a phase."""
        if isinstance(condition, Phase):
            phase, condition = condition, lambda: self.world.phase is phase
        self.live.wait_for(condition, PATIENCE, what)

    def place(self, x, y, z):
        """Place the brick; return the response."""
        request = Place.Request()
        request.location.x, request.location.y, request.location.z = (
            float(x), float(y), float(z))
        return self.live.call('place', Place, request)

    def drop(self):
        """Drop the brick; return the response."""
        return self.live.call('drop', Trigger)

    def stand(self, pose):
        """Let the platform be somewhere, and wait until the arena sees it there."""
        self.platform.pose = pose
        x, y, yaw, tilt = pose
        seen = Pose((x, y, HINGE), multiply(from_yaw(yaw), from_pitch(tilt)))
        self.until(lambda: self.world.platform and self.world.platform.pose.position
                   == seen.position and self.world.platform.pose.orientation == pytest.approx(
                       seen.orientation), f'the arena sees the platform at {pose}')


@pytest.fixture(scope='module')
def whole_bench():
    """Bring up the arena and a platform."""
    with reserved_domain() as domain, graph(domain) as live:
        yield Bench(live)


@pytest.fixture
def bench(whole_bench):
    """Let the platform stand level in the middle, and the brick hover at its start."""
    whole_bench.stand(LEVEL)
    assert whole_bench.place(*PARAMETERS.brick_start).success
    return whole_bench


def nanoseconds(transform):
    """Return a transform's stamp (ns)."""
    return nanoseconds_of(transform.header.stamp)


def test_fall_by_its_stamps(bench):
    """
    Every transform of a fall and rest is on the closed form for its stamp.

    While the test keeps the nodes from working, the samples are late, but none is lost, none is
    off the curve and the stamps stay 4 ms apart: simulated time does not drift.
    """
    assert bench.place(3.0, 4.0, 9.0).success
    bench.bricks.clear()
    bench.live.pass_time(0.05)
    assert bench.drop().success
    for stall in (0.02, 0.1, 0.5):
        Event().wait(stall)
        bench.live.pass_time(0.05)
    bench.until(Phase.GROUNDED, 'the brick on the ground')
    bench.live.pass_time(0.5)
    samples = [(nanoseconds(transform), transform.transform.translation)
               for transform in bench.bricks.messages]
    assert {late - early for (early, _), (late, _) in zip(samples, samples[1:])} == {4_000_000}
    heights = [translation.z for _, translation in samples]
    release = max(number for number, z in enumerate(heights) if z == 9.0)
    for stamp, translation in samples[release:]:
        time = (stamp - samples[release][0]) * NANO
        expected = max(9.0 - 0.5 * PARAMETERS.gravity_accel * time * time, HALF_HEIGHT)
        assert translation.z == pytest.approx(expected, abs=1e-6)
        assert (translation.x, translation.y) == (3.0, 4.0)
    took = (samples[heights.index(HALF_HEIGHT)][0] - samples[release][0]) * NANO
    assert took == pytest.approx(
        sqrt(2.0 * (9.0 - HALF_HEIGHT) / PARAMETERS.gravity_accel), abs=0.008)
    assert {transform.header.frame_id for transform in bench.bricks.messages} == {'world'}


def test_250_transforms_per_second(bench):
    """By when they are published, hovering as well."""
    assert bench.live.rates([bench.bricks], 750) == [pytest.approx(250.0, abs=1.0)]


def test_place_refuses_what_cannot_be(bench):
    """The refusal names the value, and nothing changes."""
    for location, word in (
            ((nan, 1.0, 1.0), 'nan'), ((1.0, inf, 1.0), 'inf'), ((1.0, 1.0, -inf), 'inf'),
            ((1.0, 1.0, -0.5), '-0.5'), ((1.0, 1.0, HALF_HEIGHT - 1e-6), 'ground')):
        response = bench.place(*location)
        assert not response.success
        assert word in response.message
        assert bench.world.brick == PARAMETERS.brick_start
        assert bench.world.phase is Phase.HOVERING


def test_drop_refuses_what_does_not_hover(bench):
    """The refusal says what the brick does instead; placing works at every phase."""
    def refused(why):
        response = bench.drop()
        return not response.success and why in response.message

    assert bench.place(7.0, 7.0, 3.0).success and bench.drop().success
    assert refused('already falling')
    bench.until(Phase.GROUNDED, 'the brick on the ground')
    assert refused('on the ground')
    assert bench.place(5.2, 5.0, 3.0).success and bench.drop().success
    assert bench.place(5.2, 5.0, 3.0).success and bench.world.phase is Phase.HOVERING
    assert bench.drop().success
    bench.until(Phase.RIDING, 'the brick on the platform')
    assert refused('on the platform')
    bench.platform.pose = (5.0, 5.0, 0.0, 0.6)
    bench.until(Phase.FLOATING, 'the brick off the platform')
    assert bench.drop().success
    bench.until(Phase.GROUNDED, 'the brick on the ground')
    assert bench.place(5.0, 5.0, 3.0).success
    assert bench.world.brick == (5.0, 5.0, 3.0)


def test_rides_with_a_platform_that_drives(bench):
    """
    A riding brick is broadcast where it came to lie on the platform, once per step.

    Its place in the world is that of the platform that was heard of last.
    """
    bench.stand((1.0, 5.0, 0.0, 0.0))
    assert bench.place(1.2, 5.1, 3.0).success and bench.drop().success
    bench.until(Phase.RIDING, 'the brick on the platform')
    bench.bricks.clear()
    bench.platform.velocity = 3.0
    bench.until(lambda: bench.platform.pose[0] > 8.0, 'the platform at the other end')
    bench.platform.velocity = 0.0
    bench.stand((8.0, 5.0, 0.0, 0.0))
    riding = [transform for transform in bench.bricks.messages
              if transform.header.frame_id == 'platform']
    assert len(riding) > 400 and riding == bench.bricks.messages[-len(riding):]
    for transform in riding:
        place = transform.transform.translation
        assert (place.x, place.y, place.z) == pytest.approx(
            (0.2, 0.1, PARAMETERS.platform_thickness + HALF_HEIGHT), abs=1e-9)
    assert {nanoseconds(later) - nanoseconds(earlier)
            for earlier, later in zip(riding, riding[1:])} == {4_000_000}
    assert bench.world.brick == pytest.approx(
        (8.2, 5.1, PARAMETERS.platform_height + HALF_HEIGHT), abs=1e-9)


def test_inclined_like_the_platform(bench):
    """The brick's frame has the platform's inclination, hovering as well."""
    for yaw, tilt in ((0.0, 0.5), (pi / 2.0, -0.3), (2.0, 0.0)):
        bench.platform.pose = (5.0, 5.0, yaw, tilt)
        expected = multiply(multiply(from_yaw(yaw), from_pitch(tilt)), from_yaw(-yaw))

        def inclined():
            q = bench.bricks.last.transform.rotation
            return abs(q.x * expected[0] + q.y * expected[1] + q.z * expected[2]
                       + q.w * expected[3]) > 1.0 - 1e-12

        bench.until(inclined, f'inclined by {tilt} towards {yaw}')


def test_markers(bench):
    """Late joiners get the walls around the arena, and the brick in its own frame."""
    latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    walls = bench.live.record('walls', MarkerArray, latched)
    bricks = bench.live.record('brick_marker', Marker, latched)
    bench.until(lambda: walls.messages and bricks.messages, 'the latched markers')
    edges = set()
    for wall in walls.last.markers:
        assert wall.header.frame_id == 'world'
        assert wall.type == Marker.CUBE and wall.color.a == 1.0
        assert wall.scale.z == PARAMETERS.wall_height
        assert wall.pose.position.z == PARAMETERS.wall_height / 2.0
        for name, position, scale in (('x', wall.pose.position.x, wall.scale.x),
                                      ('y', wall.pose.position.y, wall.scale.y)):
            for inner in (position - scale / 2.0, position + scale / 2.0):
                if scale < 1.0 and min(abs(inner), abs(inner - ARENA_SIZE)) < 1e-5:
                    edges.add((name, round(inner)))
    assert edges == {('x', 0), ('x', 11), ('y', 0), ('y', 11)}
    brick = bricks.messages[0]
    assert brick.header.frame_id == 'brick' and brick.frame_locked
    assert (brick.header.stamp.sec, brick.header.stamp.nanosec) == (0, 0)
    assert (brick.scale.x, brick.scale.y, brick.scale.z) == PARAMETERS.brick_size
    assert brick.text == 'hovering'
    bricks.clear()
    bench.until(lambda: len(bricks.messages) >= 3, 'it is shown again')
    assert bricks.times[2] - bricks.times[1] == pytest.approx(1.0, abs=0.3)
    assert bricks.messages[2] == brick
    assert bench.drop().success
    bench.until(lambda: bricks.last.text == 'falling', 'it is shown to fall')
    assert bricks.last.color != brick.color


def test_a_platform_that_is_not_heard_of_any_more_is_absent(bench):
    """After 0.5 s, by the stamp of its last transform: the brick passes where it was."""
    assert bench.place(5.0, 5.0, 2.0).success
    bench.platform.timer.cancel()
    last = latest(bench.arena.tf_buffer, 'platform')
    bench.until(lambda: bench.world.platform is None, 'the platform is absent')
    assert bench.arena.get_clock().now().nanoseconds - nanoseconds(last) >= OLDEST
    assert bench.drop().success
    bench.until(Phase.GROUNDED, 'the brick on the ground')
    assert bench.world.brick == (5.0, 5.0, HALF_HEIGHT)
    bench.platform.timer.reset()
    bench.until(lambda: bench.world.platform, 'it is back')


def test_simulated_time(domain_id, capfd):
    """With use_sim_time the fall goes by /clock, and on from now where that jumps."""
    with graph(domain_id) as live:
        arena = live.add(Arena, '-p', 'use_sim_time:=true')
        bricks = live.record_transforms('brick')
        publisher = live.publisher('/clock', Clock)
        now = 50_000_000_000

        def advance(step):
            nonlocal now
            now += step
            message = Clock()
            message.clock.sec, message.clock.nanosec = divmod(now, 1_000_000_000)
            publisher.publish(message)
            live.wait_for(lambda: arena.get_clock().now().nanoseconds == now, PATIENCE,
                          'the clock arrives')

        def seen():
            # The timer and the steps each have a phase of 4 ms, and the clock stands still here.
            return bricks.messages and abs(now - nanoseconds(bricks.last)) < 8_000_000

        def go_on():
            live.wait_for(lambda: seen() or advance(1_000_000), PATIENCE, 'the steps up to now')

        go_on()
        arena.world.brick = (1.0, 1.0, 9.0)
        arena.world.release()
        release = nanoseconds(bricks.last) + 4_000_000
        bricks.clear()
        for step in (1, 30, 7, 100, 13, 400):
            advance(step * 1_000_000)
            go_on()
        for number, transform in enumerate(bricks.messages):
            assert nanoseconds(transform) == release + number * 4_000_000
            time = number * 0.004
            assert transform.transform.translation.z == pytest.approx(
                9.0 - 0.5 * PARAMETERS.gravity_accel * time * time, abs=1e-9)
        assert number >= 136
        for jump, words in ((-5.0, 'set back by'), (3.0, 'nothing ran for')):
            z = bricks.last.transform.translation.z
            bricks.clear()
            capfd.readouterr()
            advance(round(jump * 1e9))
            go_on()
            assert 0.0 <= z - bricks.messages[0].transform.translation.z < 0.1
            (warning,) = [line for line in capfd.readouterr().err.splitlines() if 'WARN' in line]
            assert words in warning and f'{abs(jump):g}' in warning
