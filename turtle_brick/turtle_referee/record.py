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
from itertools import pairwise
from math import dist, isfinite
from operator import attrgetter
from statistics import median
from typing import Any, NamedTuple

from turtle_referee.constants import NANOSECONDS
from turtle_referee.geometry import Array, blend, Pose, pose
from turtle_referee.names import Profile

GAP = 120_000_000
"""How far apart (ns) two transforms may be for the pose in between to be known."""

AFTER = 50_000_000
"""How long (ns) before its first and after its last transform a frame's pose is known."""

LATE = 15_000_000
"""How late (ns) what is regular may be: later, the machine stood still, or had no processor to
spare. In this time a robot of 3 m/s drives the 5 cm that it may be off."""

AFTERMATH = NANOSECONDS
"""How long (ns) after a stall its consequences may be seen."""

AHEAD = 5_000_000_000
"""How far ahead (ns) of its publication a transform's stamp may be."""

DEPTH = 30
"""The most frames between a frame and the world."""


STOOD_STILL = 'the machine stood still'
"""Why something can't be judged that may be kept on a quieter machine."""


class Heard(NamedTuple):
    """A message, and when it was published."""

    published: int
    message: Any


class Sample(NamedTuple):
    """A transform."""

    stamp: int
    parent: str
    pose: Pose


stamp_of_sample = attrgetter('stamp')


def during(items: list[Any], begin: int, end: int | None, when: Callable[[Any], int]) -> list[Any]:
    """Return the items of a span of time (ns), of a list in the order of when they were."""
    last = len(items) if end is None else bisect_left(items, end, key=when)
    return items[bisect_left(items, begin, key=when):last]


class Frame:
    """All that was broadcast of a frame."""

    def __init__(self, static: bool) -> None:
        """Begin with nothing, of a frame that is heard first on /tf_static or on /tf."""
        self.static = static
        self.both = False
        """Whether it was heard on /tf and on /tf_static."""
        self.samples: list[Sample] = []
        """In the order of their stamps."""
        self.published: list[tuple[int, Sample]] = []
        """In the order of their arrival, each with when it was published."""
        self.numbers: list[int] = []
        """Of the messages, as their publishers count them, in the order of arrival."""

    def add(self, published: int, number: int, sample: Sample) -> None:
        """Take note of a transform."""
        self.published.append((published, sample))
        self.numbers.append(number)
        insort(self.samples, sample, key=stamp_of_sample)

    @property
    def parents(self) -> set[str]:
        """Return the frames in which it was broadcast."""
        return {sample.parent for sample in self.samples}

    @property
    def restarts(self) -> int:
        """Return how often a publisher's count went back: for one publisher never."""
        return sum(later < earlier for earlier, later in zip(self.numbers, self.numbers[1:]))

    def heard(self, begin: int, end: int | None = None) -> list[tuple[int, Sample]]:
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
        before = self.samples[max(place - 1, 0)]
        after = self.samples[min(place, len(self.samples) - 1)]
        if after.stamp == stamp:
            return after
        if not before.stamp <= stamp <= after.stamp:
            return before if abs(stamp - before.stamp) <= AFTER else None
        if after.stamp - before.stamp > GAP:
            return None
        if before.parent != after.parent:
            return before
        part = (stamp - before.stamp) / (after.stamp - before.stamp)
        return Sample(stamp, before.parent, blend(before.pose, after.pose, part))


class MarkerHeard(NamedTuple):
    """A marker, and how and when (ns) it came."""

    published: int
    topic: str
    marker: Any


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


class Ask(NamedTuple):
    """A service was called, or a topic published to."""

    begin: int
    end: int
    what: Any
    answered: bool = True
    accepted: bool = True
    """False where the answer says so in a field named success."""
    words: str = ''

    def check(self) -> None:
        """Raise what it says: ValueError if it was refused, TimeoutError if nobody answered."""
        if not self.answered:
            raise TimeoutError(self.words)
        if not self.accepted:
            raise ValueError(self.words)


class Record:
    """All that was heard, and what was done."""

    def __init__(self, profile: Profile) -> None:
        """Begin with nothing, of a graph with the names of a profile."""
        self.profile = profile
        self.topics: dict[str, list[Heard]] = {name: [] for name in profile.topics}
        self.frames: dict[str, Frame] = {}
        self.markers: list[MarkerHeard] = []
        self.namespace = '/'
        """Of the referee, and of the graph that it judges."""
        self.speakers: dict[str, set[str]] = {}
        """Topics of the graph, and the full names of the nodes that publish them."""
        self.latched: dict[str, bool] = {}
        """Marker topics, and whether who comes late hears the last message."""
        self.idle: list[tuple[int, int]] = []
        self.drives: list[Drive] = []
        self.tilts: list[Ask] = []
        self.places: list[Ask] = []
        self.drops: list[Any] = []
        self.stalls: list[tuple[int, int]] = []
        """From when to when (ns) the machine had no time for who listens."""
        self.full: list[tuple[int, int]] = []
        """From when to when (ns) it had hardly a processor to spare."""
        self.notes: list[str] = []
        """What went wrong in the referee's own program."""

    def is_empty(self) -> bool:
        """Tell whether nothing of the exercise was heard."""
        return not (self.frames or self.markers or self.places or any(self.topics.values()))

    def frame(self, name: str) -> Frame | None:
        """Return what was broadcast of one of the assignment's frames, None if nothing was."""
        return self.frames.get(self.profile.frames[name])

    def add_transform(self, published: int, number: int, transform: Any, static: bool) -> None:
        """Take note of a geometry_msgs/TransformStamped."""
        place, turn = transform.transform.translation, transform.transform.rotation
        stamp = nanoseconds_of(transform.header.stamp)
        if stamp - published > AHEAD:
            return  # Beside a moment to come, nobody could tell what is latest.
        child = transform.child_frame_id.removeprefix('/')
        frame = self.frames.setdefault(child, Frame(static))
        frame.both = frame.both or frame.static is not static
        frame.add(published, number, Sample(
            stamp, transform.header.frame_id.removeprefix('/'),
            pose((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))))

    def way_up(self, frame: str) -> list[str]:
        """Return a frame and all above it, by the latest parents; a loop ends."""
        way = [frame]
        while way[-1] in self.frames and len(way) < DEPTH:
            way.append(self.frames[way[-1]].samples[-1].parent)
        return way

    def pose(self, frame: str, stamp: int) -> Pose | None:
        """Return the pose of a frame in the world at an instant (ns), None if unknown."""
        found = None
        for _ in range(DEPTH):
            if frame == self.profile.frames['world']:
                return found or pose((0.0, 0.0, 0.0))
            sample = self.frames[frame].at(stamp) if frame in self.frames else None
            if sample is None:
                return None
            found = sample.pose if found is None else sample.pose.compose(found)
            frame = sample.parent
        return None

    def platform(self, stamp: int) -> Pose | None:
        """Return the platform's pose in the world at an instant (ns), None if unknown."""
        return self.pose(self.profile.frames['platform'], stamp)

    def brick(self, stamp: int) -> Pose | None:
        """Return the brick's pose in the world at an instant (ns), None if unknown."""
        return self.pose(self.profile.frames['brick'], stamp)

    def on_platform(self, stamp: int) -> Array | None:
        """Return where the brick was in the platform's frame (m) at an instant (ns), if known."""
        brick, platform = self.brick(stamp), self.platform(stamp)
        if brick is None or platform is None:
            return None
        return platform.locate(brick.position)

    def brick_track(self, begin: int, end: int) -> Iterator[tuple[int, Pose]]:
        """Yield where the brick was in the world, at each of its own stamps (ns)."""
        frame = self.frame('brick')
        for sample in frame.between(begin, end) if frame else ():
            brick = self.brick(sample.stamp)
            if brick is not None:
                yield sample.stamp, brick

    def heard(self, topic: str, begin: int = 0, end: int | None = None) -> list[Heard]:
        """Return the messages of a topic that were published in a span of time (ns)."""
        return during(self.topics[topic], begin, end, lambda one: one.published)

    def joint(self, name: str, begin: int, end: int,
              what: str = 'position') -> list[tuple[int, float]]:
        """Return the positions (rad) or velocities of a joint, each with its stamp (ns)."""
        return [(stamp_of(heard), value) for heard in self.heard('joint_states', begin, end)
                for joint, value in zip(heard.message.name, getattr(heard.message, what))
                if joint == name]

    def busy_spans(self) -> list[tuple[int, int]]:
        """Return the spans of time (ns) in which something was asked for."""
        return [*self.idle, *((one.begin, one.end)
                              for one in (*self.drives, *self.tilts, *self.drops))]

    def held_up(self) -> str:
        """Say in how many of the spans the machine had no time for the graph; '' in none."""
        spans, stalls = self.busy_spans(), self.all_stalls()
        held = [span for span in spans if overlaps(span, stalls)]
        return held and f'{STOOD_STILL} in {len(held)} of {len(spans)} trials' or ''

    def while_calm(self) -> 'Record':
        """Return a record of what was done while the machine had time."""
        calm, stalls = copy(self), self.all_stalls()
        calm.idle = [span for span in self.idle if not overlaps(span, stalls)]
        for name in ('drives', 'tilts', 'places', 'drops'):
            setattr(calm, name, [one for one in getattr(self, name)
                                 if not overlaps((one.begin, one.end), stalls)])
        return calm

    def all_stalls(self) -> list[tuple[int, int]]:
        """
        Return from when to when (ns) the machine had no time for who listens, or for who speaks.

        What comes late after a stall belongs to it.
        Who speaks later than it usually does may be to blame itself, but not while the machine had
        no processor to spare.
        """
        found = list(self.stalls)
        regular = [[heard.published for heard in self.topics['pose']]]
        regular += [[published for published, _ in frame.published]
                    for name in ('base_link', 'platform', 'brick') if (frame := self.frame(name))]
        for instants in regular:
            pauses = [(begin, end) for begin, end in pairwise(instants)]
            usual = median(end - begin for begin, end in pauses) if pauses else 0
            found += [pause for pause in pauses
                      if pause[1] - pause[0] > usual + LATE and overlaps(pause, self.full)]
        return [(begin, end + AFTERMATH) for begin, end in found]


def overlaps(span: tuple[int, int], others: list[tuple[int, int]]) -> bool:
    """Tell whether a span of time (ns) has a part in common with one of others."""
    return any(begin < span[1] and span[0] < end for begin, end in others)


def nanoseconds_of(stamp: Any) -> int:
    """Return the instant (ns) of a builtin_interfaces/Time."""
    return stamp.sec * NANOSECONDS + stamp.nanosec


def stamp_of(heard: Heard) -> int:
    """Return the stamp (ns) of a message; when it was published, if it has none that can be."""
    header = getattr(heard.message, 'header', None)
    value = nanoseconds_of(header.stamp) if header else 0
    return value if abs(value - heard.published) < AHEAD else heard.published


def rate(times: Sequence[float]) -> float:
    """
    Return the mean rate of what comes in even steps, from its first third to its last.

    On a busy machine each may be late, but none is early. In each of the two thirds the one counts
    that is the least late.

    :param times: instants (s), in order
    :return: The rate (Hz), 0 for less than six.
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
    Return since when something has not moved.

    :param track: instants (ns) and places (m)
    :param tolerance: how far (m) it may move
    :param least: how long (ns) it has to stay
    :param part: the coordinates that count
    :return: The first instant (ns) of the stay that lasts to the end, None if it is too short.
    """
    if not track:
        return None
    end, last = track[-1]
    since = end
    for stamp, place in reversed(track):
        offset = dist(place[part], last[part])
        if not (isfinite(offset) and offset <= tolerance):
            break
        since = stamp
    return since if end - since >= least else None
