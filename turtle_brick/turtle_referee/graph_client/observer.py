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
Nodes that keep what a graph says: a `PollingNode` what it is told to hear, an `Observer` everything.

An observer knows the graph by the names of a profile and reads every type from the graph, so that
any implementation will do. It also asks for what a user would, and says nothing until then.
"""

from collections.abc import Callable, Sequence
from functools import cache, partial
from importlib import import_module
from statistics import fmean
from time import time_ns
from typing import Any

from geometry_msgs.msg import PoseStamped
import psutil
from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from tf2_msgs.msg import TFMessage
from turtle_referee.graph_client.constants import NS_PER_SECOND
from turtle_referee.graph_client.profile import Profile
from turtle_referee.graph_client.record import Received, LATE, ReceivedMarker, Record

DEPTH = 2000  # how many messages may wait to be heard: a reader that falls behind loses none
FETCH_PERIOD = 0.02  # time (s) after which what has come is fetched
LOOK_PERIOD = 0.5  # time (s) after which new topics, and what the processors do, are looked at
FULL = 95.0  # how much (%) they do when nothing is left for a graph to be in time

MARKER_TYPES = {'visualization_msgs/msg/Marker', 'visualization_msgs/msg/MarkerArray'}


def load_type(name: str) -> Any:
    """Return the class of an interface, as of 'std_srvs/srv/Trigger'; LookupError without it."""
    package, kind, name_there = name.split('/')
    try:
        return getattr(import_module(f'{package}.{kind}'), name_there)
    except (ImportError, AttributeError):
        raise LookupError(f'the interface {name} is not installed here') from None


def fill(message: Any, place: Sequence[float]) -> bool:
    """Write a place (m) into the first fields x, y and z at any depth; tell if there are such."""
    fields = message.get_fields_and_field_types()
    if {'x', 'y', 'z'} <= set(fields):
        message.x, message.y, message.z = map(float, place)
        return True
    parts = (getattr(message, name) for name in fields)
    return any(hasattr(part, 'get_fields_and_field_types') and fill(part, place)
               for part in parts)


def subscription_qos(latched: bool, reliable: bool = True) -> QoSProfile:
    """Return how to subscribe to what is repeated to who comes late, or to what gets lost."""
    return QoSProfile(
        depth=DEPTH,
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE),
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT)


Keep = Callable[[Any, Any], None]
"""Called with a message, and with its source_timestamp and so on (rclpy's MessageInfo)."""


def append_to(messages: list[Received]) -> Keep:
    """Return what adds a message to a list, with when it was published."""
    return lambda message, info: messages.append(Received(info['source_timestamp'], message))


class PollingNode(Node):
    """
    Keep what is heard, each message with when it was published.

    No executor spins it. What has come waits in the middleware until it is fetched: nobody is
    woken by each of a thousand messages per second. Each comes with when it was published, which
    the EventsExecutor of rclpy 7.1 cannot pass on to a callback.
    """

    def __init__(self, name: str = 'listener', **node_options: Any) -> None:
        """Hear nothing yet; the options are those of rclpy.node.Node."""
        super().__init__(name, **{
            'start_parameter_services': False, 'enable_rosout': False, **node_options})
        self._kept: list[tuple[Subscription, Keep]] = []
        self._asked: dict[tuple[Any, int], list[Received]] = {}

    def hear(self, message_type: Any, topic: str, qos: QoSProfile | int = DEPTH) -> list[Received]:
        """Hear a topic from now on; return a list to which `fetch` adds what has come."""
        messages: list[Received] = []
        self.subscribe(message_type, topic, append_to(messages), qos)
        return messages

    def subscribe(self, message_type: Any, topic: str, keep: Keep,
               qos: QoSProfile | int = DEPTH) -> None:
        """Have `fetch` call a function with each message of a topic, and what DDS says of it."""
        subscription = self.create_subscription(message_type, topic, lambda message: None, qos)
        self._kept.append((subscription, keep))

    def ask(self, client: Any, request: Any) -> list[Received]:
        """Call a service; return a list to which `fetch` adds the answer."""
        answers: list[Received] = []
        with client.handle:
            self._asked[client, client.handle.send_request(request)] = answers
        return answers

    def fetch(self) -> None:
        """Keep all that has come since the last time, topic by topic."""
        for client in {client for client, _ in self._asked}:
            with client.handle:
                while (taken := client.handle.take_response(client.srv_type.Response))[0]:
                    info, response = taken
                    # Where two nodes serve, both answer: the first counts.
                    self._asked.pop((client, info.request_id.sequence_number), []).append(
                        Received(info.source_timestamp, response))
        for subscription, keep in self._kept:
            # As rclpy.wait_for_message does.
            with subscription.handle:
                while (taken := subscription.handle.take_message(
                        subscription.msg_type, subscription.raw)) is not None:
                    keep(*taken)


class Observer(Node):
    """Hear a graph, and ask it for what a user would."""

    def __init__(self, profile: Profile | None = None, name: str = 'referee',
                 **node_options: Any) -> None:
        """Begin to listen, by the names of a profile; the options are those of a node."""
        super().__init__(name, **{'start_parameter_services': False, **node_options})
        self.listener = PollingNode(f'{name}_ears', **node_options)
        self.record = Record(profile or Profile())
        self.record.namespace = self.get_namespace()
        self.after_fetch: Callable[[], None] = lambda: None  # called after each fetch
        self.fetched_at = time_ns()  # when (ns) what has come was fetched last
        self._looked_at = 0
        self._heard_topics: set[str] = set()
        # each made when it is needed first
        self._publisher: Callable[[str, Any], Any] = cache(
            lambda name, kind: self.create_publisher(kind, self.record.profile.topics[name], 10))
        self._client: Callable[[str, Any], Client] = cache(
            lambda name, kind: self.listener.create_client(kind, name))
        psutil.cpu_percent(percpu=True)  # since when the next one tells
        for topic, static in (('/tf', False), ('/tf_static', True)):
            self.listener.subscribe(
                TFMessage, topic, partial(self._keep_transforms, static), subscription_qos(static))
        self.create_timer(FETCH_PERIOD, self.update)

    def destroy_node(self) -> None:
        """Hear nothing any more."""
        self.listener.destroy_node()
        super().destroy_node()

    # ---------------------------------------------------------------------------- what is heard

    def update(self) -> None:
        """Fetch what has come, and look for new topics now and then."""
        last, self.fetched_at = self.fetched_at, time_ns()
        if (self.fetched_at - last) > FETCH_PERIOD * NS_PER_SECOND + LATE:
            self.record.stalls.append((last, self.fetched_at))
        if self.fetched_at - self._looked_at > LOOK_PERIOD * NS_PER_SECOND:
            if fmean(psutil.cpu_percent(percpu=True)) >= FULL:
                self.record.stalls.append((self._looked_at, self.fetched_at))
            self._looked_at = self.fetched_at
            self.subscribe_to_new_topics()
        self.listener.fetch()
        self.after_fetch()

    def subscribe_to_new_topics(self) -> None:
        """Listen to all topics of the graph that matter, but to no neighbor's markers."""
        record, inside = self.record, f'{self.get_namespace().rstrip("/")}/'
        names = {self.resolve_topic_name(topic): name
                 for name, topic in record.profile.topics.items()}
        for topic, kinds in self.get_topic_names_and_types():
            infos = [info for info in self.get_publishers_info_by_topic(topic)
                     if info.node_name != self.get_name()]
            if not infos:
                continue
            record.publishers.setdefault(topic, set()).update(
                f'{info.node_namespace.rstrip("/")}/{info.node_name}' for info in infos)
            qos = [info.qos_profile for info in infos]
            # Who does not repeat what gets lost, or was said before, can't be asked to.
            reliable = all(one.reliability == ReliabilityPolicy.RELIABLE for one in qos)
            latched = all(one.durability == DurabilityPolicy.TRANSIENT_LOCAL for one in qos)
            record.latched.setdefault(topic, latched)
            if topic in names:
                keep = append_to(record.topics[names[topic]])
            elif MARKER_TYPES.intersection(kinds) and topic.startswith(inside):
                keep = partial(self._keep_markers, topic)
            else:
                continue
            if topic not in self._heard_topics:
                self._heard_topics.add(topic)
                try:
                    self.listener.subscribe(
                        load_type(kinds[0]), topic, keep, subscription_qos(latched, reliable))
                except LookupError as error:
                    record.notes.append(str(error))

    def _keep_markers(self, topic: str, message: Any, info: Any) -> None:
        for marker in getattr(message, 'markers', [message]):
            self.record.markers.append(ReceivedMarker(info['source_timestamp'], topic, marker))

    def _keep_transforms(self, static: bool, message: TFMessage, info: Any) -> None:
        for transform in message.transforms:
            self.record.add_transform(info['source_timestamp'],
                                      info['publication_sequence_number'] or 0, transform, static)

    # ------------------------------------------------------------------- what a user would do

    def send_goal(self, x: float, y: float) -> None:
        """Send the robot to a point of the world (m)."""
        goal = PoseStamped()
        goal.header.frame_id = 'world'
        goal.header.stamp = self.get_clock().now().to_msg()
        goal.pose.position.x, goal.pose.position.y = x, y
        self._publisher('goal_pose', PoseStamped).publish(goal)

    def has_goal_subscriber(self) -> bool:
        """Tell whether somebody hears goals."""
        return self._publisher('goal_pose', PoseStamped).get_subscription_count() > 0

    def send_tilt(self, angle: float) -> None:
        """Tilt the platform (rad), by the first number of the message; LookupError if none can."""
        topic = self.resolve_topic_name(self.record.profile.topics['tilt'])
        for info in self.get_subscriptions_info_by_topic(topic):
            message = load_type(info.topic_type)()
            for name, kind in message.get_fields_and_field_types().items():
                if kind in ('double', 'float'):
                    setattr(message, name, float(angle))
                    self._publisher('tilt', type(message)).publish(message)
                    return
        raise LookupError(f'nobody hears {topic}, or no angle is in it')

    def client(self, name: str) -> Any:
        """Return the client of 'place' or 'drop', as the graph has it; LookupError without it."""
        full = self.resolve_service_name(self.record.profile.services[name])
        kinds = dict(self.get_service_names_and_types()).get(full)
        if not kinds:
            raise LookupError(f'there is no service {full}')
        return self._client(full, load_type(kinds[0]))

    def parameter_clients(self) -> list[Client]:
        """Return a client for the parameters of each other node."""
        own = (self.get_name(), self.listener.get_name())
        return [self._client(f'{namespace.rstrip("/")}/{name}/get_parameters', GetParameters)
                for name, namespace in self.get_node_names_and_namespaces() if name not in own]
