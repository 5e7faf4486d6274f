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
What a user does with a graph: send the robot somewhere, place and drop bricks, see what happens.

It knows the graph through an `Observer` alone, and waits for nothing without an end.
"""

from collections.abc import Callable
from math import dist, sqrt
from time import time_ns
from typing import Any

from turtle_referee.graph_client.constants import ARENA_SIZE, NS_PER_SECOND
from turtle_referee.graph_client.drops import DropWatch
from turtle_referee.graph_client.geometry import Vector
from turtle_referee.graph_client.observer import fill, Observer
from turtle_referee.graph_client.profile import NUMBERS
from turtle_referee.graph_client.record import Request, Drive, plateau
from turtle_referee.graph_client.spinning import Spinner

PATIENCE = 3.0  # how long (s) something may take that should be done at once
LONGEST = 60.0  # how long (s) anything is waited for, whatever numbers say how long it takes
REST = 0.3  # how long (s) a robot stands still that is at rest
HOVERING = 0.5  # how long (s) a brick hovers before it is dropped
AFTER = 0.6  # how long (s) a brick is watched that has come down beside the platform


class GraphClient:
    """What a user does with a graph."""

    def __init__(self, graph: Spinner, observer: Observer, patience: float = PATIENCE) -> None:
        """Do nothing yet; the graph spins the observer, the patience (s) is for what is quick."""
        self.patience = patience
        self.graph = graph
        self.observer = observer
        self.record = observer.record

    def until(self, condition: Callable[[], Any], timeout: float) -> bool:
        """Wait until a condition holds, for a time (s) at most; tell whether it does."""
        try:
            self.graph.spin_until(condition, min(LONGEST, timeout), '')
        except TimeoutError:
            return False
        return True

    def number(self, name: str) -> float:
        """Return a number of the robot, a usual one where none is known."""
        return self.record.profile.numbers.get(name, NUMBERS[name])

    def is_complete(self) -> bool:
        """Tell whether the whole graph is there: robot, arena and catcher."""
        record = self.record
        topics = ('pose', 'cmd_vel', 'odom', 'joint_states', 'robot_description')
        return bool(all(record.topics[name] for name in topics) and record.markers
                    and {'odom', 'base_link', 'platform', 'brick'} <= set(record.frames)
                    and self.has('place') and self.has('drop') and self.observer.has_goal_subscriber()
                    and self.observer.resolve_topic_name(
                        record.profile.topics['goal_pose']) in record.publishers)

    def has(self, service: str) -> bool:
        """Tell whether a service is there."""
        try:
            return self.observer.client(service).service_is_ready()
        except LookupError:
            return False

    # ------------------------------------------------------------------------------- the robot

    def robot_position(self) -> tuple[float, float] | None:
        """Return where the robot is in the world (m), None where nobody says."""
        said = self.record.topics['pose'][-1:]
        return (said[0].message.x, said[0].message.y) if said else None

    def distance_to(self, place: tuple[float, float]) -> float:
        """Return how far the robot is from a point of the world (m); NaN if that is unknown."""
        return dist(place, self.robot_position() or (float('nan'), float('nan')))

    def is_at_rest(self) -> bool:
        """Tell whether the robot has stood still for a while."""
        track = [(one.published, (one.message.x, one.message.y)) for one in self.record.messages(
            'pose', time_ns() - round(REST * NS_PER_SECOND))]
        # On a busy machine some of this time may not have been heard of yet.
        since = plateau(track, 1e-3, round(0.8 * REST * NS_PER_SECOND))
        return since is not None and since == track[0][0]

    def go(self, goal: tuple[float, float]) -> Drive | None:
        """Send the robot somewhere and wait until it rests; return the drive, if it is known."""
        if not self.robot_position() or not self.until(self.observer.has_goal_subscriber, self.patience):
            return None
        # On a busy machine it may still drive, and where it is may not have been heard of yet.
        self.until(self.is_at_rest, self.patience)
        start = self.robot_position()
        assert start is not None
        begin, way = time_ns(), self.distance_to(goal)
        self.observer.send_goal(*goal)
        # It has to set off first: what rests in the beginning has not arrived.
        if way < 0.02 or self.until(lambda: self.distance_to(start) > 0.01, self.patience):
            self.until(self.is_at_rest, way / self.number('max_velocity') * 2.0 + self.patience)
        drive = Drive(begin, time_ns(), start, goal)
        self.record.drives.append(drive)
        return drive

    # ------------------------------------------------------------------------------- the brick

    def ask(self, service: str, place: Vector | None = None) -> Request:
        """Call 'place', with where to put the brick (m), or 'drop'; return how it answered."""
        begin = time_ns()
        try:
            self.until(lambda: self.has(service), self.patience)
            client = self.observer.client(service)
            request = client.srv_type.Request()
            if place is not None and not fill(request, place):
                raise LookupError(f'the request of {service} has no fields x, y and z')
            answers = self.observer.listener.ask(client, request)
            if not self.until(lambda: answers, self.patience):
                raise LookupError(f'{service} does not answer')
        except LookupError as error:
            return Request(begin, time_ns(), place, False, str(error))
        end, response = answers[0]
        return Request(begin, end, place, bool(getattr(response, 'success', True)),
                   str(getattr(response, 'message', '')))

    def place(self, place: Vector, hovering: float = HOVERING) -> Request:
        """Place the brick (m), and let it hover for a time (s)."""
        ask = self.ask('place', place)
        if ask.accepted:
            self.graph.spin_for(hovering)
        ask = ask._replace(end=time_ns())
        self.record.places.append(ask)
        return ask

    def drop(self, place: Vector,
             told: Callable[[DropWatch], None] = lambda watch: None) -> DropWatch:
        """
        Drop the brick that hovers at a place (m) and wait until all is over.

        That is when a brick that was caught has been tipped off and the platform is level, or
        shortly after it has come down elsewhere. Whenever something is heard, it is told.
        """
        now = time_ns()
        # On a busy machine, where the robot is may not have been heard of yet.
        self.until(lambda: self.record.platform(now), REST)
        watch = DropWatch(self.record, now, place, self.record.platform(now))

        def look() -> None:
            watch.look()
            told(watch)

        self.observer.after_fetch = look
        try:
            watch.asked = time_ns()
            watch.ask = self.ask('drop')
            if watch.ask.accepted and self.until(lambda: watch.released, self.patience):
                self._see_out(watch)
        finally:
            self.observer.after_fetch = lambda: None
            watch.end = time_ns()
            self.record.drops.append(watch)
        return watch

    def _see_out(self, watch: DropWatch) -> None:
        """Wait until all is over with a brick that falls."""
        fall = sqrt(2.0 * max(watch.place[2], 0.1) / self.number('gravity_accel'))
        self.until(lambda: watch.down, fall * 1.5 + self.patience)
        if watch.caught:
            across = ARENA_SIZE / self.number('max_velocity')
            self.until(lambda: watch.tilted, across * 1.5 + self.patience)
            self.until(lambda: watch.floated, 2.0 * self.patience)
            self.until(lambda: watch.leveled and self.is_at_rest(), self.patience)
        else:
            self.graph.spin_for(AFTER)
            self.until(self.is_at_rest, self.patience)
