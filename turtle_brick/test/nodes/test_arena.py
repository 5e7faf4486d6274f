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

"""Test the arena in a live graph and in simulated time."""

from itertools import groupby
from math import nan, sqrt

from driven import PARAMETERS, SteppedGraph
from live_nodes import LATCHED, TIMEOUT
import pytest
from std_msgs.msg import String
from turtle_brick.arena import Arena, MARKER_PERIOD
from turtle_brick.core.geometry import from_pitch, from_yaw, multiply
from turtle_brick.core.time_steps import NS_PER_SECOND, SECONDS_PER_NS
from turtle_brick.core.turtlesim_arena import ARENA_SIZE
from turtle_brick.physics import BrickState, STEP_NS
from turtle_brick.ros.tf import MAX_AGE_NS, nanoseconds_of
from visualization_msgs.msg import Marker, MarkerArray

HALF_HEIGHT = PARAMETERS.brick_size[2] / 2.0


@pytest.fixture
def bench(live):
    return SteppedGraph(live)


def stamps_of_each_step(transforms):
    """Check that there is one transform for each physics step, and return the timestamps (ns)."""
    stamps = [nanoseconds_of(transform.header.stamp) for transform in transforms]
    assert stamps == [stamps[0] + number * STEP_NS for number in range(len(stamps))]
    return stamps


def test_250_transforms_per_second(live):
    """The arena broadcasts brick transforms at 250 Hz and publishes the brick marker at 1 Hz."""
    markers = live.record('brick_marker', Marker)
    live.add(Arena)
    bricks = live.record_transforms('brick')
    live.require_rate([bricks], 250.0, 2.0)
    live.wait_for(lambda: len(markers.times) > 5, TIMEOUT, 'six markers')
    # The timer for the marker keeps its phase, so a late marker does not delay the next one.
    assert round((markers.times[-1] - markers.times[1]) / MARKER_PERIOD) == len(markers.times) - 2


def test_world_has_the_configured_dimensions(bench):
    assert bench.world.brick == PARAMETERS.brick_start
    assert bench.world.size == PARAMETERS.brick_size
    assert bench.world.thickness == PARAMETERS.platform_thickness


def test_fall_by_its_stamps(bench):
    """The brick transforms match a free fall at their timestamps, even if the arena pauses."""
    assert bench.place(3.0, 4.0, 9.0).success
    bench.bricks.clear()
    bench.run(0.1)
    assert bench.drop().success
    answered = bench.now + 100_000_000  # The arena pauses before it sends the response.
    for delay_ms in (100, 1, 30, 7, 13, 500):
        bench.tick(delay_ms * 1_000_000)
    bench.until(BrickState.GROUNDED)
    bench.run(0.5)
    samples = list(zip(stamps_of_each_step(bench.bricks), [
        transform.transform.translation for transform in bench.bricks]))
    release = max(stamp for stamp, place in samples if place.z == 9.0)
    assert abs(release - answered) <= STEP_NS
    for stamp, place in samples:
        time = max(stamp - release, 0) * SECONDS_PER_NS
        assert place.z == pytest.approx(
            max(9.0 - 0.5 * PARAMETERS.gravity_accel * time * time, HALF_HEIGHT), abs=1e-6)
        assert (place.x, place.y) == (3.0, 4.0)
    landing = min(stamp for stamp, place in samples if place.z == HALF_HEIGHT)
    assert (landing - release) * SECONDS_PER_NS == pytest.approx(
        sqrt(2.0 * (9.0 - HALF_HEIGHT) / PARAMETERS.gravity_accel), abs=0.008)
    assert {transform.header.frame_id for transform in bench.bricks} == {'world'}


def test_place_and_drop_refuse_invalid_requests(bench, capfd):
    """A refused request does not move the brick. The response and the log contain the reason."""
    refusals = [(bench.place(*location), why) for location, why in (
        ((nan, 1.0, 1.0), 'nan'), ((1.0, 1.0, -0.5), '-0.5'), ((-1e19, 1.0, 1.0), '-1e+19'))]
    assert bench.world.brick == PARAMETERS.brick_start
    assert bench.drop().success
    refusals.append((bench.drop(), 'already falling'))
    for response, why in refusals:
        assert not response.success and why in response.message
    warnings = [line for line in capfd.readouterr().err.splitlines() if 'WARN' in line]
    assert [line.partition(' the brick: ')[2] for line in warnings] == [
        response.message for response, _ in refusals]


def test_brick_rides_with_a_moving_platform(bench):
    """While the brick is on the platform, its pose is broadcast in the platform frame."""
    bench.platform = (1.0, 5.0, 0.0, 0.0)
    assert bench.place(1.2, 5.1, 3.0).success and bench.drop().success
    bench.until(BrickState.RIDING)
    for number in range(50):
        bench.platform = (1.0 + 0.06 * number, 5.0, 0.0, 0.0)
        bench.tick()
    bench.run(0.1)
    assert bench.world.brick == pytest.approx(
        (4.14, 5.1, PARAMETERS.platform_height + HALF_HEIGHT), abs=1e-9)
    bench.platform = (4.0, 5.0, 0.0, 0.6)
    bench.until(BrickState.FLOATING)
    bench.run(0.1)
    stamps_of_each_step(bench.bricks)
    parents = [(frame, [one.transform.translation for one in transforms]) for frame, transforms
               in groupby(bench.bricks, lambda transform: transform.header.frame_id)]
    assert [frame for frame, _ in parents] == ['world', 'platform', 'world']
    for place in parents[1][1][:250]:
        assert (place.x, place.y, place.z) == pytest.approx(
            (0.2, 0.1, PARAMETERS.platform_thickness + HALF_HEIGHT), abs=1e-9)
    bench.platform, last = None, bench.now
    bench.until(lambda: bench.world.platform is None, 'the platform is absent')
    assert bench.now - last == pytest.approx(MAX_AGE_NS, abs=50_000_000)


def test_markers_and_inclination(bench):
    """Late joiners receive all markers and the brick state. The brick tilts with the platform."""
    bench.platform = (5.0, 5.0, 2.0, 0.5)
    bench.tick()
    turn = bench.bricks[-1].transform.rotation
    assert (turn.x, turn.y, turn.z, turn.w) == pytest.approx(
        multiply(multiply(from_yaw(2.0), from_pitch(0.5)), from_yaw(-2.0)), abs=1e-12)
    walls = bench.live.record('walls', MarkerArray, LATCHED)
    bricks = bench.live.record('brick_marker', Marker, LATCHED)
    states = bench.live.record('brick_state', String, LATCHED)
    bench.live.wait_for(lambda: walls.messages and bricks.messages and states.messages, TIMEOUT,
                        'messages for late joiners')
    inner = set()
    for wall in walls.last.markers:
        assert wall.header.frame_id == 'world'
        assert wall.type == Marker.CUBE and wall.color.a == 1.0
        assert wall.scale.z == PARAMETERS.wall_height == 2.0 * wall.pose.position.z
        for name in ('x', 'y'):
            middle, thickness = getattr(wall.pose.position, name), getattr(wall.scale, name)
            if thickness < 1.0:
                inner.add((name, round(min(middle + thickness / 2.0, ARENA_SIZE) if middle < 1.0
                                       else middle - thickness / 2.0, 4)))
    assert inner == {(name, edge) for name in ('x', 'y') for edge in (0.0, round(ARENA_SIZE, 4))}
    brick = bricks.last
    assert brick.header.frame_id == 'brick' and brick.frame_locked
    assert (brick.header.stamp.sec, brick.header.stamp.nanosec) == (0, 0)
    assert (brick.scale.x, brick.scale.y, brick.scale.z) == PARAMETERS.brick_size
    assert states.last.data == 'hovering'
    assert bench.drop().success
    bench.tick()
    bench.live.wait_for(lambda: states.last.data == 'falling' and bricks.last.color != brick.color,
                        TIMEOUT, 'the state falling')


@pytest.mark.parametrize('jump', [-5.0, 1.2])
def test_gap_is_reported_once_and_the_fall_continues(bench, capfd, jump):
    assert bench.place(3.0, 4.0, 60.0).success and bench.drop().success
    bench.run(0.1)
    z = bench.world.brick[2]
    for _ in range(9):
        bench.tick(round(jump * NS_PER_SECOND))
    assert 0.0 < z - bench.world.brick[2] < 5.0
    (warning,) = [line for line in capfd.readouterr().err.splitlines() if 'WARN' in line]
    assert f'The clock advanced by {jump:g} s since the last physics step' in warning


def test_place_outside_the_arena_warns_in_the_response(bench):
    response = bench.place(12.0, 4.0, 9.0)
    assert response.success and 'outside the arena' in response.message
    assert 'outside' not in bench.place(11.0, 4.0, 9.0).message


def test_each_of_two_arenas_reports_the_other_once(live, capfd):
    nodes = [live.add(Arena), live.add(Arena)]
    live.wait_for(lambda: all(node.count_publishers('brick_marker') == 2 for node in nodes),
                  TIMEOUT, 'the arenas discover each other')
    for node in 3 * nodes:
        node.publish_marker()
    assert capfd.readouterr().err.count('Another arena') == 2
