# SPDX-License-Identifier: Apache-2.0
"""Rules for the arena: walls, markers, services and the physics of the brick."""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import partial
from itertools import chain, pairwise, product
from math import atan2, dist, hypot, inf, sqrt
from operator import attrgetter, itemgetter
from statistics import median, median_high, median_low
from typing import Any, NamedTuple

import numpy
from turtle_graph.client.drops import DropWatch, STILL
from turtle_graph.client.geometry import (angle_between, ARENA_SIZE, Array, distance_to_rectangle,
                                          inclination, Pose)
from turtle_graph.client.messages import NS_PER_SECOND, read_pose, read_vector, SECONDS_PER_NS
from turtle_graph.client.profiles import NUMBERS
from turtle_graph.client.record import ReceivedMarker, Record
from turtle_graph.referee.rules.robot_model import model
from turtle_graph.referee.rules.robot_rules import frame, judge_rate, top_speed
from turtle_graph.referee.rules.rule import (BEFORE_NS, Failed, Finding, from_faults, largest,
                                             NEAR, number, Open, PHYSICS_RATE, Plot,
                                             RATE_TOLERANCE, require, require_accepted,
                                             require_clear, require_data, Rules, SAME_ANGLE, thin,
                                             within)

RULES = Rules(node='arena')
rule = RULES.rule

WALL_TOLERANCE = 0.3
"""Maximum distance (m) between a wall and the edge of the arena."""
MARKER_PERIOD = 3.0
"""Maximum interval (s) between repeated markers on a topic that is not latched."""
FALL_DELAY = 0.5
"""Maximum delay (s) between the response from the drop service and the start of the fall."""
FALL_DEVIATION = 0.02
"""Maximum deviation (m) of a falling brick from a fall with constant acceleration."""
MAX_JUMP = 0.02
"""Maximum distance (m) by which a brick moves on a platform at rest, or when it lands there."""
MAX_LAG = 0.08
"""Maximum delay (s) between the motion of the platform and the motion of a brick on it."""
SLIDE_DEVIATION, SLIDE_TOLERANCE = 0.04, 0.1
"""Maximum deviation (m) of a sliding brick, and the relative tolerance for its acceleration."""
PLANE_DEVIATION = 0.05
"""Maximum distance (m) of a sliding brick from the plane of the slide."""
EARLY_END, LATE_END = 0.02, 0.08
"""Maximum overlap and gap (m) between the brick and the platform at the end of a slide."""
CUBE, CYLINDER, LINE_STRIP, LINE_LIST, CUBE_LIST, TEXT, TRIANGLE_LIST = 1, 3, 4, 5, 6, 9, 11
"""Marker types."""
ADD = 0
"""The marker action ADD."""
MIN_WALL_LENGTH, MAX_WALL_RATIO = 5.0, 0.5
"""Minimum length (m) and maximum ratio of width to length of a wall. A floor is wider."""
MIN_PIECE_LENGTH = 0.1
"""Minimum length (m) of a piece of a wall."""
AT_BRICK = 0.3
"""Maximum distance (m) from the brick to its place before a drop, and usually to its marker."""
STEP = 1.0 / PHYSICS_RATE
"""Time step (s) of the physics simulation."""
LAGS = range(-60_000_000, 80_000_001, 10_000_000)
"""Candidate delays (ns) of the brick behind the platform in TF, which may be updated at 20 Hz."""
DELAYS = range(0, 50_000_001, 5_000_000)
"""Candidate delays (ns) between the angle in joint_states and the pull on the brick."""
NOT_PLACED = 'no brick fell from the place where it was put'
"""Text in the measured result of a requirement if all bricks moved before they were dropped."""
MAX_SINKING = 1.0
"""Depth (m) below the ground that no time step explains."""


@rule('frames: brick', 'brick. This frame is the location of the brick',
      'brick is a descendant of world')
def brick_is_below_world(record: Record) -> Finding:
    frame(record, 'brick')
    chain = record.ancestors('brick')
    return Finding(chain[-1] == record.actual('world'), ' -> '.join(reversed(chain)))


rule('rate: brick', 'The node should simulate the physics at 250 Hz',
     f'{PHYSICS_RATE:g} Hz ± {RATE_TOLERANCE:.0%}', needs_calm=True)(
         partial(judge_rate, name='brick', nominal=PHYSICS_RATE))


def max_motion(positions: Iterable[Any]) -> float:
    """Return the maximum distance (m) of the given positions from the first of them."""
    positions = list(positions)
    return largest(dist(position, positions[0]) for position in positions)


def pose_of_marker(record: Record, received: ReceivedMarker, time: int) -> Pose:
    """Return a marker's world pose at a time (ns), or raise Failed if its frame is unknown."""
    name = received.marker.header.frame_id.lstrip('/')
    parent = require(record.pose(name, time), f'the frame {name!r} of a marker is unknown')
    pose = received.marker.pose
    return parent.compose(read_pose(pose.position, pose.orientation))


def shown_markers(record: Record) -> list[ReceivedMarker]:
    """Return the last marker added for each combination of topic, namespace and marker ID."""
    return list({(received.topic, received.marker.ns, received.marker.id): received
                 for received in record.markers if received.marker.action == ADD}.values())


def box(marker: Any) -> Array:
    """Return the corners (m) of a box of a marker's size, in the marker's frame."""
    return numpy.array(list(product((-0.5, 0.5), repeat=3))) * read_vector(marker.scale)


def parts(marker: Any) -> Array:
    """Return the corners (m) of each box, line or triangle of a marker, in the marker's frame."""
    if marker.type in (CUBE, CYLINDER):
        return box(marker)[None]
    points = numpy.array([read_vector(point) for point in marker.points]).reshape(-1, 3)
    if marker.type == CUBE_LIST:
        return points[:, None] + box(marker)
    if marker.type == LINE_STRIP:
        return numpy.stack((points[:-1], points[1:]), axis=1)
    count = {LINE_LIST: 2, TRIANGLE_LIST: 3}.get(marker.type, len(points) + 1)
    return points[:len(points) // count * count].reshape(-1, count, 3)


Wall = tuple[ReceivedMarker, Array, Array]
"""The marker of a wall or of a piece of it, and the lowest and highest world coordinates (m)."""


def walls(record: Record) -> list[Wall]:
    """Return all walls, or raise Failed if there are none."""
    pieces: list[Wall] = []
    _, time = record.trial_spans()[0]
    for received in shown_markers(record):
        corners = parts(received.marker)
        corners = corners[numpy.ptp(corners, axis=1).max(axis=1) >= MIN_PIECE_LENGTH]
        with suppress(Failed):  # The brick may not exist yet.
            corners = pose_of_marker(record, received, time).transform(corners)
            pieces += [(received, *ends) for ends in zip(corners.min(1), corners.max(1))]
    return require([*joined(pieces, 0), *joined(pieces, 1)], 'no marker has the shape of a wall')


def joined(pieces: list[Wall], along: int) -> list[Wall]:
    """Join the pieces that stand end to end along an axis (x: 0, y: 1), and return the walls."""
    across = 1 - along
    lines: list[Wall] = []
    for received, low, high in sorted(pieces, key=lambda piece: piece[1][along]):
        for index, (first, start, end) in enumerate(lines):
            offset = max(abs(low - start)[across], abs(high - end)[across])
            if low[along] <= end[along] + NEAR and offset <= NEAR:
                lines[index] = first, numpy.minimum(start, low), numpy.maximum(end, high)
                break
        else:
            lines.append((received, low, high))
    sizes = [end - start for _, start, end in lines]
    return [line for line, size in zip(lines, sizes) if size[along] >= MIN_WALL_LENGTH
            and size[across] <= MAX_WALL_RATIO * size[along]]


@rule('walls: size', 'the same size as the turtlesim simulator and … a matching coordinate system',
      f'walls at 0 and {ARENA_SIZE:.2f} m ± {WALL_TOLERANCE} m, along the edges, above the ground',
      ['frames: odom'])
def walls_are_at_the_edges(record: Record) -> Finding:
    # The positions (m) and half widths (m) of the walls across x and of those across y.
    sides: tuple[list[tuple[float, float]], list[tuple[float, float]]] = ([], [])
    beyond, heights = [], []
    for _, low, high in walls(record):
        size, middle = high - low, (low + high) / 2.0
        across = int(size[1] < size[0])
        along = 1 - across
        sides[across].append((middle[across], size[across] / 2.0))
        beyond += [-low[along], high[along] - ARENA_SIZE]
        heights.append(middle[2])
    if not all(sides):
        raise Failed('some sides have no wall')
    outer = [end(side) for side in sides for end in (min, max)]
    off = largest(abs(place - edge) - half_width
                  for (place, half_width), edge in zip(outer, (0.0, ARENA_SIZE) * 2))
    thickest = largest(half_width for side in sides for _, half_width in side)
    met = (off <= WALL_TOLERANCE and largest(beyond) <= 2.0 * (WALL_TOLERANCE + thickest)
           and min(heights) >= 0.0)
    places = [place for place, _ in outer]
    return Finding(met, 'x from {:.2f} to {:.2f}, y from {:.2f} to {:.2f} m'.format(*places)
                   + f', {largest(beyond):.2f} m beyond the corners, center at a height of at '
                   f'least {min(heights):.2f} m')


def brick_markers(record: Record) -> list[ReceivedMarker]:
    """Return all markers that show the brick, or raise Failed if there are none."""
    markers: dict[tuple[Any, ...], list[ReceivedMarker]] = {}
    for received in record.markers:
        marker = received.marker
        if marker.type != TEXT and marker.action == ADD:
            markers.setdefault((received.topic, marker.ns, marker.id), []).append(received)
    groups = [group for group in markers.values() if moves_with_brick(record, group)]
    if not groups:
        groups = [group for group in markers.values() if is_called_brick(group[-1])]
    sequence = sorted(chain(*groups), key=attrgetter('published'))
    return require(sequence, 'there is no marker of the brick')


def is_called_brick(received: ReceivedMarker) -> bool:
    """Return whether a name of a marker contains "brick" and the marker is smaller than a wall."""
    marker = received.marker
    names = f'{received.topic} {marker.ns} {marker.header.frame_id}'
    return max(read_vector(marker.scale)) < MIN_WALL_LENGTH and 'brick' in names.lower()


def moves_with_brick(record: Record, group: list[ReceivedMarker]) -> bool:
    """Return whether a marker is in the frame of the brick, or usually at the brick."""
    if group[-1].marker.header.frame_id.lstrip('/') == record.actual('brick'):
        return True
    off = []
    for received in group[::len(group) // 50 + 1]:
        with suppress(Failed):  # The frame of the marker may be unknown.
            brick = record.pose('brick', received.published)
            if brick is not None:
                there = pose_of_marker(record, received, received.published)
                off.append(dist(there.position, brick.position))
    return bool(off) and median(off) <= AT_BRICK


def brick_corners(record: Record) -> Array:
    """Return the usual corners (m) of the brick's box in the brick's frame, or raise Open."""
    corners = []
    _, idle = record.trial_spans()[0]
    with suppress(Failed):
        boxes = [received for received in brick_markers(record) if received.marker.type == CUBE]
        # A latched marker in the frame of the brick may be older than all transforms.
        latest = [received._replace(published=idle) for received in boxes[-1:]]
        for received in [*thin(boxes), *latest]:
            brick = record.pose('brick', received.published)
            if brick is not None:
                marker = pose_of_marker(record, received, received.published)
                corners.append(brick.locate(marker.transform(box(received.marker))))
    require_data(corners, 'the size of the brick is unknown because it has no box marker')
    return numpy.median(corners, axis=0)


def judge_visibility(record: Record, markers: list[ReceivedMarker]) -> Finding:
    """Judge whether rviz2 would show the markers even if it started after their publication."""
    topics = {received.topic for received in markers}
    observed = [time for span in record.trial_spans() for time in span]
    faults = []
    for topic in sorted(topics):
        times = [received.published for received in record.markers if received.topic == topic]
        times = sorted([min(observed), *times, max(observed)])
        pause = max(b - a for a, b in pairwise(times)) * SECONDS_PER_NS
        if not record.latched.get(topic) and pause > MARKER_PERIOD:
            faults.append(f'{topic} is neither latched nor repeated')
    return from_faults(faults, len(topics), 'topics')


@rule('walls: visible', 'depicted in rviz2, with rectangular walls (drawn as markers)',
      'latched or repeated')
def walls_are_visible(record: Record) -> Finding:
    return judge_visibility(record, [received for received, _, _ in walls(record)])


@rule('brick marker: visible', "a marker to show it's location in rviz", 'latched or repeated')
def brick_is_visible(record: Record) -> Finding:
    return judge_visibility(record, brick_markers(record))


@rule('brick marker: place', "a marker to show it's location in rviz",
      f'the center or base of the marker is within {NEAR} m of the brick', ['place'],
      needs_calm=True)
def brick_marker_is_at_the_brick(record: Record) -> Finding:
    off, markers = [], brick_markers(record)
    for request in record.places:
        time = request.end - BEFORE_NS
        brick, later = record.pose('brick', time), record.pose('brick', request.end)
        shown = [received for received in markers if received.published <= request.end]
        if brick is None or later is None or not shown:
            continue
        if dist(later.position, brick.position) <= STILL:
            marker = pose_of_marker(record, shown[-1], time)
            x, y, _ = marker.position
            base = x, y, min(marker.transform(box(shown[-1].marker))[:, 2])
            off.append(min(dist(marker.position, brick.position), dist(base, brick.position)))
    return within(NEAR, off, 'the brick was never at rest after it was placed')


@rule('markers: frames', 'Your final result should not have any rviz errors or warnings',
      'frames, sizes, orientations and colors that rviz can draw')
def markers_can_be_drawn(record: Record) -> Finding:
    markers = require(shown_markers(record), 'there are no markers')
    frames = {'world', *record.frame_names()}
    faults = {fault for received in markers for fault in drawing_faults(received.marker, frames)}
    return Finding(not faults, '; '.join(sorted(faults)) or f'{len(record.markers)} markers')


def drawing_faults(marker: Any, frames: set[str]) -> Iterator[str]:
    """Yield the reasons why rviz2 cannot draw a marker. `frames` contains all known frames."""
    if marker.header.frame_id.lstrip('/') not in frames:
        yield f'the frame {marker.header.frame_id!r} is unknown'
    q = marker.pose.orientation
    length = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    if not (abs(length - 1.0) < 0.01 or length == 0.0):  # rviz2 accepts 0 as the default.
        yield 'an orientation is not a unit quaternion'
    scale = marker.scale
    sizes = {CUBE: (scale.x, scale.y, scale.z), TEXT: (scale.z,)}.get(marker.type, (1.0,))
    if not min(sizes) > 0.0:
        yield 'a size is not positive'
    if not marker.color.a > 0.0 and not marker.colors:
        yield 'a color is transparent'


@rule('place', 'a service called place … that moves the brick to a specified location',
      f'the service responds, and the brick is at rest within {NEAR} m of its target',
      needs_calm=True)
def bricks_are_placed(record: Record) -> Finding:
    off, drift = [], []
    require_clear(record, 'place', 'brick')
    for request in require_data(record.places, 'nothing was placed'):
        target = require_accepted(record, request).value
        track = [brick.position for _, brick in record.brick_track(
            request.end - 3 * BEFORE_NS, request.end - BEFORE_NS)]
        if track:
            off.append(dist(track[-1], target))
            drift.append(max_motion(track))
    require(record.frames.get(record.actual('brick')), 'no node broadcasts brick')
    require_data(off, 'the brick was not observed at the place')
    text = (f'at most {largest(off):.4f} m off, moved by {largest(drift):.4f} m '
            f'in {len(off)} calls')
    if largest(drift) > AT_BRICK:
        raise Failed(f'{text}, before it was dropped')  # No load lets a brick move so far.
    return Finding(largest(off) <= NEAR and largest(drift) <= STILL, text)


def dropped(record: Record) -> list[DropWatch]:
    """Return all drops of a brick from its place, or raise Open if there are none."""
    require_clear(record, 'place', 'drop', 'brick', 'pose', f'frame {record.actual("brick")}')
    return require_data([drop for drop in record.drops
                         if drop.released is not None and was_placed(record, drop)], NOT_PLACED)


def was_placed(record: Record, drop: DropWatch) -> bool:
    """Return whether the brick was near its place, or its pose unknown, when it was dropped."""
    brick = record.pose('brick', drop.begin)
    return brick is None or dist(brick.position, drop.place) <= AT_BRICK


@rule('drop', 'After the service responds, the brick starts falling',
      f'the service responds, and the brick falls within {FALL_DELAY} s', ['place'],
      needs_calm=True)
def bricks_are_dropped(record: Record) -> Finding:
    delays = []
    require_clear(record, 'place', 'drop', 'brick')
    for drop in require_data(record.drops, 'nothing was dropped'):
        responded = require_accepted(record, drop.request).end
        if not was_placed(record, drop):
            continue
        if drop.released is None:
            return Finding(False, 'the service responded, but no brick fell')
        delays.append((drop.released - responded) * SECONDS_PER_NS)
    return within(FALL_DELAY, delays, NOT_PLACED,
                  'at most {:.3f} s after the response in {} drops')


@rule('drop: answer first', 'After the service responds, the brick starts falling in gravity',
      'the brick moves at most one step before the response, and its fall begins at most two '
      'steps before it', ['drop', 'brick: hovers', 'fall: course'], needs_calm=True)
def response_comes_first(record: Record) -> Finding:
    moving, begins = [], []
    for fall in falls(record):
        responded = require_accepted(record, fall.drop.request).end
        released = fall.drop.released or 0
        stamp, _ = next(record.brick_track(released + 1, fall.drop.end))
        moving.append((stamp - responded) * SECONDS_PER_NS)
        begins.append((released - responded) * SECONDS_PER_NS + fall.begin)
    # The timestamp of a step may be the time at which the step was due. With semi-implicit
    # integration, the parabola begins 1.5 steps before the first motion.
    return Finding(min(moving) > -STEP and median_low(begins) >= -2.0 * STEP,
                   f'earliest motion {min(moving):+.4f} s and median start of a fall '
                   f'{median_low(begins):+.4f} s after the response, in {len(moving)} drops')


@rule('brick: hovers', 'a service called drop that causes the brick to fall',
      'the brick is at rest until it is dropped', ['place'])
def brick_hovers(record: Record) -> Finding:
    first = min((drop.begin for drop in record.drops), default=inf)
    motions, count = [], 0
    for begin, end in record.idle:
        if end <= first:
            track = [brick.position for _, brick in record.brick_track(begin, end - BEFORE_NS)]
            motions.append(max_motion(track))
            count += len(track)
    if not count:
        raise Open('the brick was not observed at rest')
    return Finding(largest(motions) <= STILL,
                   f'moved by {largest(motions):.4f} m in {count} positions')


class MeasuredFall(NamedTuple):
    """A model of a fall from rest, fitted to the recorded transforms of a brick."""

    drop: DropWatch
    begin: float  # Start time (s) of the fall, relative to the last transform before the fall.
    times: Array  # Times (s) since the start.
    depths: Array  # Distances (m) of the brick below its starting position.
    acceleration: float
    per_step: float  # Acceleration if there is one transform for each step of the physics.
    off: float  # Maximum deviation (m) of the depths from the better fit.
    aside: Array  # Horizontal distances (m) of the brick from its starting position.


def falls(record: Record) -> list[MeasuredFall]:
    """Return all falls with at least ten recorded transforms, or raise Open if there are none."""
    return require_data([measure_fall(record, drop) for drop in dropped(record)],
                        'no fall was long enough')


def measure_fall(record: Record, drop: DropWatch) -> MeasuredFall | None:
    """Fit a model to the fall in a drop, or return None if too few transforms show the fall."""
    released = drop.released or 0
    track = [(stamp, brick.position) for stamp, brick in record.brick_track(
                 released, drop.down or drop.end)]
    # If no landing was observed, the brick may have fallen through the ground.
    has_ended = drop.down is not None or any(position[2] <= 0.0 for _, position in track)
    falling = [(stamp, position) for stamp, position in track
               if 0.0 < position[2] < drop.place[2] - NEAR]
    depths = numpy.array([drop.place[2] - position[2] for _, position in falling])
    if not has_ended or len(falling) < 10 or depths[-1] == depths[0]:
        return None
    times = numpy.array([(stamp - released) * SECONDS_PER_NS for stamp, _ in falling])
    _, start = track[0]
    aside = numpy.array([dist(position[:2], start[:2]) for _, position in falling])
    # A timestamp may be the time of a timer callback, which can be late on any machine. A step
    # may also be late or skipped although each step is right.
    begin, acceleration, off = fit_fall(times, depths, STEP)
    steps = STEP * numpy.arange(len(depths), dtype=float)
    _, per_step, off_steps = fit_fall(steps, depths, 0.0)
    return MeasuredFall(drop, begin, times - begin, depths, acceleration, per_step,
                        min(off, off_steps), aside)


def fit_fall(times: Array, depths: Array, late: float) -> tuple[float, float, float]:
    """
    Fit a fall from rest, and return its start time (s), its acceleration and the deviation (m).

    :param late: time (s) by which each of the given times may be wrong
    """
    # In a fall from rest, the square root of the fallen distance is a linear function of time.
    slope, offset = numpy.polyfit(times, numpy.sqrt(2.0 * depths), 1)
    begin, acceleration = -float(offset / slope), float(slope) ** 2
    elapsed = times - begin
    shallow, deep = (acceleration * (elapsed + shift) ** 2 / 2.0 for shift in (-late, late))
    return begin, acceleration, float(numpy.abs(depths - numpy.clip(depths, shallow, deep)).max())


@rule('fall: acceleration', 'falling in gravity (using the specified gravity acceleration)',
      f'gravity_accel ± {RATE_TOLERANCE:.0%}, by timestamps or by steps', ['fall: course'],
      needs_calm=True)
def falls_have_the_acceleration(record: Record) -> Finding:
    gravity, fitted = number(record, 'gravity_accel'), falls(record)
    # If a timer skips or delays steps, their timestamps show another acceleration.
    values = [min(fall.acceleration, fall.per_step, key=lambda value: abs(value - gravity))
              for fall in fitted]
    off = median_high(abs(value - gravity) for value in values)
    longest = max(fitted, key=lambda fall: fall.times[-1])
    times = numpy.linspace(0.0, longest.times[-1], 50)
    text = f'{min(values):.3f} to {max(values):.3f} m/s^2 in {len(values)} falls (configured '
    return Finding(off <= RATE_TOLERANCE * gravity, f'{text}{gravity:g})', Plot(
        'Fall', 'time since the release (s)', 'depth (m)',
        (longest.times, longest.depths), (times, gravity * times * times / 2.0)))


@rule('fall: course', 'the brick starts falling in gravity',
      f'within {FALL_DEVIATION} m of a fall from rest at each timestamp ± {STEP} s, straight down',
      ['frames: broadcasters', 'place', 'drop'], needs_calm=True)
def falls_are_parabolas(record: Record) -> Finding:
    fitted = falls(record)
    off = largest(fall.off for fall in fitted)
    aside = largest(fall.aside.max() for fall in fitted)
    return Finding(off <= FALL_DEVIATION and aside <= NEAR,
                   f'at most {off:.4f} m off along the fall and {aside:.4f} m aside, in '
                   f'{len(fitted)} falls')


def judge_landing(record: Record, caught: bool) -> Finding:
    """Judge the heights at which bricks landed on the platform (if `caught`) or on the ground."""
    surface = 'platform' if caught else 'ground'
    landings = []  # Heights (m) at which bricks were dropped and at which they landed.
    for drop in dropped(record):
        # A brick may sink into the ground and then jump to it.
        track = [] if caught else record.brick_track(drop.released or 0, drop.end)
        heights = [brick.position[2] for _, brick in track]
        if min(heights, default=0.0) < -MAX_SINKING:
            raise Failed(f'a brick fell through the ground, to {min(heights):.1f} m')
        if drop.landed is not None and drop.caught is caught:
            landings.append((drop.place[2], min([drop.landed[2], *heights])))
    require_data(landings, f'no brick has landed on the {surface}')

    surfaces = [number(record, 'platform_height') if caught else 0.0]
    with suppress(Failed):  # The top of the platform may be above or below platform_height.
        surfaces += [model(record).platform_heights()[1]] if caught else []
    lowest, highest = min(surfaces), max(surfaces)
    bottom = min(brick_corners(record)[:, 2])
    gravity = record.profile.numbers.get('gravity_accel', NUMBERS['gravity_accel'])

    met, heights = True, [height + bottom for _, height in landings]
    for (start, _), height in zip(landings, heights):
        # At the end of the last time step, the brick may be below the surface on which it lands.
        step = sqrt(2.0 * gravity * max(start + bottom - lowest, 0.0)) * STEP
        met = met and lowest - step - NEAR <= height <= highest + step + NEAR
    return Finding(met, f'bottom of the brick at {min(heights):.3f} to {max(heights):.3f} m, '
                   f'{surface} at {lowest:.3f} m, in {len(heights)} drops')


rule('fall: ground', 'If the brick hits … the ground it stops falling',
     'the bottom of the brick stops on the ground',
     ['frames: broadcasters', 'place', 'drop'], needs_calm=True)(
         partial(judge_landing, caught=False))
rule('fall: platform', 'If the brick hits the platform … it stops falling',
     'the bottom of the brick stops on the top of the platform',
     ['URDF: numbers'], needs_calm=True)(partial(judge_landing, caught=True))


def catches(record: Record) -> list[DropWatch]:
    """Return the drops that ended on the platform, or raise Open if there are none."""
    return require_data([drop for drop in dropped(record) if drop.caught],
                        'no brick has landed on the platform')


def recently_driven(record: Record, stamp: int) -> float:
    """Return the distance (m) driven by the platform within 0.1 s before a time (ns)."""
    platforms = [record.pose('platform', stamp - 2 * delay) for delay in DELAYS]
    return max_motion(platform.position for platform in platforms if platform is not None)


def measure_ride(record: Record, drop: DropWatch) -> tuple[float, float, float]:
    """Return a brick's motions (m) on the platform: at the landing, in total, and at most."""
    down, places = drop.down or 0, []
    end = (drop.tilted or drop.end) - 20_000_000  # The pose of the platform in TF may be late.
    for stamp, brick in thin(record.brick_track(down, end)):
        platform = record.pose('platform', stamp)
        if platform is not None and inclination(platform) <= SAME_ANGLE:
            places.append(platform.locate(brick.position)[:2])
    if len(places) < 2:
        raise Open('the platform was never level, or its pose unknown, with a brick on it')
    landed = require(drop.landed, 'the brick did not land')
    # If the robot drives at the landing or shortly before the tilt, the brick may lag then.
    first, last = (recently_driven(record, stamp) for stamp in (down, end))
    return (max(dist(landed[:2], drop.place[:2]) - first, 0.0),
            max(dist(places[-1], places[0]) - first - last, 0.0), max_motion(places))


@rule('brick: rides', 'If the brick hits the platform it should move with the platform',
      f'the brick keeps its place on the platform within {MAX_JUMP} m while the robot is at rest, '
      f'and lags by at most {MAX_LAG:g} s while the robot drives', ['frames: robot', 'place'],
      needs_calm=True)
def brick_rides(record: Record) -> Finding:
    rides = [measure_ride(record, drop) for drop in catches(record)]
    landing, total, moving = (largest(motions) for motions in zip(*rides))
    allowed = top_speed(record) * MAX_LAG + NEAR
    met = largest([total, landing]) <= MAX_JUMP and moving <= allowed
    return Finding(met, f'moved by {landing:.4f} m at the landing, {total:.4f} m in total and '
                   f'{moving:.4f} m (limit {allowed:.3f} m) while driving, in {len(rides)} rides')


def close_platforms(record: Record, stamp: int) -> list[Pose]:
    """Return the known poses of the platform shortly before and after a time (ns)."""
    platforms = [record.pose('platform', stamp - lag) for lag in LAGS]
    return [platform for platform in platforms if platform is not None]


@rule('brick: angle', 'The angle of the brick … the same as the angle of the platform … at all '
      'times', f'equal within {SAME_ANGLE} rad in 99 of 100 inclined poses', ['brick: rides'],
      needs_calm=True)
def brick_has_the_angle(record: Record) -> Finding:
    off, level = [], 0
    for begin, end in record.trial_spans():
        for stamp, brick in thin(record.brick_track(begin, end - BEFORE_NS))[::5]:
            platform = record.pose('platform', stamp)
            if platform is None:
                continue
            if inclination(brick) <= SAME_ANGLE and inclination(platform) <= SAME_ANGLE:
                level += 1
            else:
                # The brick may have any angle that the platform has shortly before or after.
                off.append(min(angle_between(brick.upright, close.upright)
                               for close in close_platforms(record, stamp)))
    require_data(off, 'neither the brick nor the platform was inclined while both were known')
    usual = largest(sorted(off)[:len(off) - len(off) // 100])
    text = f'at most {usual:.4f} rad apart in {len(off)} inclined poses, and {level} level poses'
    if min(off) > SAME_ANGLE:
        raise Failed(text)
    return Finding(usual <= SAME_ANGLE, text)


def slide_track(record: Record, begin: int, end: int
                ) -> Iterator[tuple[int, Pose, list[Pose]]]:
    """Yield the time (ns), the brick and all close_platforms, unless one of them is unknown."""
    for stamp, brick in record.brick_track(begin, end):
        platforms = close_platforms(record, stamp)
        if len(platforms) == len(LAGS):
            yield stamp, brick, platforms


def fit_slide(gravity: float, track: list[tuple[int, Pose, list[Pose]]],
              tilts: list[tuple[int, float]]) -> tuple[float, float, Plot]:
    """
    Fit a frictionless slide with an unknown delay and gravity to a slide_track.

    :param tilts: times (ns) and angles (rad) of the platform joint
    :return: maximum deviation (m), ratio of the fitted gravity to the given one, and plot
    """
    steepest = max((platforms[0] for _, _, platforms in track), key=inclination)
    downhill = -steepest.axes[2, :2] / (hypot(*steepest.axes[2, :2]) or 1.0)
    measured = numpy.array([[
        platform.locate(brick.position)[:2] @ downhill for platform in platforms]
        for _, brick, platforms in track])
    places = measured[:, LAGS.index(0)]
    _, brick, platforms = track[0]
    height = platforms[LAGS.index(0)].locate(brick.position)[2]
    stamps = numpy.array([stamp for stamp, _, _ in track])
    times = (stamps - stamps[0]) * SECONDS_PER_NS
    steps = numpy.diff(times, prepend=times[0])
    tilted, angles = (numpy.array(values) for values in zip(*tilts))

    fits = []
    for delay in DELAYS:
        latest = numpy.maximum(numpy.searchsorted(tilted, stamps - delay, 'right') - 1, 0)
        sines, cosines = numpy.abs(numpy.sin(angles[latest])), numpy.cos(angles[latest])
        gains = gravity * sines * steps  # Of speed in each step.
        computed = numpy.cumsum((numpy.cumsum(gains) - gains / 2.0) * steps)
        # When the platform tilts, the brick may turn with it, or keep its place in the world.
        for start in (places[0], places[0] * cosines - height * sines):
            ratio = float(computed @ (places - start) / (computed @ computed or 1.0))
            fitted = start + ratio * computed
            # Each position of the brick may be relative to any of the poses of the platform.
            off = float(numpy.abs(measured - fitted[:, None]).min(axis=1).max())
            fits.append((off, ratio, Plot('Slide', 'time (s)', 'distance down the slope (m)',
                                          (times, places), (times, start + computed))))
    return min(fits, key=itemgetter(0))


@rule('slide: law', 'it should slide off the platform (friction-less, but in gravity)',
      f'g sin(angle) ± {SLIDE_TOLERANCE:.0%} down the slope, within {SLIDE_DEVIATION} m',
      ['brick: rides'], needs_calm=True)
def slides_are_frictionless(record: Record) -> Finding:
    gravity, joint = number(record, 'gravity_accel'), model(record).joint('platform')
    slides = []
    for drop in catches(record):
        if drop.tilted is not None:
            # If the brick never leaves the platform, only the first second of the slide is judged.
            end = drop.floated or min(drop.end, drop.tilted + NS_PER_SECOND)
            track = list(slide_track(record, rest_before_tilt(drop), end))
            tilts = record.joint(joint.name, drop.tilted - NS_PER_SECOND, end)
            if track and tilts:  # On a busy machine, the poses may be unknown.
                slides.append(fit_slide(gravity, track, tilts))
    off, ratios, plots = zip(*require_data(slides, 'no tilted brick was observed'))
    error = largest(abs(ratio - 1.0) for ratio in ratios)
    return Finding(largest(off) <= SLIDE_DEVIATION and error <= SLIDE_TOLERANCE,
                   f'{min(ratios):.2f} to {max(ratios):.2f} of g sin(angle), at most '
                   f'{largest(off):.4f} m off in {len(slides)} slides', plots[0])


def rest_before_tilt(drop: DropWatch) -> int:
    """Return a time (ns) at which a brick rests on the platform, shortly before it is tilted."""
    return max((drop.tilted or 0) - 2 * BEFORE_NS, drop.down or 0)


def end_of_slide(record: Record, drop: DropWatch, radius: float) -> tuple[float, float] | None:
    """Return the distances (m) from the platform's edge and from the plane of the slide."""
    if drop.floated is None or drop.tilted is None:
        return None
    length, width, _ = numpy.ptp(brick_corners(record), axis=0)
    rest = rest_before_tilt(drop)
    before, level = record.on_platform(rest), record.pose('platform', rest)
    brick = record.pose('brick', drop.floated)
    platforms = close_platforms(record, drop.floated)
    if not platforms or brick is None or before is None or level is None:
        return None  # On a busy machine, a pose may be unknown.
    ends = []
    for platform in platforms:
        forward, place = brick.axes[:, 0] @ platform.axes, platform.locate(brick.position)
        # When the platform tilts, the brick may turn with it, or keep its place in the world.
        kept = (level.axes @ before) @ platform.axes - before
        for x, y, _ in (place, place - kept):
            clearance = distance_to_rectangle(
                (x, y), atan2(forward[1], forward[0]), (length, width)) - radius
            ends.append((abs(clearance), abs(place[2] - before[2]), clearance))
    # TF may contain the pose that the platform had shortly before.
    _, height, clearance = min(ends)
    return clearance, height


@rule('slide: end', 'When the trailing-edge brick clears the platform, it magically floats',
      'the slide stays on the plane of the platform and ends when the trailing edge has cleared '
      'the platform', needs_calm=True)
def slides_end_at_the_edge(record: Record) -> Finding:
    radius = number(record, 'platform_radius')
    ends = [end_of_slide(record, drop, radius) for drop in catches(record)]
    clearances, heights = zip(*require_data(ends, 'no brick has slid off'))
    met = (min(clearances) >= -EARLY_END and largest(clearances) <= LATE_END
           and largest(heights) <= PLANE_DEVIATION)
    distances = ', '.join(f'{clearance:+.3f}' for clearance in clearances)
    return Finding(met, f'{distances} m from the platform to the brick, '
                   f'{largest(heights):.3f} m off the plane')


@rule('brick: floats', 'it magically floats in place',
      'the brick stays fixed in the world frame while the robot drives', ['slide: end'],
      needs_calm=True)
def brick_floats(record: Record) -> Finding:
    motions = [max_motion(brick.position for _, brick in record.brick_track(
                   drop.floated, drop.end - BEFORE_NS))
               for drop in catches(record) if drop.floated is not None]
    return within(5.0 * STILL, motions, 'no brick floats', 'moved by at most {:.4f} m in {} drops')
