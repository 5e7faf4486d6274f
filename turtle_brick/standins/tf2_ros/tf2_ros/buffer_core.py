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
"""The tree of frames: transforms go in, transforms between any two frames come out."""

from collections.abc import Iterator
from itertools import chain
from math import inf, isnan
from threading import RLock

from builtin_interfaces.msg import Duration as DurationMsg
from builtin_interfaces.msg import Time as TimeMsg
from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.logging import get_logger
from rclpy.time import Time
from tf2_ros.transform_cache import canonical, display_time, NoDataError, StaticCache, TimeCache

AnyTime = Time | TimeMsg
# A translation and a rotation: x, y, z, qx, qy, qz, qw.
Transform = tuple[float, float, float, float, float, float, float]

_NANOSECONDS = 1_000_000_000
# A longer way to the root is taken for a loop.
_MAX_DEPTH = 1000
_IDENTITY: Transform = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class TransformException(Exception):
    """Any of the below."""


class ConnectivityException(TransformException):
    """Two frames are not part of one tree."""


class LookupException(TransformException):
    """A frame does not exist, or the frames form a loop."""


class ExtrapolationException(TransformException):
    """The time is outside what the buffer holds."""


class InvalidArgumentException(TransformException):
    """The name of a frame is empty or begins with a slash."""


class TimeoutException(TransformException):
    """A transform did not come in time."""


class Frame:
    """A frame that a transform has named."""

    def __init__(self, name: str) -> None:
        """Make a frame that has no parent yet."""
        self.name = name
        self.cache: StaticCache | TimeCache | None = None
        """The transforms to its parent; None if it has only been named as a parent."""
        self.authority = ''
        """Who sent the last transform."""


def nanoseconds_of(time: AnyTime | Duration | DurationMsg) -> int:
    """Return a time or a duration, one of rclpy or a message, in ns."""
    if hasattr(time, 'nanoseconds'):
        return time.nanoseconds
    if hasattr(time, 'nanosec'):
        return time.sec * _NANOSECONDS + time.nanosec
    raise TypeError(f'time must have sec and nanosec, or nanoseconds, but {time!r} has not')


def compose(outer: Transform, inner: Transform) -> Transform:
    """Return one transform for two, of which the inner is applied first."""
    x, y, z, qx, qy, qz, qw = outer
    ix, iy, iz, px, py, pz, pw = inner
    # The vector v rotated by (q, w) is v + 2 w (q x v) + 2 q x (q x v).
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
    """Return the inverse of a transform."""
    x, y, z, qx, qy, qz, qw = transform
    inverse = (0.0, 0.0, 0.0, -qx, -qy, -qz, qw)
    return compose(inverse, (-x, -y, -z, 0.0, 0.0, 0.0, 1.0))


class BufferCore:
    """
    A tree of frames with the transforms of the recent past, safe to use from several threads.

    It answers as the real tf2 does, also to times that it cannot serve and to bad input. A time of
    zero means the latest one at which there is a transform.
    """

    def __init__(self, cache_time: Duration | None = None) -> None:
        """Make an empty buffer in which each frame's transforms go back so far; 10 s if None."""
        self._cache_time = 10 * _NANOSECONDS if cache_time is None else nanoseconds_of(cache_time)
        self._frames: dict[str, Frame] = {}
        self._lock = RLock()

    def set_transform(self, transform: TransformStamped, authority: str) -> None:
        """Add a transform; one that cannot be used is ignored with a message in the log."""
        self._insert(transform, authority, TimeCache)

    def set_transform_static(self, transform: TransformStamped, authority: str) -> None:
        """Add a transform that holds at all times."""
        self._insert(transform, authority, StaticCache)

    def clear(self) -> None:
        """Forget all transforms but the static ones; the frames stay known."""
        with self._lock:
            for frame in self._frames.values():
                if frame.cache is not None:
                    frame.cache.clear()

    def can_transform_core(self, target_frame: str, source_frame: str, time: AnyTime
                           ) -> tuple[bool, str]:
        """Tell whether there is a transform, and if not, why."""
        nanoseconds = nanoseconds_of(time)
        with self._lock:
            if target_frame == source_frame:
                return True, ''
            reason = self._missing(target_frame=target_frame, source_frame=source_frame)
            if reason:
                return False, reason
            try:
                self._between(self._frames[target_frame], self._frames[source_frame], nanoseconds)
            except TransformException as error:
                return False, str(error)
            return True, ''

    def can_transform_full_core(self, target_frame: str, target_time: AnyTime, source_frame: str,
                                source_time: AnyTime, fixed_frame: str) -> tuple[bool, str]:
        """Tell whether there is a transform between two times, and if not, why."""
        with self._lock:
            reason = self._missing(target_frame=target_frame, source_frame=source_frame,
                                   fixed_frame=fixed_frame)
            if reason:
                return False, reason
            possible, reason = self.can_transform_core(target_frame, fixed_frame, target_time)
            if possible:
                possible, reason = self.can_transform_core(fixed_frame, source_frame, source_time)
            return possible, reason

    def lookup_transform_core(self, target_frame: str, source_frame: str, time: AnyTime
                              ) -> TransformStamped:
        """Return the pose of the source frame in the target frame, or raise why there is none."""
        nanoseconds = nanoseconds_of(time)
        with self._lock:
            found = self._lookup(target_frame, source_frame, nanoseconds)
        return self._message(target_frame, source_frame, *found)

    def lookup_transform_full_core(self, target_frame: str, target_time: AnyTime,
                                   source_frame: str, source_time: AnyTime, fixed_frame: str
                                   ) -> TransformStamped:
        """Return the pose that the source frame had, in the target frame at another time."""
        target_nanoseconds, source_nanoseconds = map(nanoseconds_of, (target_time, source_time))
        with self._lock:
            for role, name in (('target', target_frame), ('source', source_frame),
                               ('fixed', fixed_frame)):
                self._known(f'lookupTransform argument {role}_frame', name)
            _, first = self._lookup(fixed_frame, source_frame, source_nanoseconds)
            nanoseconds, second = self._lookup(target_frame, fixed_frame, target_nanoseconds)
        return self._message(target_frame, source_frame, nanoseconds, compose(second, first))

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> Time:
        """Return the latest time with a transform; zero if there are only static ones between."""
        with self._lock:
            target = self._known('get_latest_common_time', target_frame)
            source = self._known('get_latest_common_time', source_frame)
            if target is source:
                return Time(nanoseconds=source.cache.latest_time if source.cache else 0)
            return Time(nanoseconds=self._latest_common_time(target, source))

    def all_frames_as_string(self) -> str:
        """Return a line for each frame that has a parent."""
        text = ''
        with self._lock:
            for frame in self._frames.values():
                if frame.cache is not None:
                    _, parent = frame.cache.latest()
                    name = 'NO_PARENT' if parent is None else parent.name
                    text += f'Frame {frame.name} exists with parent {name}.\n'
        return text

    def all_frames_as_yaml(self) -> str:
        """Return a YAML map of the frames: parent, last sender, rate and times."""
        text = ''
        with self._lock:
            for frame in self._frames.values():
                cache = frame.cache
                if cache is None or cache.length == 0:
                    continue
                covered = cache.latest_time - cache.oldest_time
                rate = cache.length * 1e9 / max(covered, 100_000)
                text += (f'{frame.name}: \n'
                         f"  parent: '{cache.latest()[1].name}'\n"
                         f"  broadcaster: '{frame.authority}'\n"
                         f'  rate: {rate:.3f}\n'
                         f'  most_recent_transform: {display_time(cache.latest_time)}\n'
                         f'  oldest_transform: {display_time(cache.oldest_time)}\n'
                         f'  buffer_length: {covered * 1e-9:.3f}\n')
            return text if self._frames else '[]'

    # ------------------------------------------------------------------------------ what comes in

    def _insert(self, transform: TransformStamped, authority: str,
                cache_type: type[StaticCache] | type[TimeCache]) -> None:
        parent_name = transform.header.frame_id.removeprefix('/')
        child_name = transform.child_frame_id.removeprefix('/')
        translation, rotation = transform.transform.translation, transform.transform.rotation
        x, y, z = translation.x, translation.y, translation.z
        qx, qy, qz, qw = rotation.x, rotation.y, rotation.z, rotation.w
        square = qx * qx + qy * qy + qz * qz + qw * qw
        # Any other length is made a unit one, as in tf2. A NaN fails here.
        if not (0.0 < square < inf and parent_name and child_name and parent_name != child_name
                and x == x and y == y and z == z):
            _refuse(parent_name, child_name, authority, (x, y, z), (qx, qy, qz, qw))
            return
        stamp = transform.header.stamp
        time = stamp.sec * _NANOSECONDS + stamp.nanosec
        with self._lock:
            child = self._frame(child_name)
            parent = self._frame(parent_name)
            if type(child.cache) is not cache_type:
                child.cache = (
                    StaticCache() if cache_type is StaticCache else TimeCache(self._cache_time))
            inserted = child.cache.insert(time, (parent, x, y, z, *canonical(qx, qy, qz, qw)))
            if inserted:
                child.authority = authority
        if not inserted:
            get_logger('tf2').warning(
                f'TF_OLD_DATA ignoring data from the past for frame {child_name} at time '
                f'{display_time(time)} according to authority {authority}\nPossible reasons are '
                'listed at http://wiki.ros.org/tf/Errors%20explained')

    def _frame(self, name: str) -> Frame:
        if name not in self._frames:
            self._frames[name] = Frame(name)
        return self._frames[name]

    # ----------------------------------------------------------------------------- what comes out

    def _problem(self, name: str) -> str:
        """Return why there is no frame of a name; nothing if there is one."""
        if name in self._frames:
            return ''
        if not name:
            return 'in tf2 frame_ids cannot be empty'
        return "in tf2 frame_ids cannot start with a '/'" if name[0] == '/' else (
            'frame does not exist')

    def _missing(self, **frames: str) -> str:
        """Return the reason for the first frame that is not there, as canTransform says it."""
        for argument, name in frames.items():
            if problem := self._problem(name):
                return (f'Invalid frame ID "{name}" passed to canTransform argument {argument} - '
                        f'{problem}')
        return ''

    def _known(self, what: str, name: str) -> Frame:
        """Return a frame, or raise that there is none, as lookupTransform says it."""
        problem = self._problem(name)
        if problem == 'frame does not exist':
            raise LookupException(f'"{name}" passed to {what} does not exist. ')
        if problem:
            raise InvalidArgumentException(
                f'Invalid argument "{name}" passed to {what} - {problem}')
        return self._frames[name]

    def _lookup(self, target_name: str, source_name: str, time: int) -> tuple[int, Transform]:
        """Return a time (ns) and the pose of the source in the target frame then."""
        if target_name == source_name:
            # tf2 has it so for frames that it does not know, too.
            frame = self._frames.get(target_name)
            if time == 0 and frame is not None and frame.cache is not None:
                time = frame.cache.latest_time
            return time, _IDENTITY
        return self._between(self._known('lookupTransform argument target_frame', target_name),
                             self._known('lookupTransform argument source_frame', source_name),
                             time)

    def _between(self, target: Frame, source: Frame, time: int) -> tuple[int, Transform]:
        """Return a time (ns) and the pose of the source in another frame then."""
        if time == 0:
            time = self._latest_common_time(target, source)
        top, of_source, source_gap = self._climb(source, target, target, time)
        if top is target:
            return time, of_source
        # If the way from the source has a gap, the two frames may still meet below that.
        end, of_target, gap = self._climb(target, source, top, time)
        if end is source:
            return time, invert(of_target)
        if end is top:
            return time, compose(invert(of_target), of_source)
        gap = gap or source_gap
        if gap is not None:
            raise ExtrapolationException(f'{gap}, when looking up transform from frame '
                                         f'[{source.name}] to frame [{target.name}]')
        raise self._unconnected(target, source)

    def _climb(self, frame: Frame, goal: Frame, other: Frame, time: int
               ) -> tuple[Frame, Transform, NoDataError | None]:
        """Return how far a frame's ancestors lead at a time, its pose there, and what is next."""
        pose = _IDENTITY
        for _ in range(_MAX_DEPTH + 1):
            if frame is goal or frame is other or frame.cache is None:
                return frame, pose, None
            try:
                entry = frame.cache.get(time)
            except NoDataError as gap:
                return frame, pose, gap
            pose = entry[1:] if pose is _IDENTITY else compose(entry[1:], pose)
            frame = entry[0]
        raise self._loop()

    def _latest_common_time(self, target: Frame, source: Frame) -> int:
        """Return the latest time (ns) at which every frame between two has a transform."""
        from_source = {source: 0}
        for ancestor, latest in self._ancestors(source):
            if ancestor is target:
                return latest
            from_source[ancestor] = latest
        for ancestor, latest in chain([(target, 0)], self._ancestors(target)):
            if ancestor in from_source:
                return min(filter(None, (from_source[ancestor], latest)), default=0)
        raise self._unconnected(target, source)

    def _ancestors(self, frame: Frame) -> Iterator[tuple[Frame, int]]:
        """Yield each, and the latest time (ns) up to there; static transforms do not limit it."""
        common = 0
        for _ in range(_MAX_DEPTH + 1):
            latest, parent = (0, None) if frame.cache is None else frame.cache.latest()
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
    def _unconnected(target: Frame, source: Frame) -> ConnectivityException:
        return ConnectivityException(
            f"Could not find a connection between '{target.name}' and '{source.name}' because "
            'they are not part of the same tree.Tf has two or more unconnected trees.')

    @staticmethod
    def _message(target_name: str, source_name: str, time: int, transform: Transform
                 ) -> TransformStamped:
        x, y, z, *rotation = transform
        message = TransformStamped(child_frame_id=source_name)
        message.header.frame_id = target_name
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(time, _NANOSECONDS)
        t, r = message.transform.translation, message.transform.rotation
        t.x, t.y, t.z = x, y, z
        r.x, r.y, r.z, r.w = canonical(*rotation)
        return message


def _refuse(parent: str, child: str, authority: str, translation: tuple[float, ...],
            rotation: tuple[float, ...]) -> None:
    """Say in the log why a transform cannot be used."""
    if child == parent:
        reason = (f'TF_SELF_TRANSFORM: Ignoring transform from authority "{authority}" with '
                  f'frame_id and child_frame_id "{child}" because they are the same')
    elif not child:
        reason = (f'TF_NO_CHILD_FRAME_ID: Ignoring transform from authority "{authority}" because '
                  'child_frame_id not set')
    elif not parent:
        reason = (f'TF_NO_FRAME_ID: Ignoring transform with child_frame_id "{child}" from '
                  f'authority "{authority}" because frame_id not set')
    elif any(map(isnan, (*translation, *rotation))):
        reason = (f'TF_NAN_INPUT: Ignoring transform for child_frame_id "{child}" from authority '
                  f'"{authority}" because of a nan value in the transform {translation} '
                  f'{rotation}')
    else:
        reason = (f'TF_DENORMALIZED_QUATERNION: Ignoring transform for child_frame_id "{child}" '
                  f'from authority "{authority}" because of an invalid quaternion in the '
                  f'transform {rotation}')
    get_logger('tf2').error(reason)
