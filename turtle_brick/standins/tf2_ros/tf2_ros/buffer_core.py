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

from collections.abc import Callable
from math import inf, isnan
from threading import Condition
from typing import Any

from builtin_interfaces.msg import Duration as DurationMsg
from builtin_interfaces.msg import Time as TimeMsg
from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.logging import get_logger
from rclpy.time import Time
from tf2_ros.exceptions import (ConnectivityException, ExtrapolationException,
                                InvalidArgumentException, LookupException, TransformException)
from tf2_ros.transform_cache import canonical, display_time, NoDataError, StaticCache, TimeCache

# A translation and a rotation: x, y, z, qx, qy, qz, qw.
Transform = tuple[float, float, float, float, float, float, float]

_NANOSECONDS = 1_000_000_000
_DEFAULT_CACHE_TIME = 10 * _NANOSECONDS
# A longer way to the root is taken for a loop.
_MAX_DEPTH = 1000
_IDENTITY: Transform = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


class Frame:
    """A frame that a transform has named."""

    __slots__ = ('name', 'cache', 'authority')

    def __init__(self, name: str) -> None:
        """
        Make a frame that has no parent yet.

        :param name: Its name.
        """
        self.name = name
        self.cache: StaticCache | TimeCache | None = None
        """The transforms to its parent; None if it has only been named as a parent."""
        self.authority = ''
        """Who sent the last transform."""


def nanoseconds_of(time: Time | TimeMsg | Duration | DurationMsg) -> int:
    """
    Read a time or a duration.

    :param time: One of rclpy or a message.
    :return: The same in ns.
    :raises TypeError: It is neither.
    """
    try:
        return time.nanoseconds
    except AttributeError:
        pass
    try:
        return time.sec * _NANOSECONDS + time.nanosec
    except AttributeError:
        raise TypeError('time must have sec and nanosec, or nanoseconds, '
                        f'but {time!r} has not') from None


def compose(outer: Transform, inner: Transform) -> Transform:
    """
    Apply one transform after another.

    :param outer: The transform that is applied second.
    :param inner: The transform that is applied first.
    :return: Both as one.
    """
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
    """
    Turn a transform round.

    :param transform: A transform.
    :return: Its inverse.
    """
    x, y, z, qx, qy, qz, qw = transform
    inverse = (0.0, 0.0, 0.0, -qx, -qy, -qz, qw)
    return compose(inverse, (-x, -y, -z, 0.0, 0.0, 0.0, 1.0))


class BufferCore:
    """
    A tree of frames with the transforms of the recent past, safe to use from several threads.

    It answers as the real tf2 does, also to times that it cannot serve and to bad input.
    """

    def __init__(self, cache_time: Duration | None = None) -> None:
        """
        Make an empty buffer.

        :param cache_time: How far each frame's transforms go back; 10 s if None.
        """
        self._cache_time = (
            _DEFAULT_CACHE_TIME if cache_time is None else nanoseconds_of(cache_time))
        self._frames: dict[str, Frame] = {}
        self._changed = Condition()
        self._waiting = 0

    def set_transform(self, transform: TransformStamped, authority: str) -> None:
        """
        Add a transform; one that cannot be used is ignored with a message in the log.

        :param transform: The pose of a child frame in a frame at a time.
        :param authority: Who says so.
        """
        self._set_transform(transform, authority, TimeCache)

    def set_transform_static(self, transform: TransformStamped, authority: str) -> None:
        """
        Add a transform that holds at all times.

        :param transform: The pose of a child frame in a frame.
        :param authority: Who says so.
        """
        self._set_transform(transform, authority, StaticCache)

    def clear(self) -> None:
        """Forget all transforms but the static ones; the frames stay known."""
        with self._changed:
            for frame in self._frames.values():
                if frame.cache is not None:
                    frame.cache.clear()

    def can_transform_core(self, target_frame: str, source_frame: str,
                           time: Time | TimeMsg) -> tuple[bool, str]:
        """
        Tell whether there is a transform.

        :param target_frame: The frame to transform into.
        :param source_frame: The frame to transform from.
        :param time: The time; zero for the latest common one.
        :return: Whether there is, and if not, why.
        """
        nanoseconds = nanoseconds_of(time)
        with self._changed:
            return self._can_transform(target_frame, source_frame, nanoseconds)

    def can_transform_full_core(self, target_frame: str, target_time: Time | TimeMsg,
                                source_frame: str, source_time: Time | TimeMsg,
                                fixed_frame: str) -> tuple[bool, str]:
        """
        Tell whether there is a transform between two times.

        :param target_frame: The frame to transform into.
        :param target_time: The time at which that is taken; zero for the latest.
        :param source_frame: The frame to transform from.
        :param source_time: The time at which that is taken; zero for the latest.
        :param fixed_frame: A frame that does not move in between.
        :return: Whether there is, and if not, why.
        """
        target_nanoseconds = nanoseconds_of(target_time)
        source_nanoseconds = nanoseconds_of(source_time)
        with self._changed:
            return self._can_transform_full(target_frame, target_nanoseconds, source_frame,
                                            source_nanoseconds, fixed_frame)

    def lookup_transform_core(self, target_frame: str, source_frame: str,
                              time: Time | TimeMsg) -> TransformStamped:
        """
        Get a transform.

        :param target_frame: The frame to transform into.
        :param source_frame: The frame to transform from.
        :param time: The time; zero for the latest common one.
        :return: The pose of the source frame in the target frame.
        :raises TransformException: There is none.
        """
        nanoseconds = nanoseconds_of(time)
        with self._changed:
            nanoseconds, transform = self._lookup(target_frame, source_frame, nanoseconds)
        return self._message(target_frame, source_frame, nanoseconds, transform)

    def lookup_transform_full_core(self, target_frame: str, target_time: Time | TimeMsg,
                                   source_frame: str, source_time: Time | TimeMsg,
                                   fixed_frame: str) -> TransformStamped:
        """
        Get a transform between two times.

        :param target_frame: The frame to transform into.
        :param target_time: The time at which that is taken; zero for the latest.
        :param source_frame: The frame to transform from.
        :param source_time: The time at which that is taken; zero for the latest.
        :param fixed_frame: A frame that does not move in between.
        :return: The pose that the source frame had, in the target frame at its time.
        :raises TransformException: There is none.
        """
        target_nanoseconds = nanoseconds_of(target_time)
        source_nanoseconds = nanoseconds_of(source_time)
        with self._changed:
            for role, name in (('target', target_frame), ('source', source_frame),
                               ('fixed', fixed_frame)):
                self._known(f'lookupTransform argument {role}_frame', name)
            _, first = self._lookup(fixed_frame, source_frame, source_nanoseconds)
            nanoseconds, second = self._lookup(target_frame, fixed_frame, target_nanoseconds)
        return self._message(target_frame, source_frame, nanoseconds, compose(second, first))

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> Time:
        """
        Get the latest time at which there is a transform.

        :param target_frame: The frame to transform into.
        :param source_frame: The frame to transform from.
        :return: The time; zero if only static transforms lie between the frames.
        :raises TransformException: There is none.
        """
        with self._changed:
            target = self._known('get_latest_common_time', target_frame)
            source = self._known('get_latest_common_time', source_frame)
            if target is source:
                nanoseconds = source.cache.latest_time if source.cache else 0
            else:
                try:
                    nanoseconds = self._latest_common_time(target, source)
                except TransformException as error:
                    raise TransformException(str(error)) from None
        return Time(nanoseconds=nanoseconds)

    def all_frames_as_string(self) -> str:
        """
        List the frames.

        :return: A line for each frame that has a parent.
        """
        with self._changed:
            return self._all_frames_as_string()

    def all_frames_as_yaml(self) -> str:
        """
        Describe the frames.

        :return: A YAML map from each frame that has a parent to the parent, the sender of its last
            transform, and the transforms' rate and times.
        """
        with self._changed:
            if not self._frames:
                return '[]'
            text = ''
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
            return text

    def _wait_for(self, condition: Callable[[], bool], timeout: float) -> None:
        """
        Wait until a condition is met, asking after every transform that comes in.

        :param condition: What to wait for.
        :param timeout: For how long at most, in s.
        """
        with self._changed:
            self._waiting += 1
            try:
                self._changed.wait_for(condition, timeout)
            finally:
                self._waiting -= 1

    def _set_transform(self, transform: TransformStamped, authority: str, cache_type: type
                       ) -> None:
        """
        Add a transform, unless it cannot be used.

        :param transform: The pose of a child frame in a frame.
        :param authority: Who says so.
        :param cache_type: The class of the child frame's cache.
        """
        header = transform.header
        stamp = header.stamp
        parent_name = header.frame_id
        child_name = transform.child_frame_id
        if parent_name[:1] == '/':
            parent_name = parent_name[1:]
        if child_name[:1] == '/':
            child_name = child_name[1:]
        translation = transform.transform.translation
        rotation = transform.transform.rotation
        x, y, z = translation.x, translation.y, translation.z
        qx, qy, qz, qw = rotation.x, rotation.y, rotation.z, rotation.w
        # As in tf2, a quaternion of any other length is made a unit one. A NaN fails here.
        if not (0.0 < qx * qx + qy * qy + qz * qz + qw * qw < inf
                and parent_name and child_name and parent_name != child_name
                and x == x and y == y and z == z):
            self._refuse(parent_name, child_name, authority, (x, y, z), (qx, qy, qz, qw))
            return
        time = stamp.sec * _NANOSECONDS + stamp.nanosec
        with self._changed:
            frames = self._frames
            child = frames.get(child_name)
            if child is None:
                child = frames[child_name] = Frame(child_name)
            parent = frames.get(parent_name)
            if parent is None:
                parent = frames[parent_name] = Frame(parent_name)
            if type(child.cache) is not cache_type:
                child.cache = (
                    StaticCache() if cache_type is StaticCache else TimeCache(self._cache_time))
            inserted = child.cache.insert(time, (parent, x, y, z, *canonical(qx, qy, qz, qw)))
            if inserted:
                child.authority = authority
                if self._waiting:
                    self._changed.notify_all()
        if not inserted:
            get_logger('tf2').warning(
                f'TF_OLD_DATA ignoring data from the past for frame {child_name} at time '
                f'{display_time(time)} according to authority {authority}\nPossible reasons are '
                'listed at http://wiki.ros.org/tf/Errors%20explained')

    @staticmethod
    def _refuse(parent: str, child: str, authority: str, translation: tuple[float, ...],
                rotation: tuple[float, ...]) -> None:
        """
        Say in the log why a transform is ignored.

        :param parent: The name of the frame.
        :param child: The name of the child frame.
        :param authority: Who sent it.
        :param translation: The child's position.
        :param rotation: The child's orientation.
        """
        logger = get_logger('tf2')
        if child == parent:
            logger.error(f'TF_SELF_TRANSFORM: Ignoring transform from authority "{authority}" '
                         f'with frame_id and child_frame_id "{child}" because they are the same')
        if not child:
            logger.error('TF_NO_CHILD_FRAME_ID: Ignoring transform from authority '
                         f'"{authority}" because child_frame_id not set')
        if not parent:
            logger.error(f'TF_NO_FRAME_ID: Ignoring transform with child_frame_id "{child}" '
                         f'from authority "{authority}" because frame_id not set')
        if any(map(isnan, translation + rotation)):
            logger.error(f'TF_NAN_INPUT: Ignoring transform for child_frame_id "{child}" from '
                         f'authority "{authority}" because of a nan value in the transform '
                         f'{translation} {rotation}')
        if not 0.0 < sum(q * q for q in rotation) < inf:
            logger.error('TF_DENORMALIZED_QUATERNION: Ignoring transform for child_frame_id '
                         f'"{child}" from authority "{authority}" because of an invalid '
                         f'quaternion in the transform {rotation}')

    def _known(self, what: str, name: str) -> Frame:
        """
        Find a frame.

        :param what: What the name was given to.
        :param name: The frame's name.
        :return: The frame.
        :raises InvalidArgumentException: No frame can be named so.
        :raises LookupException: No frame is named so.
        """
        frame = self._frames.get(name)
        if frame is None:
            if not name:
                raise InvalidArgumentException(
                    f'Invalid argument "" passed to {what} - in tf2 frame_ids cannot be empty')
            if name.startswith('/'):
                raise InvalidArgumentException(
                    f'Invalid argument "{name}" passed to {what} - in tf2 frame_ids cannot start '
                    "with a '/'")
            raise LookupException(f'"{name}" passed to {what} does not exist. ')
        return frame

    def _why_unknown(self, what: str, name: str) -> str:
        """
        Say why a frame cannot be found.

        :param what: What the name was given to.
        :param name: The frame's name.
        :return: The reason; empty if it can be found.
        """
        if name in self._frames:
            return ''
        if not name:
            reason = 'in tf2 frame_ids cannot be empty'
        elif name.startswith('/'):
            reason = "in tf2 frame_ids cannot start with a '/'"
        else:
            reason = 'frame does not exist'
        return f'Invalid frame ID "{name}" passed to canTransform argument {what} - {reason}'

    def _can_transform(self, target_name: str, source_name: str, time: int) -> tuple[bool, str]:
        """
        Tell whether there is a transform.

        :param target_name: The frame to transform into.
        :param source_name: The frame to transform from.
        :param time: The time in ns; zero for the latest common one.
        :return: Whether there is, and if not, why.
        """
        if target_name == source_name:
            return True, ''
        reason = (self._why_unknown('target_frame', target_name)
                  or self._why_unknown('source_frame', source_name))
        if reason:
            return False, reason
        try:
            self._walk(self._frames[target_name], self._frames[source_name], time)
        except TransformException as error:
            return False, str(error)
        return True, ''

    def _can_transform_full(self, target_name: str, target_time: int, source_name: str,
                            source_time: int, fixed_name: str) -> tuple[bool, str]:
        """
        Tell whether there is a transform between two times.

        :param target_name: The frame to transform into.
        :param target_time: The time in ns at which that is taken; zero for the latest.
        :param source_name: The frame to transform from.
        :param source_time: The time in ns at which that is taken; zero for the latest.
        :param fixed_name: A frame that does not move in between.
        :return: Whether there is, and if not, why.
        """
        reason = (self._why_unknown('target_frame', target_name)
                  or self._why_unknown('source_frame', source_name)
                  or self._why_unknown('fixed_frame', fixed_name))
        if reason:
            return False, reason
        possible, reason = self._can_transform(target_name, fixed_name, target_time)
        if possible:
            possible, reason = self._can_transform(fixed_name, source_name, source_time)
        return possible, reason

    def _lookup(self, target_name: str, source_name: str, time: int) -> tuple[int, Transform]:
        """
        Get a transform.

        :param target_name: The frame to transform into.
        :param source_name: The frame to transform from.
        :param time: The time in ns; zero for the latest common one.
        :return: The time in ns, and the pose of the source frame in the target frame then.
        :raises TransformException: There is none.
        """
        if target_name == source_name:
            # tf2 has it so for frames that it does not know, too.
            frame = self._frames.get(target_name)
            if time == 0 and frame is not None and frame.cache is not None:
                time = frame.cache.latest_time
            return time, _IDENTITY
        target = self._known('lookupTransform argument target_frame', target_name)
        source = self._known('lookupTransform argument source_frame', source_name)
        return self._walk(target, source, time)

    def _walk(self, target: Frame, source: Frame, time: int) -> tuple[int, Transform]:
        """
        Gather the transforms from a frame to the root, and from another one to meet them.

        :param target: The frame to transform into.
        :param source: Another frame, to transform from.
        :param time: The time in ns; zero for the latest common one.
        :return: The time in ns, and the pose of the source frame in the target frame then.
        :raises TransformException: There is none.
        """
        if time == 0:
            time = self._latest_common_time(target, source)

        frame = source
        of_source = None
        gap = None
        for _ in range(_MAX_DEPTH + 1):
            if frame is target:
                return time, of_source
            if frame.cache is None:
                break
            try:
                entry = frame.cache.get(time)
            except NoDataError as error:
                # The two frames may still meet below this one.
                gap = error
                break
            step = entry[1:]
            of_source = step if of_source is None else compose(step, of_source)
            frame = entry[0]
        else:
            raise self._loop()

        top = frame
        frame = target
        of_target = None
        for _ in range(_MAX_DEPTH + 1):
            if frame is source:
                return time, invert(of_target)
            if frame is top:
                return time, compose(invert(of_target), of_source)
            if frame.cache is None:
                break
            try:
                entry = frame.cache.get(time)
            except NoDataError as error:
                raise self._extrapolation(target, source, error) from None
            step = entry[1:]
            of_target = step if of_target is None else compose(step, of_target)
            frame = entry[0]
        else:
            raise self._loop()
        if gap is not None:
            raise self._extrapolation(target, source, gap)
        raise self._unconnected(target, source)

    def _latest_common_time(self, target: Frame, source: Frame) -> int:
        """
        Get the latest time at which every frame between two has a transform.

        :param target: The frame to transform into.
        :param source: Another frame, to transform from.
        :return: The time in ns; zero if only static transforms lie between the frames.
        :raises TransformException: The frames are not connected.
        """
        # The latest time on the way from the source to each frame above it; static transforms
        # do not limit it.
        times: list[tuple[Frame, int]] = []
        common = 0
        frame = source
        for _ in range(_MAX_DEPTH + 1):
            if frame.cache is None:
                break
            latest, parent = frame.cache.latest()
            if parent is None:
                break
            if latest and (latest < common or not common):
                common = latest
            if parent is target:
                return common
            times.append((parent, common))
            frame = parent
        else:
            raise self._loop()

        common = 0
        frame = target
        for _ in range(_MAX_DEPTH + 1):
            if frame.cache is None:
                break
            latest, parent = frame.cache.latest()
            if parent is None:
                break
            if latest and (latest < common or not common):
                common = latest
            if parent is source:
                return common
            for ancestor, from_source in times:
                if ancestor is parent:
                    if from_source and common:
                        return min(from_source, common)
                    return from_source or common
            frame = parent
        else:
            raise self._loop()
        raise self._unconnected(target, source)

    def _loop(self) -> LookupException:
        """
        Make the exception for frames that are their own ancestors.

        :return: The exception.
        """
        return LookupException('The tf tree is invalid because it contains a loop.\n'
                               f'{self._all_frames_as_string()}\n')

    @staticmethod
    def _extrapolation(target: Frame, source: Frame, gap: NoDataError) -> ExtrapolationException:
        """
        Make the exception for a time that a frame's cache does not cover.

        :param target: The frame to transform into.
        :param source: The frame to transform from.
        :param gap: What the cache said.
        :return: The exception.
        """
        return ExtrapolationException(f'{gap}, when looking up transform from frame '
                                      f'[{source.name}] to frame [{target.name}]')

    @staticmethod
    def _unconnected(target: Frame, source: Frame) -> ConnectivityException:
        """
        Make the exception for frames that have no common ancestor.

        :param target: The frame to transform into.
        :param source: The frame to transform from.
        :return: The exception.
        """
        return ConnectivityException(
            f"Could not find a connection between '{target.name}' and '{source.name}' because "
            'they are not part of the same tree.Tf has two or more unconnected trees.')

    def _all_frames_as_string(self) -> str:
        """
        List the frames; the caller holds the lock.

        :return: A line for each frame that has a parent.
        """
        text = ''
        for frame in self._frames.values():
            if frame.cache is not None:
                parent: Any = frame.cache.latest()[1]
                name = 'NO_PARENT' if parent is None else parent.name
                text += f'Frame {frame.name} exists with parent {name}.\n'
        return text

    @staticmethod
    def _message(target_name: str, source_name: str, time: int, transform: Transform
                 ) -> TransformStamped:
        """
        Write a transform as a message.

        :param target_name: The frame to transform into.
        :param source_name: The frame to transform from.
        :param time: The time in ns.
        :param transform: The pose of the source frame in the target frame.
        :return: The message.
        """
        x, y, z, qx, qy, qz, qw = transform
        message = TransformStamped()
        header = message.header
        header.frame_id = target_name
        header.stamp.sec, header.stamp.nanosec = divmod(time, _NANOSECONDS)
        message.child_frame_id = source_name
        translation = message.transform.translation
        translation.x = x
        translation.y = y
        translation.z = z
        rotation = message.transform.rotation
        rotation.x, rotation.y, rotation.z, rotation.w = canonical(qx, qy, qz, qw)
        return message
