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
from functools import partial
from itertools import pairwise
from math import atan2, dist, hypot, sqrt
from typing import Any, NamedTuple

import numpy
from turtle_referee.graph_client.constants import (ALIKE, ARENA_SIZE, COURSE, EARLY, LAG, SECONDS_PER_NS, NS_PER_SECOND,
                                      NEAR, OVERDUE, PAUSE, PHYSICS_RATE, RATE_TOLERANCE, SLIDE,
                                      SOON, STILL, WALL_TOLERANCE)
from turtle_referee.graph_client.drops import DropWatch
from turtle_referee.graph_client.geometry import Array, between, distance_to_rectangle, inclination, Pose, pose
from turtle_referee.graph_client.record import ReceivedMarker, Record
from turtle_referee.rules.rule import (from_faults, Broken, Finding, require, number, require_accepted, Open, Plot,
                                  Rules, Series, require_data, within, worst)

RULES = Rules()
rule = RULES.rule

CUBE, TEXT = 1, 9  # types of visualization_msgs/Marker
ADD = 0  # the action of a marker that is to be seen
WALL = 5.0  # length (m) from which a marker may be a wall
STEP = 1.0 / PHYSICS_RATE  # time (s) between two steps of the physics
LAGS = range(0, round(LAG * NS_PER_SECOND) + 1, 5_000_000)  # how much behind (ns) it may be

BEFORE = 100_000_000  # how long (ns) before the next thing is asked for the brick is looked at


def moved(places: Iterable[Any]) -> float:
    """Return how far (m) a thing was at most from where it was first; 0 if it was nowhere."""
    places = list(places)
    return worst(dist(place, places[0]) for place in places)


# ---------------------------------------------------------------------------- walls and markers

def pose_of_marker(record: Record, heard: ReceivedMarker, instant: int) -> Pose:
    """Return where in the world a marker is at an instant (ns)."""
    name = heard.marker.header.frame_id.lstrip('/')
    parent = require(record.pose(name, instant), f'the frame {name!r} of a marker is not known')
    p, q = heard.marker.pose.position, heard.marker.pose.orientation
    turned = (q.x, q.y, q.z, q.w) if q.x or q.y or q.z or q.w else (0.0, 0.0, 0.0, 1.0)
    return parent.compose(pose((p.x, p.y, p.z), turned))


def walls(record: Record) -> list[ReceivedMarker]:
    """Return the markers that may be walls; Broken if there are none."""
    return require([heard for heard in record.markers if heard.marker.type == CUBE and max(
        heard.marker.scale.x, heard.marker.scale.y) >= WALL] or None,
        'no box is as long as a wall')


@rule('walls: size', 'the same size as the turtlesim simulator and … a matching coordinate system')
def walls_are_at_the_rim(record: Record) -> Finding:
    """Expect walls at 0 and {ARENA_SIZE:.2f} m ± {WALL_TOLERANCE} m."""
    sides: tuple[list[float], list[float]] = ([], [])
    for heard in walls(record):
        # What does not move is known at any time, even where it was said before all else.
        there = pose_of_marker(record, heard, record.idle[0][1])
        size = abs(there.axes) @ (heard.marker.scale.x, heard.marker.scale.y, 0.0)
        thin = int(size[1] < size[0])
        sides[thin].append(there.position[thin])
    if not all(sides):
        raise Broken('there are not walls on all sides')
    found = [end(side) for side in sides for end in (min, max)]
    off = worst(abs(a - b) for a, b in zip(found, (0.0, ARENA_SIZE) * 2))
    return Finding(off <= WALL_TOLERANCE, 'x from {:.2f} to {:.2f}, y from {:.2f} to {:.2f} m'
                   .format(*found))


def brick_markers(record: Record) -> list[ReceivedMarker]:
    """Return the markers of the brick; Broken if there are none."""
    solid = [heard for heard in record.markers
             if heard.marker.type != TEXT and heard.marker.action == ADD]
    return require([heard for heard in solid if 'brick' in (
        heard.marker.header.frame_id + heard.topic + heard.marker.ns).lower()] or None,
        'there is no marker of the brick')


def judge_lasting(what: Any, record: Record) -> Finding:
    """Judge whether an rviz2 that starts later sees some markers, too."""
    topics = {heard.topic for heard in what(record)}
    watched = [instant for span in record.trial_spans() for instant in span]

    def pause(topic: str) -> float:
        published = sorted([min(watched), max(watched), *(
            heard.published for heard in record.markers if heard.topic == topic)])
        return max(b - a for a, b in pairwise(published)) * SECONDS_PER_NS

    return from_faults([f'{topic} is not' for topic in sorted(topics)
                    if not record.latched.get(topic) and pause(topic) > PAUSE],
                   len(topics), 'topics')


for name, sentence, what in (
        ('walls', 'depicted in rviz2, with rectangular walls (drawn as markers)', walls),
        ('brick marker', "a marker to show it's location in rviz", brick_markers)):
    rule(f'{name}: to be seen', sentence, expected='latched or repeated')(
        partial(judge_lasting, what))


@rule('brick marker: place', "a marker to show it's location in rviz", ['place'])
def brick_marker_is_at_the_brick(record: Record) -> Finding:
    """Expect it at the brick, within {NEAR} m."""
    off = []
    for ask in record.places:
        brick = record.brick(ask.end - BEFORE)
        before = [heard for heard in brick_markers(record) if heard.published < ask.end]
        if brick is not None and before:
            there = pose_of_marker(record, before[-1], ask.end - BEFORE)
            off.append(dist(there.position, brick.position))
    return within(NEAR, off, 'the brick was not placed')


@rule('markers: frames', 'Your final result should not have any rviz errors or warnings')
def markers_can_be_drawn(record: Record) -> Finding:
    """Expect known frames, and sizes, orientations and colors that rviz can draw."""
    known, faults = {'world', *record.frames}, set()
    for marker in [heard.marker for heard in require(record.markers or None, 'there are no markers')
                   if heard.marker.action == ADD]:
        q, scale = marker.pose.orientation, marker.scale
        if marker.header.frame_id.lstrip('/') not in known:
            faults.add(f'unknown frame {marker.header.frame_id!r}')
        if not abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0) < 0.01:
            faults.add('an orientation that is no unit quaternion')
        sizes = {CUBE: (scale.x, scale.y, scale.z), TEXT: (scale.z,)}.get(marker.type, (1.0,))
        if not min(sizes) > 0.0:
            faults.add('a size that is not above 0')
        if not marker.color.a > 0.0 and not marker.colors:
            faults.add('a color that cannot be seen')
    return Finding(not faults, '; '.join(sorted(faults)) or f'{len(record.markers)} markers')


# --------------------------------------------------------------------------------- the services

@rule('place', 'a service called place … that moves the brick to a specified location')
def bricks_are_placed(record: Record) -> Finding:
    """Expect an answer, and the brick at rest within {NEAR} m of the place."""
    off, drift = [], []
    for ask in require_data(record.places, 'nothing was placed'):
        place = require_accepted(ask).what
        track = [brick.position for _, brick in record.brick_track(
            ask.end - 3 * BEFORE, ask.end - BEFORE)]
        off.append(dist(require(track or None, 'the brick is not seen')[-1], place))
        drift.append(moved(track))
    return Finding(worst(off) <= NEAR and worst(drift) <= STILL, f'{len(off)} times, at most '
                   f'{worst(off):.4f} m off, moved by {worst(drift):.4f} m')


def dropped(record: Record) -> list[DropWatch]:
    """Return the bricks that were let go; Open if there are none."""
    return require_data([drop for drop in record.drops if drop.released is not None], 'no brick fell')


@rule('drop', 'After the service responds, the brick starts falling', ['place'])
def bricks_are_dropped(record: Record) -> Finding:
    """Expect an answer, and a fall within {SOON} s."""
    waits = []
    for drop in require_data(record.drops, 'nothing was dropped'):
        answered = require_accepted(drop.ask).end
        waits.append((require(drop.released, 'answered, but no brick fell') - answered) * SECONDS_PER_NS)
    return within(SOON, waits, '', 'at most {:.3f} s after the answer, {} times')


@rule('drop: answer first', 'After the service responds, the brick starts falling in gravity',
      ['drop', 'brick: hovers', 'fall: course'])
def answers_come_first(record: Record) -> Finding:
    """Expect it to move after the answer, and to rest until a step before it."""
    moving, begins = [], []
    for fall in falls(record):
        answered, released = require_accepted(fall.drop.ask).end, fall.drop.released or 0
        stamp, _ = next(record.brick_track(released + 1, fall.drop.end))
        moving.append((stamp - answered) * SECONDS_PER_NS)
        begins.append((released - answered) * SECONDS_PER_NS + fall.begin)
    return Finding(min(moving) > 0.0 and min(begins) >= -STEP,
                   f'{len(moving)} times, seen to move {min(moving):+.4f} s and a fall from rest '
                   f'{min(begins):+.4f} s from the answer at the earliest')


# ------------------------------------------------------------------------ hovering and falling

@rule('brick: hovers', 'a service called drop that causes the brick to fall', ['place'])
def brick_hovers(record: Record) -> Finding:
    """Expect it still until it is dropped."""
    track = [brick.position for begin, end in record.idle
             for _, brick in record.brick_track(begin, end - BEFORE)]
    require_data(track, 'the brick was not watched at rest')
    return Finding(moved(track) <= STILL,
                   f'moved by {moved(track):.4f} m in {len(track)} positions')


class Fall(NamedTuple):
    """A fall, as its transforms have it."""

    drop: DropWatch
    begin: float  # how long (s) after it was last seen at rest a fall like this would have begun
    times: Array  # since then (s)
    depths: Array
    acceleration: float
    aside: float  # the way (m) to the side


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
        times = numpy.array([(stamp - drop.released) * SECONDS_PER_NS for stamp, _ in track])
        depths = numpy.array([drop.place[2] - place[2] for _, place in track])
        # A fall from rest: the root of its depth grows in proportion to time, from any instant.
        slope, offset = numpy.polyfit(times, numpy.sqrt(2.0 * depths), 1)
        begin = -float(offset / slope)
        found.append(Fall(drop, begin, times - begin, depths, float(slope) ** 2,
                          worst(dist(place[:2], hover) for _, place in track)))
    return require_data(found, 'no fall was long enough')


@rule('fall: acceleration', 'falling in gravity (using the specified gravity acceleration)',
      ['fall: course'])
def falls_have_the_acceleration(record: Record) -> Finding:
    """Expect gravity_accel ± {RATE_TOLERANCE:.0%}, by stamps."""
    gravity, found = number(record, 'gravity_accel'), falls(record)
    values = [fall.acceleration for fall in found]
    longest = max(found, key=lambda fall: fall.times[-1])
    times = numpy.linspace(0.0, longest.times[-1], 50)
    return Finding(
        worst(abs(value - gravity) for value in values) <= RATE_TOLERANCE * gravity,
        f'{min(values):.3f} to {max(values):.3f} m/s^2 in {len(values)} falls (configured '
        f'{gravity:g})',
        Plot('Fall', 'time since the release (s)', 'depth (m)',
             [Series('the brick', longest.times.tolist(), longest.depths.tolist())],
             Series('g t^2 / 2', times.tolist(), (gravity * times * times / 2.0).tolist())))


@rule('fall: course', 'the brick starts falling in gravity')
def falls_are_falls(record: Record) -> Finding:
    """Expect it within {COURSE} m of a fall from rest at each stamp, straight down."""
    found = falls(record)
    off = worst(float(numpy.max(numpy.abs(
        fall.depths - fall.acceleration * fall.times ** 2 / 2.0))) for fall in found)
    aside = worst(fall.aside for fall in found)
    return Finding(off <= COURSE and aside <= NEAR,
                   f'at most {off:.4f} m off, {aside:.4f} m aside')


def judge_height(caught: bool, record: Record) -> Finding:
    """Judge how high the center of a brick is that has come down."""
    gravity, kept, heights = number(record, 'gravity_accel'), True, []
    boxes = [heard.marker for heard in brick_markers(record) if heard.marker.type == CUBE]
    wanted = require_data(boxes, "the brick's marker is no box: its height is not known")[-1].scale.z / 2.0
    wanted += number(record, 'platform_height') if caught else 0.0
    for drop in dropped(record):
        if drop.landed is not None and drop.caught is caught:
            # A step may end below: as deep as the brick falls in one.
            step = sqrt(2.0 * gravity * max(drop.place[2] - wanted, 0.0)) * STEP
            kept = kept and abs(drop.landed[2] - wanted) <= step + NEAR
            heights.append(drop.landed[2])
    require_data(heights, f'no brick has come down on the {"platform" if caught else "ground"}')
    return Finding(kept, f'{len(heights)} times, its center at {min(heights):.3f} to '
                   f'{max(heights):.3f} m')


rule('fall: ground', 'If the brick hits … the ground it stops falling', ['fall: acceleration'],
     'its bottom on the ground')(partial(judge_height, False))
rule('fall: platform', 'If the brick hits the platform … it stops falling',
     ['fall: acceleration', 'URDF: numbers'], "its bottom on the platform's top")(
         partial(judge_height, True))


# ------------------------------------------------------------------- on the platform, and off it

def catches(record: Record) -> list[DropWatch]:
    """Return the bricks that came down on the platform; Open if none did."""
    return require_data([drop for drop in dropped(record) if drop.caught],
                'no brick has come down on the platform')


@rule('brick: rides', 'If the brick hits the platform it should move with the platform',
      ['frames: robot'])
def brick_rides(record: Record) -> Finding:
    """Expect the same place on it, {NEAR} m at rest, {LAG:g} s behind at most."""
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


@rule('brick: angle', 'The angle of the brick … the same as the angle of the platform … at all '
      'times')
def brick_has_the_angle(record: Record) -> Finding:
    """Expect the same within {ALIKE} rad, 99 of 100 times that one is inclined."""
    off, level = [], 0
    for begin, end in record.trial_spans():
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

    off: float  # how far (m) it was from where it was due, at most
    times: Array
    seen: Array  # how far (m) it was seen to go
    due: Array  # how far (m) g sin(angle) takes it, integrated twice


def slide(gravity: float, track: list[tuple[int, Pose, Pose]]) -> Slide:
    """Return how a brick slides, by its poses and those of the platform, each with its stamp."""
    steepest = max((platform for _, _, platform in track), key=inclination)
    downhill = -steepest.axes[2, :2] / (hypot(*steepest.axes[2, :2]) or 1.0)
    seen = numpy.array([platform.locate(brick.position)[:2] @ downhill
                        for _, brick, platform in track])
    times = numpy.array([(stamp - track[0][0]) * SECONDS_PER_NS for stamp, _, _ in track])
    steps = numpy.diff(times, prepend=times[0])
    angles = [inclination(platform) for _, _, platform in track]
    found = []
    for lag in LAGS:
        pulls = gravity * numpy.sin(numpy.interp(times - lag * SECONDS_PER_NS, times, angles))
        due = numpy.cumsum(numpy.cumsum(pulls * steps) * steps) + seen[0]
        found.append(Slide(float(numpy.max(numpy.abs(due - seen))), times, seen, due))
    return min(found, key=lambda slide: slide.off)


@rule('slide: law', 'it should slide off the platform (friction-less, but in gravity)',
      ['fall: acceleration', 'brick: rides'])
def slides_are_frictionless(record: Record) -> Finding:
    """Expect g sin(angle) down the slope, within {SLIDE} m."""
    gravity, found = number(record, 'gravity_accel'), []
    for drop in catches(record):
        if drop.tilted is not None:
            # A brick that sticks has to slide as well.
            end = drop.floated or min(drop.end, drop.tilted + NS_PER_SECOND)
            found.append(slide(gravity, [
                (stamp, brick, platform)
                for stamp, brick in record.brick_track(drop.tilted - 2 * BEFORE, end)
                if (platform := record.platform(stamp)) is not None]))
    _, times, seen, due = require_data(found, 'no brick was tilted')[0]
    off = worst(one.off for one in found)
    return Finding(off <= SLIDE, f'{len(found)} slides, at most {off:.4f} m off', Plot(
        'Slide', 'time (s)', 'way down the slope (m)',
        [Series('the brick', times.tolist(), seen.tolist())],
        Series('g sin(angle), integrated', times.tolist(), due.tolist())))


@rule('slide: end', 'When the trailing-edge brick clears the platform, it magically floats',
      ['slide: law'])
def slides_end_at_the_rim(record: Record) -> Finding:
    """Expect the end when its trailing edge has cleared, not before."""
    radius, clear = number(record, 'platform_radius'), []
    scale = brick_markers(record)[-1].marker.scale
    for drop in catches(record):
        if drop.floated is None:
            continue
        brick, platform = record.brick(drop.floated), record.platform(drop.floated)
        if brick is None or platform is None:
            raise Broken('where the platform was at the end of a slide is not known')
        ahead = brick.axes[:, 0] @ platform.axes
        clear.append(distance_to_rectangle(
            platform.locate(brick.position)[:2], atan2(ahead[1], ahead[0]), (scale.x, scale.y))
            - radius)
    require_data(clear, 'no brick has slid off')
    return Finding(min(clear) >= -EARLY and worst(clear) <= OVERDUE,
                   ', '.join(f'{one:+.3f}' for one in clear) + ' m between platform and brick')


@rule('brick: floats', 'it magically floats in place', ['slide: end'])
def brick_floats(record: Record) -> Finding:
    """Expect it fixed in the world, wherever the robot drives."""
    ways = [moved(brick.position for _, brick in record.brick_track(
        drop.floated, drop.end - BEFORE)) for drop in catches(record) if drop.floated is not None]
    return within(5.0 * STILL, ways, 'no brick floats', 'moved by at most {:.4f} m, {} bricks')
