# SPDX-License-Identifier: Apache-2.0
"""
Store transforms and compute the transform between any two frames.

A cache stores the recent poses of a frame in its parent frame as tuples (parent, x, y, z, qx, qy,
qz, qw). Times are integers (ns).
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from itertools import chain
from math import acos, inf, sin, sqrt
from threading import Condition
from typing import Union

from builtin_interfaces.msg import Duration as DurationMsg
from builtin_interfaces.msg import Time as TimeMsg
from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.logging import get_logger
from rclpy.time import Time

AnyTime = Union[Time, TimeMsg]
Transform = tuple[float, float, float, float, float, float, float]
"""A translation (x, y, z) in meters and a rotation as a quaternion (qx, qy, qz, qw)."""
Rotation = tuple[float, float, float, float]
Entry = tuple[str, float, float, float, float, float, float, float]

_NS_PER_SECOND = 1_000_000_000
_MAX_DEPTH = 1000
"""Maximum number of frames on a path to the root. A longer path is treated as a loop."""
IDENTITY: Transform = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class TransformException(Exception):
    """The base class of all transform exceptions."""


class ConnectivityException(TransformException):
    """Raised when two frames belong to different trees."""


class LookupException(TransformException):
    """Raised when a frame does not exist, or when the frames form a loop."""


class ExtrapolationException(TransformException):
    """Raised when the requested time is outside the range of the stored transforms."""


class InvalidArgumentException(TransformException):
    """Raised when a frame name is empty or begins with a slash."""


class TimeoutException(TransformException):
    """Never raised in this stand-in."""


class NoDataError(Exception):
    """Raised when a cache has no transform for the requested time. The message is the reason."""


def display_time(time: int) -> str:
    """Format a time (ns) in seconds, as tf2 does."""
    seconds, nanoseconds = divmod(time, _NS_PER_SECOND)
    return f'{seconds + 1e-9 * nanoseconds:.6f}'


def canonical(x: float, y: float, z: float, w: float) -> Rotation:
    """Normalize a quaternion to unit length and choose its sign as tf2 does."""
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    square = xx + yy + zz + ww
    if 4.0 * ww > square:
        sign = w
    elif xx < yy:
        sign = z if yy < zz else y
    else:
        sign = z if xx < zz else x
    scale = 1.0 / sqrt(square) if sign > 0.0 else -1.0 / sqrt(square)
    return (x * scale, y * scale, z * scale, w * scale)


def interpolate(before: Entry, after: Entry, ratio: float) -> Entry:
    """Interpolate positions along a straight line and rotations along the shortest arc."""
    cosine = sum(p * q for p, q in zip(before[4:], after[4:]))
    half_angle = acos(min(1.0, abs(cosine)))
    x, y, z = ((1.0 - ratio) * u + ratio * v for u, v in zip(before[1:4], after[1:4]))
    if half_angle == 0.0:
        return (before[0], x, y, z, before[4], before[5], before[6], before[7])
    a = sin((1.0 - ratio) * half_angle) / sin(half_angle)
    b = sin(ratio * half_angle) / (-sin(half_angle) if cosine < 0.0 else sin(half_angle))
    qx, qy, qz, qw = (a * p + b * q for p, q in zip(before[4:], after[4:]))
    return (before[0], x, y, z, qx, qy, qz, qw)


class Cache:
    """The recent transforms of a moving frame, or the only transform of a static frame."""

    def __init__(self, static: bool, max_age: int) -> None:
        self.static = static
        self.authority = ''
        """Sender of the latest transform."""
        self._max_age = max_age
        self._times: list[int] = []
        self._entries: list[Entry] = []

    def latest(self) -> tuple[int, str | None]:
        """Return the time (ns) and parent of the latest transform, or (0, None) if none exists."""
        return (self._times[-1], self._entries[-1][0]) if self._times else (0, None)

    def as_yaml(self) -> str:
        """Return the lines about this frame in the description of all frames."""
        latest, oldest = self._times[-1], self._times[0]
        length = (latest - oldest) / _NS_PER_SECOND
        return (f"  parent: '{self._entries[-1][0]}'\n  broadcaster: '{self.authority}'\n"
                f'  rate: {len(self._times) / max(length, 1e-4):.3f}\n'
                f'  most_recent_transform: {display_time(latest)}\n'
                f'  oldest_transform: {display_time(oldest)}\n  buffer_length: {length:.3f}\n')

    def clear(self) -> None:
        if not self.static:
            self._times.clear()
            self._entries.clear()

    def insert(self, time: int, entry: Entry) -> bool:
        """Add a transform, or return False if it is `max_age` older than the latest transform."""
        if self.static:
            self._times, self._entries = [0], [entry]
            return True
        times = self._times
        if times:
            # As in tf2, old transforms are removed before a new one is added.
            expired = bisect_left(times, times[-1] - self._max_age)
            del times[:expired], self._entries[:expired]
            if time < times[-1] - self._max_age:
                return False
        index = bisect_right(times, time)
        if entry not in self._entries[bisect_left(times, time):index]:
            times.insert(index, time)
            self._entries.insert(index, entry)
        return True

    def get(self, time: int) -> Entry:
        """Return the transform interpolated at a given time (ns), or raise NoDataError."""
        times = self._times
        if not times:
            raise NoDataError('')
        oldest, latest = times[0], times[-1]
        if self.static or time == latest:
            return self._entries[-1]
        if len(times) == 1:
            raise NoDataError(f'Lookup would require extrapolation at time {display_time(time)}, '
                              f'but only time {display_time(oldest)} is in the buffer')
        if not oldest <= time <= latest:
            tense, which, limit = ('future', 'latest', latest) if time > latest else (
                'past', 'earliest', oldest)
            raise NoDataError(
                f'Lookup would require extrapolation into the {tense}.  Requested time '
                f'{display_time(time)} but the {which} data is at time {display_time(limit)}')
        if time == oldest:
            return self._entries[0]
        index = bisect_right(times, time)
        before, after = self._entries[index - 1:index + 1]
        if before[0] != after[0]:
            return before
        earlier = times[index - 1]
        return interpolate(before, after, (time - earlier) / (times[index] - earlier))


def nanoseconds_of(time: AnyTime | Duration | DurationMsg) -> int:
    """Convert a time or a duration, either an rclpy object or a message, to nanoseconds."""
    if isinstance(time, (Time, Duration)):
        return time.nanoseconds
    if hasattr(time, 'nanosec'):
        return time.sec * _NS_PER_SECOND + time.nanosec
    raise TypeError(f'{time!r} has neither nanoseconds nor sec and nanosec')


def compose(outer: Transform, inner: Transform) -> Transform:
    """Return the transform that applies `inner` first and then `outer`."""
    x, y, z, qx, qy, qz, qw = outer
    ix, iy, iz, px, py, pz, pw = inner
    # The vector v rotated by the quaternion (q, w) is v + 2 w (q x v) + 2 q x (q x v).
    cx = 2.0 * (qy * iz - qz * iy)
    cy = 2.0 * (qz * ix - qx * iz)
    cz = 2.0 * (qx * iy - qy * ix)
    return (x + ix + qw * cx + qy * cz - qz * cy,
            y + iy + qw * cy + qz * cx - qx * cz,
            z + iz + qw * cz + qx * cy - qy * cx,
            qw * px + qx * pw + qy * pz - qz * py,
            qw * py + qy * pw + qz * px - qx * pz,
            qw * pz + qz * pw + qx * py - qy * px,
            qw * pw - qx * px - qy * py - qz * pz)


def invert(transform: Transform) -> Transform:
    x, y, z, qx, qy, qz, qw = transform
    inverse = (0.0, 0.0, 0.0, -qx, -qy, -qz, qw)
    return compose(inverse, (-x, -y, -z, 0.0, 0.0, 0.0, 1.0))


class BufferCore:
    """
    A thread-safe tree of frames with recent transforms.

    The results and exceptions are the same as in the real tf2. A time of zero means the latest
    time at which the transform is available.
    """

    def __init__(self, cache_time: Duration | None = None) -> None:
        self._cache_time = nanoseconds_of(cache_time or Duration(seconds=10))
        self._frames: dict[str, Cache | None] = {}
        """Transform cache of each frame, keyed by frame name (None if the frame has no parent)."""
        self._changed = Condition()
        """Condition that is notified when a transform is added. Its lock protects the frames."""

    def set_transform(self, transform: TransformStamped, authority: str) -> None:
        """Add a transform, or log an error if the transform is invalid."""
        self._insert(transform, authority, False)

    def set_transform_static(self, transform: TransformStamped, authority: str) -> None:
        self._insert(transform, authority, True)

    def clear(self) -> None:
        """Remove all non-static transforms, but keep the frames."""
        with self._changed:
            for cache in filter(None, self._frames.values()):
                cache.clear()

    def can_transform_core(self, target_frame: str, source_frame: str, time: AnyTime
                           ) -> tuple[bool, str]:
        """Return whether a transform is available, and if not, the reason."""
        nanoseconds = nanoseconds_of(time)
        with self._changed:
            if target_frame == source_frame:
                return True, ''
            for argument, name in (('target_frame', target_frame), ('source_frame', source_frame)):
                if problem := self._problem(name):
                    return False, (f'Invalid frame ID "{name}" passed to canTransform argument '
                                   f'{argument} - {problem}')
            try:
                self._between(target_frame, source_frame, nanoseconds)
            except TransformException as error:
                return False, str(error)
            return True, ''

    def lookup_transform_core(self, target_frame: str, source_frame: str, time: AnyTime
                              ) -> TransformStamped:
        """Return the pose of the source frame in the target frame, or raise TransformException."""
        nanoseconds = nanoseconds_of(time)
        with self._changed:
            if target_frame == source_frame:
                # As in tf2, a lookup from a frame to itself succeeds even for an unknown frame.
                cache = self._frames.get(target_frame)
                if nanoseconds == 0 and cache is not None:
                    nanoseconds, _ = cache.latest()
                return stamped(target_frame, source_frame, nanoseconds, IDENTITY)
            self._check('target_frame', target_frame)
            self._check('source_frame', source_frame)
            return stamped(target_frame, source_frame,
                           *self._between(target_frame, source_frame, nanoseconds))

    def all_frames_as_string(self) -> str:
        with self._changed:
            return ''.join(f'Frame {name} exists with parent {cache.latest()[1] or "NO_PARENT"}.\n'
                           for name, cache in self._frames.items() if cache is not None)

    def all_frames_as_yaml(self) -> str:
        """Return the parent, rate and times of each frame as YAML."""
        with self._changed:
            return ''.join(f'{name}: \n{cache.as_yaml()}' for name, cache in self._frames.items()
                           if cache is not None and cache.latest()[1]) or '[]'

    # ------------------------------------------------------------------------------------- input

    def _insert(self, transform: TransformStamped, authority: str, static: bool) -> None:
        parent_name = transform.header.frame_id.removeprefix('/')
        child_name = transform.child_frame_id.removeprefix('/')
        translation, rotation = transform.transform.translation, transform.transform.rotation
        x, y, z = translation.x, translation.y, translation.z
        qx, qy, qz, qw = rotation.x, rotation.y, rotation.z, rotation.w
        square = qx * qx + qy * qy + qz * qz + qw * qw
        # Nonzero quaternions are normalized later, as in tf2. NaN fails these conditions.
        if not (0.0 < square < inf and parent_name and child_name and parent_name != child_name
                and x == x and y == y and z == z):
            get_logger('tf2').error(
                f'Ignoring transform from authority "{authority}" with frame_id "{parent_name}" '
                f'and child_frame_id "{child_name}" because a frame, the translation {(x, y, z)} '
                f'or the rotation {(qx, qy, qz, qw)} is invalid')
            return
        stamp = transform.header.stamp
        time = stamp.sec * _NS_PER_SECOND + stamp.nanosec
        with self._changed:
            cache = self._frames.setdefault(child_name)
            self._frames.setdefault(parent_name)
            if cache is None or cache.static is not static:
                cache = self._frames[child_name] = Cache(static, self._cache_time)
            cache.authority = authority
            inserted = cache.insert(time, (parent_name, x, y, z, *canonical(qx, qy, qz, qw)))
            self._changed.notify_all()
        if not inserted:
            get_logger('tf2').warning(
                f'TF_OLD_DATA ignoring data from the past for frame {child_name} at time '
                f'{display_time(time)} according to authority {authority}\nPossible reasons are '
                'listed at http://wiki.ros.org/tf/Errors%20explained')

    # ------------------------------------------------------------------------------------ output

    def _problem(self, name: str) -> str:
        """Return the reason why a frame cannot be used, or an empty string if the frame exists."""
        if name in self._frames:
            return ''
        if not name:
            return 'in tf2 frame_ids cannot be empty'
        return "in tf2 frame_ids cannot start with a '/'" if name[0] == '/' else (
            'frame does not exist')

    def _check(self, argument: str, name: str) -> None:
        problem = self._problem(name)
        if problem == 'frame does not exist':
            raise LookupException(
                f'"{name}" passed to lookupTransform argument {argument} does not exist. ')
        if problem:
            raise InvalidArgumentException(
                f'Invalid argument "{name}" passed to lookupTransform argument {argument} - '
                f'{problem}')

    def _between(self, target: str, source: str, time: int) -> tuple[int, Transform]:
        """Return the time (ns) and value of the pose of the source frame in the target frame."""
        if time == 0:
            time = self._latest_common_time(target, source)
        top, of_source, source_gap = self._climb(source, target, target, time)
        if top == target:
            return time, of_source
        # The path from the source may have a gap, but the paths may meet before this gap.
        end, of_target, gap = self._climb(target, source, top, time)
        if end == source:
            return time, invert(of_target)
        if end == top:
            return time, compose(invert(of_target), of_source)
        gap = gap or source_gap
        if gap is not None:
            raise ExtrapolationException(
                f'{gap}, when looking up transform from frame [{source}] to frame [{target}]')
        raise self._unconnected(target, source)

    def _climb(self, frame: str, goal: str, other: str, time: int
               ) -> tuple[str, Transform, NoDataError | None]:
        """Climb to an ancestor. Return the ancestor, the pose of `frame` in it, and any error."""
        pose = IDENTITY
        for _ in range(_MAX_DEPTH + 1):
            cache = self._frames[frame]
            if frame == goal or frame == other or cache is None:
                return frame, pose, None
            try:
                entry = cache.get(time)
            except NoDataError as gap:
                return frame, pose, gap
            pose = entry[1:] if pose is IDENTITY else compose(entry[1:], pose)
            frame = entry[0]
        raise self._loop()

    def _latest_common_time(self, target: str, source: str) -> int:
        """Return the latest time (ns) at which all transforms between two frames are available."""
        from_source = {source: 0}
        for ancestor, latest in self._ancestors(source):
            if ancestor == target:
                return latest
            from_source[ancestor] = latest
        for ancestor, latest in chain([(target, 0)], self._ancestors(target)):
            if ancestor in from_source:
                return min(filter(None, (from_source[ancestor], latest)), default=0)
        raise self._unconnected(target, source)

    def _ancestors(self, frame: str) -> Iterator[tuple[str, int]]:
        """Yield each ancestor of a frame and the latest common time (ns) along the path to it."""
        common = 0
        for _ in range(_MAX_DEPTH + 1):
            cache = self._frames[frame]
            latest, parent = (0, None) if cache is None else cache.latest()
            if parent is None:
                return
            if latest and (latest < common or not common):
                common = latest
            yield parent, common
            frame = parent
        raise self._loop()

    def _loop(self) -> LookupException:
        return LookupException('The tf tree is invalid because it contains a loop.\n'
                               f'{self.all_frames_as_string()}\n')

    @staticmethod
    def _unconnected(target: str, source: str) -> ConnectivityException:
        return ConnectivityException(
            f"Could not find a connection between '{target}' and '{source}' because "
            'they are not part of the same tree.Tf has two or more unconnected trees.')


def stamped(target_name: str, source_name: str, time: int, transform: Transform
            ) -> TransformStamped:
    """Return a TransformStamped message for a transform at a given time (ns)."""
    message = TransformStamped(child_frame_id=source_name)
    message.header.frame_id = target_name
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(time, _NS_PER_SECOND)
    fill(message, transform)
    return message


def fill(message: TransformStamped, transform: Transform) -> None:
    """Write a transform to a message."""
    t, r = message.transform.translation, message.transform.rotation
    t.x, t.y, t.z = transform[:3]
    r.x, r.y, r.z, r.w = canonical(*transform[3:])
