# SPDX-License-Identifier: Apache-2.0
"""Store messages from a graph and requests to the graph. Times are in ns, and lengths are in m."""

from bisect import bisect_left, insort
from collections.abc import Callable, Iterator, Sequence
from copy import copy
from functools import lru_cache
from itertools import chain, pairwise
from math import dist
from operator import attrgetter, itemgetter
from typing import Any, NamedTuple
from xml.etree import ElementTree

from turtle_graph.client.geometry import Array, interpolate, ORIGIN, Pose
from turtle_graph.client.load import Window
from turtle_graph.client.messages import nanoseconds_of, read_pose
from turtle_graph.client.profiles import Profile
from turtle_graph.client.urdf import read_urdf

MAX_GAP_NS = 120_000_000
"""Maximum interval (ns) for interpolation between two transforms."""
EXTRAPOLATION_NS = 50_000_000
"""Maximum time (ns) by which poses are extrapolated beyond the first or last transform."""
POSE_PERIOD_NS = 16_000_000
"""Interval (ns) at which turtlesim publishes poses."""
MAX_STAMP_ERROR_NS = 5_000_000_000
"""Maximum difference (ns) between a timestamp and the publication time."""
MAX_DEPTH = 30
"""Maximum number of frames in the chain from a frame to the world frame."""
LOADED = 'other programs took processor time from the graph'
"""Text in the measured result of a requirement that cannot be judged because of the load."""


class Received(NamedTuple):
    """A message with its publication time (ns)."""

    published: int
    message: Any


class ReceivedMarker(NamedTuple):
    """A marker with its topic and its publication time (ns)."""

    published: int
    topic: str
    marker: Any


class Sample(NamedTuple):
    """A transform with its timestamp (ns) and parent frame."""

    stamp: int
    parent: str
    pose: Pose


class Drive(NamedTuple):
    """A robot drive, with start and end times (ns) and start and goal positions (m)."""

    begin: int
    end: int
    start: tuple[float, float]
    goal: tuple[float, float]

    @property
    def length(self) -> float:
        """Return the distance (m) between the start and the goal of the drive."""
        return dist(self.start, self.goal)


class Request(NamedTuple):
    """A service call or tilt command with its start and end times (ns), value and result."""

    begin: int
    end: int
    value: Any
    accepted: bool = True
    message: str = ''
    answered: bool = True  # Whether a node responded to the call or received the command.

    def check(self) -> None:
        """Raise ValueError with the response message if the request was refused."""
        if not self.accepted:
            raise ValueError(self.message)


def in_time_span(items: list[Any], begin: int, end: int | None,
                 time_of: Callable[[Any], int]) -> list[Any]:
    """Return the items between two times (ns) from a list that is sorted by `time_of`."""
    last = len(items) if end is None else bisect_left(items, end, key=time_of)
    return items[bisect_left(items, begin, key=time_of):last]


stamp_of_sample = attrgetter('stamp')


class Frame:
    """All transforms received for a frame."""

    def __init__(self, static: bool) -> None:
        """Create an empty frame. The transform of a static frame is valid at all times."""
        self.static = static
        self.on_both_topics = False  # True if the frame is broadcast on both /tf and /tf_static.
        self.wrong_stamps = False  # Whether a timestamp is far from the publication time.
        self.samples: list[Sample] = []  # Transforms, sorted by timestamp.
        self.published: list[tuple[int, Sample]] = []  # With publication times (ns).
        self.sequence_numbers: list[int] = []  # Each publisher numbers its messages separately.

    def add(self, published: int, number: int, sample: Sample) -> None:
        """Store a transform with its publication time (ns) and sequence number."""
        self.published.append((published, sample))
        self.sequence_numbers.append(number)
        insort(self.samples, sample, key=stamp_of_sample)

    @property
    def broadcasters(self) -> int:
        """Return 1, or 2 if the sequence numbers come from several broadcasters."""
        decreases = sum(b < a for a, b in pairwise(self.sequence_numbers))
        return 2 if self.on_both_topics or decreases > 2 else 1

    def published_between(self, begin: int, end: int | None = None) -> list[tuple[int, Sample]]:
        """Return the transforms published between two times (ns), with their publication times."""
        return in_time_span(self.published, begin, end, itemgetter(0))

    def between(self, begin: int, end: int) -> list[Sample]:
        """Return the transforms whose timestamps (ns) are between two given times (ns)."""
        return in_time_span(self.samples, begin, end, stamp_of_sample)

    def at(self, stamp: int) -> Sample | None:
        """Return the stored or interpolated transform at a time (ns), or None if unavailable."""
        if self.static:
            return self.published[0][1]
        index = bisect_left(self.samples, stamp, key=stamp_of_sample)
        before, after = self.samples[max(index - 1, 0)], self.samples[index:index + 1]
        if not after or stamp < before.stamp:
            return before if abs(stamp - before.stamp) <= EXTRAPOLATION_NS else None
        if after[0].stamp == stamp:
            return after[0]
        interval = after[0].stamp - before.stamp
        if interval > MAX_GAP_NS:
            return None
        if before.parent != after[0].parent:
            return before
        fraction = (stamp - before.stamp) / interval
        return Sample(stamp, before.parent, interpolate(before.pose, after[0].pose, fraction))


class Record:
    """All messages from a graph and all requests to the graph."""

    def __init__(self, profile: Profile) -> None:
        self.profile = profile
        self.whole = self  # The record with all trials, from which calm() copies some.
        self.topics: dict[str, list[Received]] = {name: [] for name in profile.topics}
        self.frames: dict[str, Frame] = {}
        self.markers: list[ReceivedMarker] = []
        self.namespace = '/'
        self.publishers: dict[str, set[str]] = {}  # Full names of the publishing nodes, by topic.
        self.users: dict[str, set[str]] = {}  # The same for subscribed topics and for services.
        self.latched: dict[str, bool] = {}  # Whether the messages on each topic are latched.
        self.idle: list[tuple[int, int]] = []
        self.drives: list[Drive] = []
        self.tilts: list[Request] = []
        self.places: list[Request] = []
        self.drops: list[Any] = []
        self.windows: list[Window] = []  # Delays of the graph that other programs cause.
        self.loads: list[float] = []  # Load averages of the machine over one minute.
        self.about: dict[str, Any] = {}  # The command, the date and other facts.
        self.notes: list[str] = []  # Assumptions made and problems found during the observation.
        self.crashes: list[str] = []
        # Reasons why topics, services or frames could not be used, keyed by their standard names.
        self.unclear: dict[str, str] = {}

    def note(self, text: str) -> None:
        """Add a note, unless the record already contains it."""
        if text not in self.notes:
            self.notes.append(text)

    def add_transform(self, published: int, number: int, transform: Any, static: bool) -> None:
        """Store a geometry_msgs/TransformStamped."""
        stamp = nanoseconds_of(transform.header.stamp)
        frame = self.frames.setdefault(transform.child_frame_id.removeprefix('/'), Frame(static))
        frame.on_both_topics = frame.on_both_topics or frame.static is not static
        if abs(stamp - published) > MAX_STAMP_ERROR_NS:
            frame.wrong_stamps = frame.wrong_stamps or not static
            stamp = published
        pose = read_pose(transform.transform.translation, transform.transform.rotation)
        frame.add(published, number,
                  Sample(stamp, transform.header.frame_id.removeprefix('/'), pose))

    def actual(self, frame: str) -> str:
        """Return the TF name for a standard frame name, and any other name unchanged."""
        return self.profile.frames.get(frame, frame)

    def frame_names(self) -> set[str]:
        """Return the names of all TF frames and of all links in the URDFs."""
        links = chain.from_iterable(link_names(received.message.data)
                                    for received in self.topics['robot_description'])
        parents = (frame.samples[-1].parent for frame in self.frames.values())
        return {*links, *self.frames, *parents}

    def ancestors(self, frame: str) -> list[str]:
        """Return the names of a frame and its ancestors, up to MAX_DEPTH names."""
        chain = [self.actual(frame)]
        while chain[-1] in self.frames and len(chain) < MAX_DEPTH:
            chain.append(self.frames[chain[-1]].samples[-1].parent)
        return chain

    def pose(self, frame: str, stamp: int, depth: int = MAX_DEPTH) -> Pose | None:
        """Return a frame's world pose at a given time (ns), or None if the pose is unknown."""
        frame = self.actual(frame)
        if frame == self.actual('world'):
            return ORIGIN
        sample = self.frames[frame].at(stamp) if frame in self.frames and depth else None
        parent = sample and self.pose(sample.parent, stamp, depth - 1)
        return parent.compose(sample.pose) if sample and parent else None

    def on_platform(self, stamp: int) -> Array | None:
        """Return the brick position (m) in the platform frame, or None if it is unknown."""
        brick, platform = self.pose('brick', stamp), self.pose('platform', stamp)
        return platform.locate(brick.position) if brick and platform else None

    def brick_track(self, begin: int, end: int) -> Iterator[tuple[int, Pose]]:
        """Yield the timestamps (ns) and world poses of the brick between two times (ns)."""
        frame = self.frames.get(self.actual('brick'))
        for sample in frame.between(begin, end) if frame else ():
            brick = self.pose('brick', sample.stamp)
            if brick is not None:
                yield sample.stamp, brick

    def messages(self, topic: str, begin: int = 0, end: int | None = None) -> list[Received]:
        """Return the messages published on a topic between `begin` and `end` (ns)."""
        return in_time_span(self.topics[topic], begin, end, attrgetter('published'))

    def joint(self, name: str, begin: int, end: int) -> list[tuple[int, float]]:
        """Return the timestamps (ns) and positions (rad) of a joint."""
        return [(stamp_of(state), value) for state in self.messages('joint_states', begin, end)
                for joint, value in zip(state.message.name, state.message.position)
                if joint == name]

    def trial_spans(self) -> list[tuple[int, int]]:
        """Return the time spans (ns) of all rest periods, drives, tilt commands and drops."""
        return [*self.idle, *((trial.begin, trial.end)
                              for trial in (*self.drives, *self.tilts, *self.drops))]

    def is_calm(self, begin: int, end: int) -> bool:
        """Return whether no other program delayed the graph between two times (ns)."""
        return all(window.calm for window in self.windows
                   if window.begin < end and begin < window.end)

    def load_summary(self) -> str:
        """Return a phrase with the number of trials that were not calm, or '' if all were."""
        spans = self.trial_spans()
        loaded = sum(not self.is_calm(*span) for span in spans)
        return f'{LOADED} in {loaded} of {len(spans)} trials' if loaded else ''

    def calm(self) -> 'Record':
        """Return a copy of the record without the trials that were not calm."""
        calm = copy(self)
        calm.whole = self
        calm.idle = [span for span in self.idle if self.is_calm(*span)]
        for name in ('drives', 'tilts', 'places', 'drops'):
            setattr(calm, name, [trial for trial in getattr(self, name)
                                 if self.is_calm(trial.begin, trial.end)])
        return calm


@lru_cache
def link_names(description: str) -> list[str]:
    """Return the names of all links in a URDF, or none if it is invalid."""
    try:
        return list(read_urdf(description).links)
    except (ElementTree.ParseError, ValueError):
        return []


def stamp_of(received: Received) -> int:
    """Return a message's timestamp (ns), or its publication time if the timestamp is invalid."""
    header = getattr(received.message, 'header', None)
    stamp = nanoseconds_of(header.stamp) if header else 0
    return stamp if abs(stamp - received.published) < MAX_STAMP_ERROR_NS else received.published


def message_rate(times: Sequence[float]) -> float:
    """Compute a message rate (Hz) from timestamps (s), or return 0 for fewer than six messages."""
    # On a busy machine, messages may be late but never early. The rate is therefore measured
    # between the least delayed messages in the first third and in the last third of all messages.
    count = len(times)
    if count < 6:
        return 0.0
    period = (times[-1] - times[0]) / (count - 1)

    def lateness(number: int) -> float:
        return times[number] - period * number

    first = min(range(count // 3), key=lateness)
    last = min(range(count - count // 3, count), key=lateness)
    elapsed = times[last] - times[first]
    return (last - first) / elapsed if elapsed > 0.0 else 0.0


def rest_start(track: Sequence[tuple[int, Any]], tolerance: float, duration: int) -> int | None:
    """
    Return the time (ns) at which an object came to rest, or None if the object is still moving.

    :param track: times (ns) and positions (m)
    :param tolerance: maximum distance (m) from the last position
    :param duration: minimum time (ns) for which the position does not change
    """
    since = None
    for stamp, position in reversed(track):
        if not dist(position, track[-1][1]) <= tolerance:
            break
        since = stamp
    return None if since is None or track[-1][0] - since < duration else since
