# SPDX-License-Identifier: Apache-2.0
"""Send goals to a running graph, place and drop bricks, and wait for the results."""

from collections.abc import Callable, Sequence
from math import dist, sqrt
from time import time_ns
from typing import Any

from turtle_graph.client.drops import DropWatch
from turtle_graph.client.geometry import CENTER, Vector
from turtle_graph.client.messages import NS_PER_SECOND
from turtle_graph.client.observer import fill_position, number_fields, Observer
from turtle_graph.client.profiles import FRAMES, NUMBERS
from turtle_graph.client.record import Drive, EXTRAPOLATION_NS, Request, rest_start
from turtle_graph.client.spinning import Spinner

TIMEOUT = 3.0
"""Timeout (s) for immediate actions."""
MAX_TIMEOUT = 60.0
"""Upper limit (s) for timeouts computed from the robot's parameters."""
REST_TIME = 0.3
"""Duration (s) without motion after which the robot is considered to be at rest."""
HOVERING_TIME = 0.5
"""Time (s) between placing and dropping a brick."""


class GraphClient:
    """A client that sends commands to a running graph. Every wait has a timeout."""

    def __init__(self, graph: Spinner, observer: Observer, timeout: float = TIMEOUT) -> None:
        """Create a client. `graph` spins `observer`. `timeout` (s) limits immediate actions."""
        self.timeout = timeout
        self.graph = graph
        self.observer = observer
        self.record = observer.record

    def wait_until(self, condition: Callable[[], Any], timeout: float) -> bool:
        """Wait for a condition with a timeout (s), and return whether the condition was met."""
        try:
            self.graph.spin_until(condition, min(MAX_TIMEOUT, timeout), '')
        except TimeoutError:
            return False
        return True

    def number(self, name: str) -> float:
        """Return the value of a physical parameter, or a typical value if the value is unknown."""
        return self.record.profile.numbers.get(name, NUMBERS[name])

    def missing(self) -> list[str]:
        """Return the names of the topics, services and frames that have not appeared yet."""
        record, goal_pose = self.record, self.record.profile.topics['goal_pose']
        names, frames = record.profile.topics, record.frame_names()
        parts = {'markers': record.markers,
                 'tilt': self.observer.command_publisher('tilt'),
                 'goal_pose': self.observer.command_publisher('goal_pose')
                 and self.observer.resolve_topic_name(goal_pose) in record.publishers,
                 **{names[name]: record.topics[name] for name in (
                     'pose', 'cmd_vel', 'odom', 'joint_states', 'robot_description')},
                 **{name: self.has_service(name) for name in ('place', 'drop')},
                 **{f'frame {name}': record.actual(name) in frames for name in FRAMES}}
        return [name for name, is_present in parts.items() if not is_present]

    def has_service(self, name: str) -> bool:
        """Return whether a service is available."""
        try:
            return self.observer.service_client(name).service_is_ready()
        except LookupError:
            return False

    def robot_position(self) -> tuple[float, float] | None:
        """Return the robot's position (m) in the world frame, or None if no pose was received."""
        poses = self.record.topics['pose']
        return (poses[-1].message.x, poses[-1].message.y) if poses else None

    def distance_to(self, point: tuple[float, float]) -> float:
        """Return the distance (m) from the robot to a point, or NaN if no pose was received."""
        return dist(point, self.robot_position() or (float('nan'), float('nan')))

    def is_at_rest(self) -> bool:
        """Return whether the robot has been at rest for REST_TIME."""
        begin = time_ns() - round(REST_TIME * NS_PER_SECOND)
        track = [(received.published, (received.message.x, received.message.y))
                 for received in self.record.messages('pose', begin)]
        # On a busy machine, the latest poses may not have been received yet.
        since = rest_start(track, 1e-3, round(0.8 * REST_TIME * NS_PER_SECOND))
        return since is not None and since == track[0][0]

    def drive_to(self, goal: tuple[float, float]) -> Drive | None:
        """Send a goal position (m) and return the recorded drive, or None if no goal was sent."""
        if not self.wait_until(lambda: self.observer.command_publisher('goal_pose'), self.timeout):
            return None
        # On a busy machine, the previous drive may not be over yet.
        self.wait_until(self.is_at_rest, self.timeout)
        start = self.robot_position()
        if start is None:
            return None
        begin, distance = time_ns(), self.distance_to(goal)
        if not self.observer.send_goal(*goal):
            return None
        if distance < 0.02 or self.wait_until(
                lambda: self.distance_to(start) > 0.01, self.timeout):
            self.wait_until(self.is_at_rest,
                            distance / self.number('max_velocity') * 2.0 + self.timeout)
        drive = Drive(begin, time_ns(), start, goal)
        self.record.drives.append(drive)
        return drive

    def call(self, service: str, position: Sequence[float] | None = None) -> Request:
        """Call the service 'place' (with a position in m) or 'drop', and return the result."""
        begin = time_ns()
        try:
            self.wait_until(lambda: self.has_service(service), self.timeout)
            client = self.observer.service_client(service)
            request = client.srv_type.Request()
            if position is None:
                self._fill_release(request)
            else:
                position = position[:fill_position(request, position)]
                if len(position) < 2:
                    self.record.unclear[service] = (
                        f'the request of {client.srv_name} has no fields for x and y')
                    raise LookupError(self.record.unclear[service])
            responses = self.observer.poller.call(client, request)
            if not self.wait_until(lambda: responses, self.timeout):
                raise LookupError(f'{service} does not respond')
        except LookupError as error:
            return Request(begin, time_ns(), position, False, str(error), False)
        end, response = responses[0]
        message = str(getattr(response, 'message', ''))
        # A response to which a node assigns nothing contains False and no message.
        accepted = bool(getattr(response, 'success', True) or not message)
        return Request(begin, end, position, accepted, message)

    def _fill_release(self, request: Any) -> None:
        for owner, name in number_fields(request):
            gravity = self.number('gravity_accel')
            setattr(owner, name, gravity)
            self.record.note(f'assumed: drop expects the gravity, {gravity:g} m/s^2')

    def place(self, position: Vector, hovering: float = HOVERING_TIME) -> Request:
        """Place the brick at a given position (m) and let it hover for a given duration (s)."""
        request = self.call('place', position)
        if not request.answered and self.has_service('place'):
            request = self.call('place', position)  # On a busy machine, a response may be lost.
        if request.accepted:
            self.graph.spin_for(hovering)
            brick = self.record.pose('brick', time_ns() - EXTRAPOLATION_NS)
            if len(request.value) == 2 and brick is not None:
                self.record.note('assumed: place has no z, and the arena chooses the height')
                request = request._replace(value=(*request.value, float(brick.position[2])))
        request = request._replace(end=time_ns())
        if 'place' not in self.record.unclear:
            self.record.places.append(request)
        return request

    def drop(self, place: Vector) -> DropWatch:
        """
        Drop the brick, which hovers at the given position (m), and wait until the drop ends.

        The drop of a caught brick ends when the platform is level again. The drop of any other
        brick ends shortly after the brick lands.
        """
        now = time_ns()
        # On a busy machine, the latest transforms may not have been received yet.
        self.wait_until(lambda: self.record.pose('platform', now), REST_TIME)
        watch = DropWatch(self.record, now, place)
        self.observer.after_fetch = watch.update
        try:
            watch.requested = time_ns()
            watch.request = self.call('drop')
            if watch.request.accepted and self.wait_until(lambda: watch.released, self.timeout):
                self._wait_for_end(watch)
        finally:
            self.observer.after_fetch = lambda: None
            watch.end = time_ns()
            if 'drop' not in self.record.unclear:
                self.record.drops.append(watch)
        return watch

    def _wait_for_end(self, watch: DropWatch) -> None:
        fall_time = sqrt(2.0 * max(watch.place[2], 0.1) / self.number('gravity_accel'))
        self.wait_until(lambda: watch.down, fall_time * 1.5 + self.timeout)
        if watch.caught:
            driving_time = self.distance_to(CENTER) / self.number('max_velocity')
            timeout = driving_time * 1.5 + 2.0 * self.timeout
            if self.wait_until(lambda: watch.tilted, timeout) and self.wait_until(
                    lambda: watch.floated, 2.0 * self.timeout):
                self.wait_until(lambda: watch.leveled, self.timeout)
        else:
            self.graph.spin_for(0.6)  # Observe whether the landed brick moves again.
        self.wait_until(self.is_at_rest, self.timeout)
