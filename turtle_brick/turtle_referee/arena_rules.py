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

"""The rules for the arena: walls, markers, the services and the physics of the brick. No ROS."""

from math import acos, atan2, cos, hypot, sin, sqrt
from typing import Any

import numpy
from turtle_brick.core.geometry import axes, distance_to_rectangle, IDENTITY, Pose
from turtle_brick.core.time_steps import NANO, NANOSECONDS
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.physics import STEP
from turtle_referee.drops import DropWatch
from turtle_referee.record import inclination, MarkerHeard, Record
from turtle_referee.robot_rules import ALIKE, frame, NEAR
from turtle_referee.rules import Broken, Finding, number, Open, Plot, Rules, Series, worst

RULES = Rules()
rule = RULES.rule

CUBE, LINES, TEXT = 1, (4, 5), 9
"""Types of visualization_msgs/Marker."""

WALL = 5.0
"""Length (m) from which a marker may be a wall."""

WALL_TOLERANCE = 0.3
"""How far (m) the middle of a wall may be from the rim of turtlesim's arena."""

LAG = 0.05
"""How long (s) what moves with the platform may be behind it: it is told by another node."""

BEFORE = 100_000_000
"""How long (ns) before the brick is placed anew its place counts no more: a physics that is behind
gives to steps of before the place that was asked for after them."""


# ------------------------------------------------------------------------------------- markers

def extent(record: Record, heard: MarkerHeard) -> tuple[float, float, float, float] | None:
    """Return the least and greatest x and y (m in the world) of a marker, None if unknown."""
    marker = heard.marker
    pose = record.pose(marker.header.frame_id.lstrip('/'), heard.published) or record.pose(
        marker.header.frame_id.lstrip('/'), record.idle[0][1] if record.idle else 0)
    if pose is None:
        return None
    p, q = marker.pose.position, marker.pose.orientation
    own = Pose((p.x, p.y, p.z), (q.x, q.y, q.z, q.w) if q.x or q.y or q.z or q.w else IDENTITY)
    if marker.type in LINES:
        corners = [(point.x, point.y, point.z) for point in marker.points]
    else:
        half = marker.scale.x / 2.0, marker.scale.y / 2.0
        corners = [(a * half[0], b * half[1], 0.0) for a in (-1, 1) for b in (-1, 1)]
    there = [pose.transform(own.transform(corner)) for corner in corners]
    if not there:
        return None
    return (min(x for x, _, _ in there), max(x for x, _, _ in there),
            min(y for _, y, _ in there), max(y for _, y, _ in there))


def wall_markers(record: Record) -> list[MarkerHeard]:
    """Return the markers that may be walls; Broken if there are none."""
    found = []
    for heard in record.markers:
        size = extent(record, heard) if heard.marker.type in (CUBE, *LINES) else None
        if size and max(size[1] - size[0], size[3] - size[2]) >= WALL:
            found.append(heard)
    if not found:
        raise Broken('no marker is as long as a wall')
    return found


@rule('walls: size', 'The arena should be the same size as the turtlesim simulator and have a '
      'matching coordinate system', f'walls at 0 and {ARENA_SIZE:.2f} m ± {WALL_TOLERANCE} m')
def walls_are_at_the_rim(record: Record) -> Finding:
    """Check that the walls' middles are where turtlesim stops the turtle."""
    xs: list[float] = []
    ys: list[float] = []
    for heard in wall_markers(record):
        size = extent(record, heard)
        assert size is not None
        width, depth = size[1] - size[0], size[3] - size[2]
        if heard.marker.type in LINES:
            xs += size[:2]
            ys += size[2:]
        elif width < depth:
            xs.append((size[0] + size[1]) / 2.0)
        else:
            ys.append((size[2] + size[3]) / 2.0)
    if not xs or not ys:
        raise Broken('there are not walls on all sides')
    found = (min(xs), max(xs), min(ys), max(ys))
    off = worst([abs(a - b) for a, b in zip(found, (0.0, ARENA_SIZE, 0.0, ARENA_SIZE))])
    return Finding(off <= WALL_TOLERANCE, 'x from {:.2f} to {:.2f}, y from {:.2f} to {:.2f} m'
                   .format(*found))


def judge_lasting(record: Record, topics: set[str]) -> Finding:
    """Judge whether who comes late sees the markers of some topics."""
    lost, watched = [], sorted(instant for span in record.busy_spans() for instant in span)
    for topic in topics:
        published = sorted([heard.published for heard in record.markers if heard.topic == topic]
                           + watched[:1] + watched[-1:])
        pause = max((b - a for a, b in zip(published, published[1:])), default=0) * NANO
        if not record.latched.get(topic) and pause > 2.0:
            lost.append(topic)
    return Finding(not lost, f'{", ".join(sorted(lost))}: neither latched nor repeated' if lost
                   else f'{", ".join(sorted(topics))}: latched or repeated')


@rule('walls: to be seen', 'The arena should be depicted in rviz2, with rectangular walls (drawn '
      'as markers)', 'latched or repeated')
def walls_last(record: Record) -> Finding:
    """Check that the walls are there for an rviz2 that starts later."""
    return judge_lasting(record, {heard.topic for heard in wall_markers(record)})


def brick_markers(record: Record) -> list[MarkerHeard]:
    """Return the markers of the brick; Broken if there are none."""
    name = record.profile.frames['brick']
    solid = [heard for heard in record.markers
             if heard.marker.type not in (*LINES, TEXT) and heard.marker.action == 0]
    found = [heard for heard in solid if heard.marker.header.frame_id.lstrip('/') == name] or [
        heard for heard in solid if 'brick' in (heard.topic + heard.marker.ns).lower()]
    if not found:
        raise Broken('there is no marker of the brick')
    return found


@rule('brick marker: to be seen', "a marker to show it's location in rviz", 'latched or repeated')
def brick_marker_lasts(record: Record) -> Finding:
    """Check that the brick is there for an rviz2 that starts later."""
    return judge_lasting(record, {heard.topic for heard in brick_markers(record)})


@rule('brick marker: place', "a marker to show it's location in rviz",
      f'at the brick, within {NEAR} m')
def brick_marker_is_at_the_brick(record: Record) -> Finding:
    """Check that the marker is where the brick is."""
    off = []
    for ask in record.places:
        brick = record.brick(ask.end - 50_000_000)
        before = [heard for heard in brick_markers(record) if heard.published < ask.end]
        if brick is None or not before:
            continue
        marker = before[-1].marker
        pose = record.pose(marker.header.frame_id.lstrip('/'), ask.end - 50_000_000)
        if pose is None:
            raise Broken(f'the frame {marker.header.frame_id!r} of the marker is not known')
        p = marker.pose.position
        there = pose.transform((p.x, p.y, p.z))
        off.append(hypot(*(a - b for a, b in zip(there, brick.position))))
    if not off:
        raise Open('the brick was not placed')
    return Finding(worst(off) <= NEAR, f'at most {worst(off):.3f} m off')


@rule('markers: frames', 'Your final result should not have any rviz errors or warnings',
      'known frames, sizes and orientations that can be drawn')
def markers_can_be_drawn(record: Record) -> Finding:
    """Check that rviz can draw each marker."""
    if not record.markers:
        raise Broken('there are no markers')
    world, faults = record.profile.frames['world'], set()
    for heard in record.markers:
        marker = heard.marker
        if marker.action != 0:
            continue
        name = marker.header.frame_id.lstrip('/')
        q, scale = marker.pose.orientation, marker.scale
        if name != world and name not in record.frames:
            faults.add(f'unknown frame {marker.header.frame_id!r}')
        if not abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0) < 0.01:
            faults.add('an orientation that is no unit quaternion')
        if marker.type == CUBE and not min(scale.x, scale.y, scale.z) > 0.0:
            faults.add('a size that is not above 0')
        if marker.type == TEXT and not scale.z > 0.0:
            faults.add('a text without height')
        if not marker.color.a > 0.0 and not marker.colors:
            faults.add('a color that cannot be seen')
    return Finding(not faults, '; '.join(sorted(faults)) or f'{len(record.markers)} markers')


# ------------------------------------------------------------------------------------ services

@rule('place', 'Offer a service called place … that moves the brick to a specified location',
      f'there within {NEAR} m, at rest, and answered', timely=True)
def bricks_are_placed(record: Record) -> Finding:
    """Check that the brick goes where it is placed, and hovers."""
    if not record.places:
        raise Open('nothing was placed')
    off, moved = [], []
    for ask in record.places:
        if not ask.answered or not ask.accepted:
            raise Broken(f'at {tuple(round(one, 3) for one in ask.what)}: '
                         f'{ask.words or "refused"}', sure=ask.answered)
        track = list(record.brick_track(ask.end - 300_000_000, ask.end - BEFORE))
        if not track:
            raise Broken('the brick is not seen')
        where = track[-1][1].position
        off.append(hypot(*(a - b for a, b in zip(where, ask.what))))
        moved.append(hypot(*(a - b for a, b in zip(where, track[0][1].position))))
    return Finding(worst(off) <= NEAR and worst(moved) <= 1e-3,
                   f'{len(off)} times, at most {worst(off):.4f} m off, moved by '
                   f'{worst(moved):.4f} m')


def dropped(record: Record) -> list[DropWatch]:
    """Return the bricks that were let go; Open if there are none."""
    found = [drop for drop in record.drops if drop.released is not None]
    if not found:
        raise Open('no brick fell')
    return found


@rule('drop', 'After the service responds, the brick starts falling', 'answered, and falling '
      'within 0.5 s', timely=True)
def bricks_are_dropped(record: Record) -> Finding:
    """Check that each drop is answered, and the brick falls."""
    if not record.drops:
        raise Open('nothing was dropped')
    waits = []
    for drop in record.drops:
        if drop.ask is None or not drop.ask.answered or not drop.ask.accepted:
            raise Broken((drop.ask and drop.ask.words) or 'refused',
                         sure=bool(drop.ask and drop.ask.answered))
        if drop.released is None:
            raise Broken('answered, but no brick fell')
        # A release falls on a step of the physics, which may have been before the question.
        if drop.released < drop.ask.begin - 30_000_000:
            raise Broken('a brick fell before it was asked to')
        waits.append((drop.released - drop.ask.end) * NANO)
    return Finding(worst(waits) <= 0.5, f'{len(waits)} times, at most {max(0.0, worst(waits)):.3f}'
                   ' s after the answer')


# ------------------------------------------------------------------------------------- physics

@rule('brick: hovers', 'moves the brick to a specified location … The drop service causes the '
      'brick to fall', 'still until it is dropped')
def brick_hovers(record: Record) -> Finding:
    """Check that before the first drop the brick stays where it is."""
    frame(record, 'brick')
    track = [pose.position for begin, end in record.idle
             for _, pose in record.brick_track(begin, end - BEFORE)]
    if not track:
        raise Open('the brick was not watched at rest')
    moved = worst([hypot(*(a - b for a, b in zip(place, track[0]))) for place in track])
    return Finding(moved <= 1e-3, f'moved by {moved:.4f} m in {len(track)} positions')


def fits(record: Record) -> list[tuple[DropWatch, Any, Any, float, float]]:
    """Return each fall's times (s), depths (m), acceleration (m/s^2) and way to the side (m)."""
    found = []
    for drop in dropped(record):
        if drop.released is None or drop.down is None:
            continue
        track = [(stamp, pose.position) for stamp, pose in record.brick_track(
            drop.released, drop.down)]
        hover = track[0][1] if track else drop.place
        track = [one for one in track if drop.place[2] - one[1][2] > NEAR]
        if len(track) < 10:
            continue
        times = numpy.array([(stamp - drop.released) * NANO for stamp, _ in track])
        depths = numpy.array([drop.place[2] - place[2] for _, place in track])
        # A fall from rest: the root of its depth grows in proportion to time, from any instant.
        slope, offset = numpy.polyfit(times, numpy.sqrt(2.0 * depths), 1)
        aside = worst([hypot(place[0] - hover[0], place[1] - hover[1]) for _, place in track])
        found.append((drop, times + offset / slope, depths, float(slope) ** 2, aside))
    if not found:
        raise Open('no fall was long enough')
    return found


def in_calm(record: Record, drops: list[DropWatch]) -> bool:
    """Tell whether the machine had time while one of some bricks fell."""
    return any(not record.is_busy([(drop.released, drop.down)]) for drop in drops
               if drop.released is not None and drop.down is not None)


@rule('fall: acceleration', 'the brick starts falling in gravity (using the specified gravity '
      'acceleration)', 'gravity_accel ± 2 %, by stamps', timely=True)
def falls_have_the_acceleration(record: Record) -> Finding:
    """Check that the depth of a fall grows with gravity_accel."""
    gravity = number(record, 'gravity_accel')
    found = fits(record)
    values = [one[3] for one in found]
    longest = max(found, key=lambda one: one[1][-1])
    times = numpy.linspace(0.0, longest[1][-1], 50)
    wrong = [drop for drop, _, _, value, _ in found
             if not abs(value - gravity) <= 0.02 * gravity]
    return Finding(
        not wrong,
        f'{min(values):.3f} to {max(values):.3f} m/s^2 in {len(values)} falls (configured '
        f'{gravity:g})',
        Plot('Fall', 'time since the release (s)', 'depth (m)',
             [Series('the brick', longest[1].tolist(), longest[2].tolist())],
             Series('g t^2 / 2', times.tolist(), (gravity * times * times / 2.0).tolist())),
        in_calm(record, wrong))


@rule('fall: course', 'the brick starts falling in gravity', 'at each stamp within 0.02 m of a '
      'fall from rest, straight down', timely=True)
def falls_are_falls(record: Record) -> Finding:
    """Check that each position of a fall is on one parabola, and nothing goes aside."""
    off, aside, wrong = [], [], []
    for drop, times, depths, gravity, side in fits(record):
        off.append(float(numpy.max(numpy.abs(depths - gravity * times * times / 2.0))))
        aside.append(side)
        if not (off[-1] <= 0.02 and side <= NEAR):
            wrong.append(drop)
    return Finding(not wrong, f'at most {worst(off):.4f} m off, {worst(aside):.4f} m aside',
                   sure=in_calm(record, wrong))


def half_height(record: Record) -> float:
    """Return half the brick's height (m), as its marker has it; Open if there is none."""
    solid = [heard.marker for heard in brick_markers(record) if heard.marker.type == CUBE]
    if not solid:
        raise Open("the brick's marker is no box: its height is not known")
    return solid[-1].scale.z / 2.0


def judge_height(record: Record, caught: bool, wanted: float) -> Finding:
    """Judge how high the center of a brick is that has come down."""
    gravity, found = number(record, 'gravity_accel'), []
    for drop in dropped(record):
        if drop.landed is not None and drop.caught is caught:
            # A step may end below: as deep as the brick falls in one.
            depth = max(drop.place[2] - wanted, 0.0)
            found.append((abs(drop.landed[2] - wanted),
                          sqrt(2.0 * gravity * depth) * STEP * NANO + NEAR, drop.landed[2]))
    if not found:
        raise Open(f'no brick has come down on the {"platform" if caught else "ground"}')
    kept = all(off <= allowed for off, allowed, _ in found)
    return Finding(kept, f'{len(found)} times, its center at '
                   f'{min(height for _, _, height in found):.3f} to '
                   f'{max(height for _, _, height in found):.3f} m')


@rule('fall: ground', 'If the brick hits … the ground it stops falling', 'its bottom on the '
      'ground', timely=True)
def ground_stops_the_brick(record: Record) -> Finding:
    """Check that a brick that is not caught lies on the ground."""
    return judge_height(record, False, half_height(record))


@rule('fall: platform', 'If the brick hits the platform … it stops falling', 'its bottom on the '
      "platform's top", timely=True)
def platform_stops_the_brick(record: Record) -> Finding:
    """Check that a brick that is caught lies on the platform."""
    return judge_height(record, True, number(record, 'platform_height') + half_height(record))


def caught(record: Record) -> list[DropWatch]:
    """Return the bricks that came down on the platform; Open if none did."""
    found = [drop for drop in dropped(record) if drop.caught]
    if not found:
        raise Open('no brick has come down on the platform')
    return found


@rule('brick: rides', 'If the brick hits the platform it should move with the platform',
      f'the same place on it, {NEAR} m at rest, {LAG:g} s behind at most', timely=True)
def brick_rides(record: Record) -> Finding:
    """Check that a brick on the level platform keeps its place on it."""
    rest, moving = [], []
    for drop in caught(record):
        assert drop.down is not None
        end = drop.tilted or drop.end
        places = [place for stamp, _ in record.brick_track(drop.down, end - 20_000_000)
                  if (place := record.on_platform(stamp)) is not None]
        if len(places) < 2:
            raise Broken('brick or platform are not known')
        rest.append(hypot(places[-1][0] - places[0][0], places[-1][1] - places[0][1]))
        moving.append(worst([hypot(place[0] - places[0][0], place[1] - places[0][1])
                             for place in places]))
    allowed = number(record, 'max_velocity') * LAG + NEAR
    return Finding(worst(rest) <= NEAR + 0.01 and worst(moving) <= allowed,
                   f'{len(rest)} rides, {worst(rest):.4f} m from begin to end, at most '
                   f'{worst(moving):.4f} m on the way')


@rule('brick: angle', 'The angle of the brick relative to the ground should be the same as the '
      'angle of the platform relative to the ground at all times',
      f'within {ALIKE} rad, 99 of 100 times', timely=True)
def brick_has_the_angle(record: Record) -> Finding:
    """Check that the brick is inclined like the platform: on it, and where it floats."""
    off = []
    for drop in caught(record):
        assert drop.down is not None
        for stamp, brick in list(record.brick_track(drop.down, drop.end - BEFORE))[::5]:
            # The platform of now, or of as long ago as one node may be behind another.
            found = [_between(brick, platform) for ago in range(0, round(LAG * 1000) + 1, 5)
                     if (platform := record.platform(stamp - ago * 1_000_000)) is not None]
            if found:
                off.append(min(found))
    if not off:
        raise Open('brick and platform were not known at the same time')
    usual = worst(sorted(off)[:len(off) - len(off) // 100])
    return Finding(usual <= ALIKE, f'at most {usual:.4f} rad apart, {len(off)} times')


def _between(a: Pose, b: Pose) -> float:
    """Return the angle (rad) between the upright axes of two poses."""
    p, q = axes(a.orientation)[2], axes(b.orientation)[2]
    return acos(min(max(sum(x * y for x, y in zip(p, q)), -1.0), 1.0))


def slides(record: Record) -> list[tuple[DropWatch, Any, Any, Any]]:
    """Return of each slide its times (s), and the ways down (m) that were seen and are due."""
    gravity, found = number(record, 'gravity_accel'), []
    for drop in caught(record):
        if drop.tilted is None:
            continue
        # A brick that sticks has to slide as well.
        end = drop.floated or min(drop.end, drop.tilted + NANOSECONDS)
        stamps = [stamp for stamp, _ in record.brick_track(drop.tilted - 200_000_000, end)]
        places = [(stamp, place, platform) for stamp in stamps
                  if (place := record.on_platform(stamp))
                  and (platform := record.platform(stamp))]
        if len(places) < 20:
            continue
        platform = max((platform for _, _, platform in places), key=inclination)
        downhill = [-axes(platform.orientation)[i][2] for i in (0, 1)]
        length = hypot(*downhill) or 1.0
        ways = numpy.array([(place[0] * downhill[0] + place[1] * downhill[1]) / length
                            for _, place, _ in places])
        times = numpy.array([(stamp - places[0][0]) * NANO for stamp, _, _ in places])
        best = None
        for lag in range(0, round(LAG * 1000) + 1, 10):
            angles = numpy.array([inclination(record.platform(stamp - lag * 1_000_000) or platform)
                                  for stamp, _, _ in places])
            pull = gravity * numpy.sin(angles)
            steps = numpy.diff(times, prepend=times[0])
            speeds = numpy.cumsum(pull * steps)
            due = numpy.cumsum(speeds * steps) + ways[0]
            off = float(numpy.max(numpy.abs(due - ways)))
            if best is None or not off >= best[0]:
                best = (off, due)
        assert best is not None
        found.append((drop, times, ways - ways[0], best[1] - ways[0]))
    if not found:
        raise Open('no brick was tilted')
    return found


@rule('slide: law', 'it should slide off the platform (friction-less, but in gravity)',
      'g sin(angle) down the slope, within 0.04 m', timely=True)
def slides_are_frictionless(record: Record) -> Finding:
    """Check that the way down the slope is that of g sin(angle), twice integrated."""
    found = slides(record)
    off = worst([float(numpy.max(numpy.abs(seen - due))) for _, _, seen, due in found])
    _, times, seen, due = found[0]
    return Finding(off <= 0.04, f'{len(found)} slides, at most {off:.4f} m off', Plot(
        'Slide', 'time (s)', 'way down the slope (m)',
        [Series('the brick', times.tolist(), seen.tolist())],
        Series('g sin(angle), integrated', times.tolist(), due.tolist())))


@rule('slide: end', 'When the trailing-edge brick clears the platform, it magically floats in '
      'place', 'when its trailing edge has cleared, not before', timely=True)
def slides_end_at_the_rim(record: Record) -> Finding:
    """Check that the slide ends when the brick has cleared the platform."""
    radius, words, kept = number(record, 'platform_radius'), [], True
    sizes = [heard.marker.scale for heard in brick_markers(record)]
    length, width = sizes[-1].x, sizes[-1].y
    seen = [drop for drop in caught(record) if drop.floated is not None]
    if not seen:
        raise Open('no brick has slid off')
    for drop in seen:
        assert drop.floated is not None
        brick, platform = record.brick(drop.floated), record.platform(drop.floated)
        place = record.on_platform(drop.floated)
        if brick is None or platform is None or place is None:
            raise Open('where the platform was at the end of a slide is not known')
        own = axes(platform.orientation)
        ahead = axes(brick.orientation)[0]
        yaw = atan2(*(sum(a * b for a, b in zip(ahead, own[i])) for i in (1, 0)))
        u, v, _ = place
        clear = distance_to_rectangle(u, v, yaw, length, width) - radius
        # Read along the slope alone, the trailing edge clears later than the whole brick does.
        slope = hypot(u, v) - min(abs(length / 2.0 * cos(yaw)) + abs(width / 2.0 * sin(yaw)),
                                  length / 2.0) - radius
        kept = kept and clear >= -0.02 and min(clear, slope) <= 0.08
        words.append(f'{clear:+.3f}')
    return Finding(kept, f'{", ".join(words)} m between platform and brick')


@rule('brick: floats', 'it magically floats in place', 'fixed in the world, wherever the robot '
      'drives', timely=True)
def brick_floats(record: Record) -> Finding:
    """Check that a brick that floats stays when platform and robot go."""
    moved = []
    for drop in caught(record):
        if drop.floated is None:
            continue
        places = [pose.position for _, pose in record.brick_track(
            drop.floated, drop.end - BEFORE)]
        if not places:
            continue
        moved.append(worst([hypot(*(a - b for a, b in zip(place, places[0])))
                            for place in places]))
    if not moved:
        raise Open('no brick floats')
    return Finding(worst(moved) <= 5e-3, f'{len(moved)} bricks, moved by at most '
                   f'{worst(moved):.4f} m')
