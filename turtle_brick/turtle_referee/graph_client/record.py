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

"""
What was heard of a graph, and when. No ROS: messages are looked at, and none is made.

Instants are integer nanoseconds of the system's clock, lengths in m, angles in rad.
"""

from bisect import bisect_left, insort
from collections.abc import Callable, Iterator, Sequence
from copy import copy
from math import dist
from operator import attrgetter
from typing import Any, NamedTuple

from turtle_referee.graph_client.constants import NS_PER_SECOND
from turtle_referee.graph_client.geometry import Array, blend, Pose, pose
from turtle_referee.graph_client.profile import Profile

GAP = 120_000_000  # how far apart (ns) two transforms may be for the pose in between to be known
AFTER = 50_000_000  # how long (ns) before its first and after its last one a pose is known
LATE = 15_000_000  # how late (ns) the referee may be: in it a robot of 3 m/s drives 5 cm
AFTERMATH = NS_PER_SECOND  # how long (ns) after a stall its consequences may be seen
AHEAD = 5_000_000_000  # how far ahead (ns) of its publication a transform's stamp may be
DEPTH = 30  # the most frames between a frame and the world

STOOD_STILL = 'the machine stood still'
"""Why something can't be judged that may be kept on a quieter machine."""


class Received(NamedTuple):
    """A message, and when it was published."""

    published: int
    message: Any


class ReceivedMarker(NamedTuple):
    """A marker, and how and when (ns) it came."""

    published: int
    topic: str
    marker: Any


class Sample(NamedTuple):
    """A transform."""

    stamp: int
    parent: str
    pose: Pose


class Drive(NamedTuple):
    """The robot was sent to a goal."""

    begin: int
    end: int
    start: tuple[float, float]
    goal: tuple[float, float]

    @property
    def length(self) -> float:
        """Return how far the goal is."""
        return dist(self.start, self.goal)


class Request(NamedTuple):
    """A service was called, or a topic published to."""

    begin: int
    end: int
    what: Any
    accepted: bool = True  # False where nobody answers, or a field named success says so
    words: str = ''

    def check(self) -> None:
        """Raise ValueError, with what it says, if it was refused."""
        if not self.accepted:
            raise ValueError(self.words)


def during(items: list[Any], begin: int, end: int | None, when: Callable[[Any], int]) -> list[Any]:
    """Return the items of a span of time (ns), of a list in the order of when they were."""
    last = len(items) if end is None else bisect_left(items, end, key=when)
    return items[bisect_left(items, begin, key=when):last]


stamp_of_sample = attrgetter('stamp')


class Frame:
    """All that was broadcast of a frame."""

    def __init__(self, static: bool) -> None:
        """Begin with nothing, of a frame that is heard first on /tf_static or on /tf."""
        self.static = static
        self.both = False  # whether it was heard on /tf and on /tf_static
        self.samples: list[Sample] = []  # in the order of their stamps
        self.published: list[tuple[int, Sample]] = []  # as they came, with when it was published
        self.numbers: list[int] = []  # of the messages, as their publishers count them

    def add(self, published: int, number: int, sample: Sample) -> None:
        """Take note of a transform."""
        self.published.append((published, sample))
        self.numbers.append(number)
        insort(self.samples, sample, key=stamp_of_sample)

    def published_between(self, begin: int, end: int | None = None) -> list[tuple[int, Sample]]:
        """Return what was published in a span of time (ns), each with when it was."""
        return during(self.published, begin, end, lambda one: one[0])

    def between(self, begin: int, end: int) -> list[Sample]:
        """Return the transforms with stamps in a span of time (ns)."""
        return during(self.samples, begin, end, stamp_of_sample)

    def at(self, stamp: int) -> Sample | None:
        """Return the transform at an instant (ns), interpolated; None where it is not known."""
        if self.static:
            return self.published[0][1]  # whoever says otherwise later
        place = bisect_left(self.samples, stamp, key=stamp_of_sample)
        before, after = self.samples[max(place - 1, 0)], self.samples[place:place + 1]
        if not after or stamp < before.stamp:
            return before if abs(stamp - before.stamp) <= AFTER else None
        if after[0].stamp == stamp:
            return after[0]
        span = after[0].stamp - before.stamp
        if span > GAP or before.parent != after[0].parent:
            return before if span <= GAP else None
        return Sample(stamp, before.parent, blend(
            before.pose, after[0].pose, (stamp - before.stamp) / span))


class Record:
    """All that was heard, and what was done."""

    def __init__(self, profile: Profile) -> None:
        """Begin with nothing, of a graph with the names of a profile."""
        self.profile = profile
        self.topics: dict[str, list[Received]] = {name: [] for name in profile.topics}
        self.frames: dict[str, Frame] = {}
        self.markers: list[ReceivedMarker] = []
        self.namespace = '/'  # of the referee, and of the graph that it judges
        self.publishers: dict[str, set[str]] = {}  # the full names of a topic's nodes
        self.latched: dict[str, bool] = {}  # whether who comes late hears a marker topic
        self.idle: list[tuple[int, int]] = []  # when the robot rested
        self.driving: list[tuple[int, int]] = []  # when it went from one goal to another
        self.drives: list[Drive] = []
        self.tilts: list[Request] = []
        self.places: list[Request] = []
        self.drops: list[Any] = []
        self.stalls: list[tuple[int, int]] = []
        """From when to when (ns) the machine was late to listen, or had no processor to spare."""
        self.notes: list[str] = []  # what went wrong in the referee's own program

    def is_empty(self) -> bool:
        """Tell whether nothing of the exercise was heard; all namespaces may share TF."""
        return not (self.places or any(self.topics.values()))

    # ------------------------------------------------------------------------- what was heard

    def add_transform(self, published: int, number: int, transform: Any, static: bool) -> None:
        """Take note of a geometry_msgs/TransformStamped."""
        place, turn = transform.transform.translation, transform.transform.rotation
        stamp = nanoseconds_of(transform.header.stamp)
        if stamp - published > AHEAD:
            return  # Beside a moment to come, nobody could tell what is latest.
        frame = self.frames.setdefault(
            transform.child_frame_id.removeprefix('/'), Frame(static))
        frame.both = frame.both or frame.static is not static
        frame.add(published, number, Sample(
            stamp, transform.header.frame_id.removeprefix('/'),
            pose((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))))

    def ancestors(self, frame: str) -> list[str]:
        """Return a frame and all above it, by the latest parents; a loop ends."""
        way = [frame]
        while way[-1] in self.frames and len(way) < DEPTH:
            way.append(self.frames[way[-1]].samples[-1].parent)
        return way

    def pose(self, frame: str, stamp: int, depth: int = DEPTH) -> Pose | None:
        """Return the pose of a frame in the world at an instant (ns), None if unknown."""
        if frame == 'world':
            return pose((0.0, 0.0, 0.0))
        sample = self.frames[frame].at(stamp) if frame in self.frames and depth else None
        parent = sample and self.pose(sample.parent, stamp, depth - 1)
        return parent.compose(sample.pose) if sample and parent else None

    def platform(self, stamp: int) -> Pose | None:
        """Return the platform's pose in the world at an instant (ns), None if unknown."""
        return self.pose('platform', stamp)

    def brick(self, stamp: int) -> Pose | None:
        """Return the brick's pose in the world at an instant (ns), None if unknown."""
        return self.pose('brick', stamp)

    def on_platform(self, stamp: int) -> Array | None:
        """Return where the brick was in the platform's frame (m) at an instant (ns), if known."""
        brick, platform = self.brick(stamp), self.platform(stamp)
        return platform.locate(brick.position) if brick and platform else None

    def brick_track(self, begin: int, end: int) -> Iterator[tuple[int, Pose]]:
        """Yield where the brick was in the world, at each of its own stamps (ns)."""
        for sample in self.frames['brick'].between(begin, end) if 'brick' in self.frames else ():
            brick = self.brick(sample.stamp)
            if brick is not None:
                yield sample.stamp, brick

    def messages(self, topic: str, begin: int = 0, end: int | None = None) -> list[Received]:
        """Return the messages of a topic that were published in a span of time (ns)."""
        return during(self.topics[topic], begin, end, attrgetter('published'))

    def joint(self, name: str, begin: int, end: int,
              what: str = 'position') -> list[tuple[int, float]]:
        """Return the positions (rad) or velocities of a joint, each with its stamp (ns)."""
        return [(stamp_of(heard), value) for heard in self.messages('joint_states', begin, end)
                for joint, value in zip(heard.message.name, getattr(heard.message, what))
                if joint == name]

    # --------------------------------------------------------------- whether the machine had time

    def trial_spans(self) -> list[tuple[int, int]]:
        """Return the spans of time (ns) in which something was asked for."""
        return [*self.idle, *((one.begin, one.end)
                              for one in (*self.drives, *self.tilts, *self.drops))]

    def is_calm(self, begin: int, end: int) -> bool:
        """Tell whether the machine had time from one instant (ns) to another."""
        return not any(first < end and begin < last + AFTERMATH for first, last in self.stalls)

    def stall_summary(self) -> str:
        """Say in how many of the spans the machine had no time for the graph; '' in none."""
        spans = self.trial_spans()
        held = [span for span in spans if not self.is_calm(*span)]
        return f'{STOOD_STILL} in {len(held)} of {len(spans)} trials' if held else ''

    def without_stalls(self) -> 'Record':
        """Return a record of what was done while the machine had time."""
        calm = copy(self)
        for name in ('idle', 'driving'):
            setattr(calm, name, [span for span in getattr(self, name) if self.is_calm(*span)])
        for name in ('drives', 'tilts', 'places', 'drops'):
            setattr(calm, name, [one for one in getattr(self, name)
                                 if self.is_calm(one.begin, one.end)])
        return calm


def nanoseconds_of(stamp: Any) -> int:
    """Return the instant (ns) of a builtin_interfaces/Time."""
    return stamp.sec * NS_PER_SECOND + stamp.nanosec


def stamp_of(heard: Received) -> int:
    """Return the stamp (ns) of a message; when it was published, if it has none that can be."""
    header = getattr(heard.message, 'header', None)
    value = nanoseconds_of(header.stamp) if header else 0
    return value if abs(value - heard.published) < AHEAD else heard.published


def message_rate(times: Sequence[float]) -> float:
    """
    Return how often (Hz) comes what comes in even steps, from its first third to its last.

    On a busy machine each may be late, but none is early. In each of the two thirds the one counts
    that is the least late. Of less than six instants (s) it is 0.
    """
    count = len(times)
    if count < 6 or times[-1] <= times[0]:
        return 0.0
    period = (times[-1] - times[0]) / (count - 1)

    def lateness(number: int) -> float:
        return times[number] - period * number

    first = min(range(count // 3), key=lateness)
    last = min(range(count - count // 3, count), key=lateness)
    return (last - first) / (times[last] - times[first])


def plateau(track: Sequence[tuple[int, Any]], tolerance: float, least: int,
            part: slice = slice(None)) -> int | None:
    """
    Return since when (ns) something has moved by no more than a tolerance (m), up to the end.

    :param track: instants (ns) and places (m)
    :param least: how long (ns) it has to stay; None is returned where it does not
    :param part: the coordinates that count
    """
    since = None
    for stamp, place in reversed(track):
        if not dist(place[part], track[-1][1][part]) <= tolerance:
            break
        since = stamp
    return None if since is None or track[-1][0] - since < least else since
