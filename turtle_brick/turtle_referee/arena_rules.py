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

from collections.abc import Iterable
from math import atan2, cos, dist, hypot, sin, sqrt
from typing import Any, NamedTuple

import numpy
from turtle_referee.constants import (ALIKE, ARENA_SIZE, COURSE, EARLY, LAG, NANO, NANOSECONDS,
                                      NEAR, OVERDUE, PAUSE, PHYSICS_RATE, SLIDE, SOON, STILL,
                                      WALL_TOLERANCE)
from turtle_referee.drops import DropWatch
from turtle_referee.geometry import Array, between, distance_to_rectangle, inclination, Pose, pose
from turtle_referee.record import Ask, MarkerHeard, Record
from turtle_referee.robot_rules import frame
from turtle_referee.rules import (Broken, Finding, needed, number, Open, Plot, Rules, Series, some,
                                  worst)

RULES = Rules()
rule = RULES.rule

CUBE, LINES, TEXT = 1, (4, 5), 9
"""Types of visualization_msgs/Marker."""

ADD = 0
"""The action of a marker that is to be seen."""

WALL = 5.0
"""Length (m) from which a marker may be a wall."""

STEP = 1.0 / PHYSICS_RATE
"""Time (s) between two steps of the physics."""

LAGS = range(0, round(LAG * NANOSECONDS) + 1, 5_000_000)
"""How much behind (ns) it may be, in steps."""

BEFORE = 100_000_000
"""How long (ns) before the brick is placed anew its place counts no more: a physics that is behind
gives to steps of before the place that was asked for after them."""

MOMENT = 50_000_000
"""How long (ns) before the next thing is asked for something is looked at."""


def moved(places: Iterable[Any]) -> float:
    """Return how far (m) a thing was at most from where it was first; 0 if it was nowhere."""
    places = list(places)
    return worst(dist(place, places[0]) for place in places)


# ---------------------------------------------------------------------------- walls and markers

def pose_of_marker(record: Record, heard: MarkerHeard, instant: int) -> Pose | None:
    """Return where in the world a marker is at an instant (ns), None if unknown."""
    parent = record.pose(heard.marker.header.frame_id.lstrip('/'), instant)
    p, q = heard.marker.pose.position, heard.marker.pose.orientation
    turned = (q.x, q.y, q.z, q.w) if q.x or q.y or q.z or q.w else (0.0, 0.0, 0.0, 1.0)
    return parent and parent.compose(pose((p.x, p.y, p.z), turned))


def extent(record: Record, heard: MarkerHeard) -> tuple[Array, Array] | None:
    """Return the least and greatest coordinates of a marker (m in the world), None if unknown."""
    marker = heard.marker
    there = pose_of_marker(record, heard, heard.published) or pose_of_marker(
        record, heard, record.idle[0][1] if record.idle else 0)
    if marker.type in LINES:
        corners = [(point.x, point.y, point.z) for point in marker.points]
    else:
        corners = [(a * marker.scale.x / 2.0, b * marker.scale.y / 2.0, 0.0)
                   for a in (-1, 1) for b in (-1, 1)]
    if there is None or not corners:
        return None
    points = there.transform(corners)
    return points.min(0), points.max(0)


def walls(record: Record) -> list[tuple[MarkerHeard, tuple[Array, Array]]]:
    """Return the markers that may be walls; Broken if there are none."""
    found = []
    for heard in record.markers:
        size = extent(record, heard) if heard.marker.type in (CUBE, *LINES) else None
        if size and max(size[1] - size[0]) >= WALL:
            found.append((heard, size))
    return needed(found or None, 'no marker is as long as a wall')


@rule('walls: size', 'The arena should be the same size as the turtlesim simulator and have a '
      'matching coordinate system', f'walls at 0 and {ARENA_SIZE:.2f} m ± {WALL_TOLERANCE} m')
def walls_are_at_the_rim(record: Record) -> Finding:
    """Check that the walls' middles are where turtlesim stops the turtle."""
    sides: tuple[list[float], list[float]] = ([], [])
    for heard, (low, high) in walls(record):
        for axis, side in enumerate(sides):
            if heard.marker.type in LINES:
                side += (low[axis], high[axis])
            elif high[axis] - low[axis] < high[1 - axis] - low[1 - axis]:
                side.append((low[axis] + high[axis]) / 2.0)
    if not all(sides):
        raise Broken('there are not walls on all sides')
    found = [end(side) for side in sides for end in (min, max)]
    off = worst(abs(a - b) for a, b in zip(found, (0.0, ARENA_SIZE) * 2))
    return Finding(off <= WALL_TOLERANCE, 'x from {:.2f} to {:.2f}, y from {:.2f} to {:.2f} m'
                   .format(*found))


def judge_lasting(record: Record, markers: Iterable[MarkerHeard]) -> Finding:
    """Judge whether who comes late sees the topics of some markers."""
    topics = sorted({heard.topic for heard in markers})
    lost, watched = [], sorted(instant for span in record.busy_spans() for instant in span)
    for topic in topics:
        published = sorted([heard.published for heard in record.markers if heard.topic == topic]
                           + watched[:1] + watched[-1:])
        pause = max((b - a for a, b in zip(published, published[1:])), default=0) * NANO
        if not record.latched.get(topic) and pause > PAUSE:
            lost.append(topic)
    return Finding(not lost, f'{", ".join(lost)}: neither latched nor repeated' if lost
                   else f'{", ".join(topics)}: latched or repeated')


@rule('walls: to be seen', 'The arena should be depicted in rviz2, with rectangular walls (drawn '
      'as markers)', 'latched or repeated')
def walls_last(record: Record) -> Finding:
    """Check that the walls are there for an rviz2 that starts later."""
    return judge_lasting(record, [heard for heard, _ in walls(record)])


def brick_markers(record: Record) -> list[MarkerHeard]:
    """Return the markers of the brick; Broken if there are none."""
    solid = [heard for heard in record.markers
             if heard.marker.type not in (*LINES, TEXT) and heard.marker.action == ADD]
    name = record.profile.frames['brick']
    found = [heard for heard in solid if heard.marker.header.frame_id.lstrip('/') == name] or [
        heard for heard in solid if 'brick' in (heard.topic + heard.marker.ns).lower()]
    return needed(found or None, 'there is no marker of the brick')


@rule('brick marker: to be seen', "a marker to show it's location in rviz", 'latched or repeated')
def brick_marker_lasts(record: Record) -> Finding:
    """Check that the brick is there for an rviz2 that starts later."""
    return judge_lasting(record, brick_markers(record))


@rule('brick marker: place', "a marker to show it's location in rviz",
      f'at the brick, within {NEAR} m', rests_on=['place'])
def brick_marker_is_at_the_brick(record: Record) -> Finding:
    """Check that the marker is where the brick is."""
    off = []
    for ask in record.places:
        brick = record.brick(ask.end - MOMENT)
        before = [heard for heard in brick_markers(record) if heard.published < ask.end]
        if brick is None or not before:
            continue
        there = needed(pose_of_marker(record, before[-1], ask.end - MOMENT),
                       f'the frame {before[-1].marker.header.frame_id!r} of the marker is not '
                       'known')
        off.append(dist(there.position, brick.position))
    some(off, 'the brick was not placed')
    return Finding(worst(off) <= NEAR, f'at most {worst(off):.3f} m off')


@rule('markers: frames', 'Your final result should not have any rviz errors or warnings',
      'known frames, sizes and orientations that can be drawn')
def markers_can_be_drawn(record: Record) -> Finding:
    """Check that rviz can draw each marker."""
    needed(record.markers or None, 'there are no markers')
    known, faults = {record.profile.frames['world'], *record.frames}, set()
    for marker in (heard.marker for heard in record.markers if heard.marker.action == ADD):
        q, scale = marker.pose.orientation, marker.scale
        if marker.header.frame_id.lstrip('/') not in known:
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


# --------------------------------------------------------------------------------- the services

@rule('place', 'Offer a service called place … that moves the brick to a specified location',
      f'there within {NEAR} m, at rest, and answered')
def bricks_are_placed(record: Record) -> Finding:
    """Check that the brick goes where it is placed, and hovers."""
    off, drift = [], []
    for ask in some(record.places, 'nothing was placed'):
        if not ask.answered or not ask.accepted:
            raise Broken('at ({:.2f}, {:.2f}, {:.2f}): '.format(*ask.what)
                         + (ask.words or 'refused'))
        track = [brick.position for _, brick in record.brick_track(
            ask.end - 3 * BEFORE, ask.end - BEFORE)]
        off.append(dist(needed(track or None, 'the brick is not seen')[-1], ask.what))
        drift.append(moved(track))
    return Finding(worst(off) <= NEAR and worst(drift) <= STILL,
                   f'{len(off)} times, at most {worst(off):.4f} m off, moved by '
                   f'{worst(drift):.4f} m')


def dropped(record: Record) -> list[DropWatch]:
    """Return the bricks that were let go; Open if there are none."""
    return some([drop for drop in record.drops if drop.released is not None], 'no brick fell')


@rule('drop', 'After the service responds, the brick starts falling', f'answered, and falling '
      f'within {SOON} s', rests_on=['place'])
def bricks_are_dropped(record: Record) -> Finding:
    """Check that each drop is answered, and the brick falls."""
    waits = []
    for drop in some(record.drops, 'nothing was dropped'):
        answer = answer_of(drop)
        waits.append((needed(drop.released, 'answered, but no brick fell') - answer.end) * NANO)
    return Finding(worst(waits) <= SOON, f'{len(waits)} times, at most '
                   f'{max(0.0, worst(waits)):.3f} s after the answer')


def answer_of(drop: DropWatch) -> Ask:
    """Return how the service drop answered; Broken if it did not, or refused."""
    if drop.ask is None or not drop.ask.answered or not drop.ask.accepted:
        raise Broken((drop.ask and drop.ask.words) or 'refused')
    return drop.ask


@rule('drop: answer first', 'After the service responds, the brick starts falling in gravity',
      'seen to move after the answer, and at rest at most one step before it',
      rests_on=['drop', 'brick: hovers', 'fall: course'])
def answers_come_first(record: Record) -> Finding:
    """Check that no fall begins before the service has answered."""
    moving, begins = [], []
    for fall in falls(record):
        answered, released = answer_of(fall.drop).end, fall.drop.released or 0
        stamp, _ = next(record.brick_track(released + 1, fall.drop.end))
        moving.append((stamp - answered) * NANO)
        begins.append((released - answered) * NANO + fall.begin)
    return Finding(min(moving) > 0.0 and min(begins) >= -STEP,
                   f'{len(moving)} times, seen to move {min(moving):+.4f} s and a fall from rest '
                   f'{min(begins):+.4f} s from the answer at the earliest')


# ------------------------------------------------------------------------ hovering and falling

@rule('brick: hovers', 'moves the brick to a specified location … The drop service causes the '
      'brick to fall', 'still until it is dropped', rests_on=['place'])
def brick_hovers(record: Record) -> Finding:
    """Check that before the first drop the brick stays where it is."""
    frame(record, 'brick')
    track = [brick.position for begin, end in record.idle
             for _, brick in record.brick_track(begin, end - BEFORE)]
    some(track, 'the brick was not watched at rest')
    return Finding(moved(track) <= STILL,
                   f'moved by {moved(track):.4f} m in {len(track)} positions')


class Fall(NamedTuple):
    """A fall, as its transforms have it."""

    drop: DropWatch
    begin: float
    """How long (s) after the brick was last seen at rest a fall like this would have begun."""
    times: Array
    """Since then (s)."""
    depths: Array
    acceleration: float
    aside: float
    """The way (m) to the side."""


def falls(record: Record) -> list[Fall]:
    """Return the falls that are long enough to be judged; Open if there are none."""
    found = []
    for drop in dropped(record):
        if drop.released is None or drop.down is None:
            continue
        track = [(stamp, brick.position)
                 for stamp, brick in record.brick_track(drop.released, drop.down)]
        hover = track[0][1][:2] if track else drop.place[:2]
        track = [one for one in track if drop.place[2] - one[1][2] > NEAR]
        if len(track) < 10:
            continue
        times = numpy.array([(stamp - drop.released) * NANO for stamp, _ in track])
        depths = numpy.array([drop.place[2] - place[2] for _, place in track])
        # A fall from rest: the root of its depth grows in proportion to time, from any instant.
        slope, offset = numpy.polyfit(times, numpy.sqrt(2.0 * depths), 1)
        begin = -float(offset / slope)
        found.append(Fall(drop, begin, times - begin, depths, float(slope) ** 2,
                          worst(dist(place[:2], hover) for _, place in track)))
    return some(found, 'no fall was long enough')


@rule('fall: acceleration', 'the brick starts falling in gravity (using the specified gravity '
      'acceleration)', 'gravity_accel ± 2 %, by stamps', rests_on=['fall: course'])
def falls_have_the_acceleration(record: Record) -> Finding:
    """Check that the depth of a fall grows with gravity_accel."""
    gravity, found = number(record, 'gravity_accel'), falls(record)
    values = [fall.acceleration for fall in found]
    longest = max(found, key=lambda fall: fall.times[-1])
    times = numpy.linspace(0.0, longest.times[-1], 50)
    return Finding(
        worst(abs(value - gravity) for value in values) <= 0.02 * gravity,
        f'{min(values):.3f} to {max(values):.3f} m/s^2 in {len(values)} falls (configured '
        f'{gravity:g})',
        Plot('Fall', 'time since the release (s)', 'depth (m)',
             [Series('the brick', longest.times.tolist(), longest.depths.tolist())],
             Series('g t^2 / 2', times.tolist(), (gravity * times * times / 2.0).tolist())))


@rule('fall: course', 'the brick starts falling in gravity', f'at each stamp within {COURSE} m of '
      'a fall from rest, straight down')
def falls_are_falls(record: Record) -> Finding:
    """Check that each position of a fall is on one parabola, and nothing goes aside."""
    found = falls(record)
    off = worst(float(numpy.max(numpy.abs(
        fall.depths - fall.acceleration * fall.times ** 2 / 2.0))) for fall in found)
    aside = worst(fall.aside for fall in found)
    return Finding(off <= COURSE and aside <= NEAR,
                   f'at most {off:.4f} m off, {aside:.4f} m aside')


def half_height(record: Record) -> float:
    """Return half the brick's height (m), as its marker has it; Open if there is none."""
    boxes = [heard.marker for heard in brick_markers(record) if heard.marker.type == CUBE]
    return some(boxes, "the brick's marker is no box: its height is not known")[-1].scale.z / 2.0


def judge_height(record: Record, caught: bool, wanted: float) -> Finding:
    """Judge how high the center of a brick is that has come down."""
    gravity, kept, heights = number(record, 'gravity_accel'), True, []
    for drop in dropped(record):
        if drop.landed is not None and drop.caught is caught:
            # A step may end below: as deep as the brick falls in one.
            step = sqrt(2.0 * gravity * max(drop.place[2] - wanted, 0.0)) / PHYSICS_RATE
            kept = kept and abs(drop.landed[2] - wanted) <= step + NEAR
            heights.append(drop.landed[2])
    some(heights, f'no brick has come down on the {"platform" if caught else "ground"}')
    return Finding(kept, f'{len(heights)} times, its center at {min(heights):.3f} to '
                   f'{max(heights):.3f} m')


@rule('fall: ground', 'If the brick hits … the ground it stops falling', 'its bottom on the '
      'ground', rests_on=['fall: acceleration'])
def ground_stops_the_brick(record: Record) -> Finding:
    """Check that a brick that is not caught lies on the ground."""
    return judge_height(record, False, half_height(record))


@rule('fall: platform', 'If the brick hits the platform … it stops falling', 'its bottom on the '
      "platform's top", rests_on=['fall: acceleration', 'URDF: numbers'])
def platform_stops_the_brick(record: Record) -> Finding:
    """Check that a brick that is caught lies on the platform."""
    return judge_height(record, True, number(record, 'platform_height') + half_height(record))


# ------------------------------------------------------------------- on the platform, and off it

def catches(record: Record) -> list[DropWatch]:
    """Return the bricks that came down on the platform; Open if none did."""
    return some([drop for drop in dropped(record) if drop.caught],
                'no brick has come down on the platform')


@rule('brick: rides', 'If the brick hits the platform it should move with the platform',
      f'the same place on it, {NEAR} m at rest, {LAG:g} s behind at most',
      rests_on=['frames: robot'])
def brick_rides(record: Record) -> Finding:
    """Check that a brick on the level platform keeps its place on it."""
    rest, moving = [], []
    for drop in catches(record):
        track = record.brick_track(drop.down or 0, (drop.tilted or drop.end) - 20_000_000)
        places = [place[:2] for stamp, _ in track
                  if (place := record.on_platform(stamp)) is not None]
        if len(places) < 2:
            raise Broken('brick or platform are not known')
        rest.append(dist(places[-1], places[0]))
        moving.append(moved(places))
    allowed = number(record, 'max_velocity') * LAG + NEAR
    return Finding(worst(rest) <= 2.0 * NEAR and worst(moving) <= allowed,
                   f'{len(rest)} rides, {worst(rest):.4f} m from begin to end, at most '
                   f'{worst(moving):.4f} m on the way')


@rule('brick: angle', 'The angle of the brick relative to the ground should be the same as the '
      'angle of the platform relative to the ground at all times',
      f'within {ALIKE} rad, 99 of 100 times that one is inclined')
def brick_has_the_angle(record: Record) -> Finding:
    """Check that the brick is inclined like the platform, wherever it is."""
    off, level = [], 0
    for begin, end in record.busy_spans():
        for stamp, brick in list(record.brick_track(begin, end - BEFORE))[::5]:
            platform = record.platform(stamp)
            if platform is None:
                continue
            if inclination(brick) <= ALIKE and inclination(platform) <= ALIKE:
                level += 1
                continue
            # The platform of now, or of as long ago as one node may be behind another.
            off.append(min(between(brick.upright, before.upright) for lag in LAGS
                           if (before := record.platform(stamp - lag)) is not None))
    if not off and not level:
        raise Open('brick and platform were not known at the same time')
    usual = worst(sorted(off)[:len(off) - len(off) // 100])
    return Finding(usual <= ALIKE, f'at most {usual:.4f} rad apart, {len(off)} times inclined, '
                   f'{level} times level')


class Slide(NamedTuple):
    """The way of a brick down the slope."""

    times: Array
    seen: Array
    """How far (m) it was seen to go."""
    due: Array
    """How far (m) g sin(angle) takes it, integrated twice."""

    @property
    def off(self) -> float:
        """Return how far (m) it was from where it was due, at most."""
        return float(numpy.max(numpy.abs(self.due - self.seen)))


def slides(record: Record) -> list[Slide]:
    """Return the slides; Open if there are none."""
    gravity, found = number(record, 'gravity_accel'), []
    for drop in catches(record):
        if drop.tilted is None:
            continue
        # A brick that sticks has to slide as well.
        end = drop.floated or min(drop.end, drop.tilted + NANOSECONDS)
        track = [(stamp, brick, platform)
                 for stamp, brick in record.brick_track(drop.tilted - 2 * BEFORE, end)
                 if (platform := record.platform(stamp)) is not None]
        if len(track) < 20:
            continue
        steepest = max((platform for _, _, platform in track), key=inclination)
        downhill = -steepest.axes[2, :2] / (hypot(*steepest.axes[2, :2]) or 1.0)
        seen = numpy.array([platform.locate(brick.position)[:2] @ downhill
                            for _, brick, platform in track])
        times = numpy.array([(stamp - track[0][0]) * NANO for stamp, _, _ in track])
        steps = numpy.diff(times, prepend=times[0])
        angles = [inclination(platform) for _, _, platform in track]

        def due(lag: int) -> Array:
            pulls = gravity * numpy.sin(numpy.interp(times - lag * NANO, times, angles))
            return numpy.cumsum(numpy.cumsum(pulls * steps) * steps)

        found.append(min((Slide(times, seen - seen[0], due(lag)) for lag in LAGS),
                         key=lambda slide: slide.off))
    return some(found, 'no brick was tilted')


@rule('slide: law', 'it should slide off the platform (friction-less, but in gravity)',
      f'g sin(angle) down the slope, within {SLIDE} m',
      rests_on=['fall: acceleration', 'brick: rides'])
def slides_are_frictionless(record: Record) -> Finding:
    """Check that the way down the slope is that of g sin(angle), twice integrated."""
    found = slides(record)
    off = worst(slide.off for slide in found)
    times = found[0].times.tolist()
    return Finding(off <= SLIDE, f'{len(found)} slides, at most {off:.4f} m off', Plot(
        'Slide', 'time (s)', 'way down the slope (m)',
        [Series('the brick', times, found[0].seen.tolist())],
        Series('g sin(angle), integrated', times, found[0].due.tolist())))


@rule('slide: end', 'When the trailing-edge brick clears the platform, it magically floats in '
      'place', 'when its trailing edge has cleared, not before', rests_on=['slide: law'])
def slides_end_at_the_rim(record: Record) -> Finding:
    """Check that the slide ends when the brick has cleared the platform."""
    radius, words, kept = number(record, 'platform_radius'), [], True
    scale = brick_markers(record)[-1].marker.scale
    for drop in catches(record):
        if drop.floated is None:
            continue
        brick, platform = record.brick(drop.floated), record.platform(drop.floated)
        if brick is None or platform is None:
            raise Broken('where the platform was at the end of a slide is not known')
        place = platform.locate(brick.position)[:2]
        ahead = brick.axes[:, 0] @ platform.axes
        yaw = atan2(ahead[1], ahead[0])
        clear = distance_to_rectangle(place, yaw, (scale.x, scale.y)) - radius
        # Read along the slope alone, the trailing edge clears later than the whole brick does.
        half = abs(scale.x / 2.0 * cos(yaw)) + abs(scale.y / 2.0 * sin(yaw))
        slope = hypot(*place) - min(half, scale.x / 2.0) - radius
        kept = kept and clear >= -EARLY and min(clear, slope) <= OVERDUE
        words.append(f'{clear:+.3f}')
    some(words, 'no brick has slid off')
    return Finding(kept, f'{", ".join(words)} m between platform and brick')


@rule('brick: floats', 'it magically floats in place', 'fixed in the world, wherever the robot '
      'drives', rests_on=['slide: end'])
def brick_floats(record: Record) -> Finding:
    """Check that a brick that floats stays when platform and robot go."""
    ways = [moved(brick.position for _, brick in record.brick_track(
        drop.floated, drop.end - BEFORE)) for drop in catches(record) if drop.floated is not None]
    most = worst(some(ways, 'no brick floats'))
    return Finding(most <= 5.0 * STILL, f'{len(ways)} bricks, moved by at most {most:.4f} m')
