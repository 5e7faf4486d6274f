# SPDX-License-Identifier: Apache-2.0
"""Nodes that receive messages from selected topics or record a whole graph."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from importlib import import_module
from math import nan
import os
from time import monotonic, thread_time, time_ns
from typing import Any

from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.node import Node, NodeNameNonExistentError
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from tf2_msgs.msg import TFMessage
from turtle_graph.client.load import LoadMeter
from turtle_graph.client.messages import NS_PER_SECOND
from turtle_graph.client.profiles import COMMANDS, Profile, similar_names, TURTLE_COMMANDS
from turtle_graph.client.record import Received, ReceivedMarker, Record

DEPTH = 2000
"""Queue size of each subscription, sufficient for several seconds of messages."""
FETCH_PERIOD = 0.02
"""Period (s) for fetching messages."""
DISCOVERY_PERIOD = 0.5
"""Period (s) for discovering new topics."""
MAX_READING, FEW, PAUSE = 0.2, 100, 5.0
"""Processor time (s) that fewer than FEW messages may take, and the pause (s) after more time."""
MARKER_MESSAGES = {'visualization_msgs/msg/Marker', 'visualization_msgs/msg/MarkerArray'}
UNKNOWN_NODE = '_NODE_NAME_UNKNOWN_'
"""Node name that ROS reports for a publisher until the publisher's node is discovered."""


def load_type(name: str) -> Any:
    """Return the class of an interface such as 'std_srvs/srv/Trigger', or raise LookupError."""
    try:
        package, kind, class_name = name.split('/')
        return getattr(import_module(f'{package}.{kind}'), class_name)
    except (ImportError, AttributeError, TypeError, ValueError):
        raise LookupError(f'the interface {name} is not installed') from None


def number_fields(message: Any) -> Iterator[tuple[Any, str]]:
    """Yield (message, field name) for each floating-point field, including nested fields."""
    for name, kind in message.get_fields_and_field_types().items():
        if kind in ('double', 'float'):
            yield message, name
        elif hasattr(getattr(message, name), 'get_fields_and_field_types'):
            yield from number_fields(getattr(message, name))


def fill_position(message: Any, position: Sequence[float]) -> int:
    """Write a position (m) to message fields such as x or brick_x. Return the number of fields."""
    count = 0
    for owner, name in number_fields(message):
        if count < len(position) and 'xyz'[count] in name.lower().split('_'):
            setattr(owner, name, float(position[count]))
            count += 1
    return count


def fill_angle(message: Any, angle: float) -> bool:
    """Write an angle (rad) to a message's first floating-point field. Return whether it exists."""
    for owner, name in number_fields(message):
        setattr(owner, name, float(angle))
        return True
    return False


def angle_in(message: Any) -> float:
    """Return the value (rad) of the field that `fill_angle` writes, or NaN if there is none."""
    return next((float(getattr(owner, name)) for owner, name in number_fields(message)), nan)


def full_name(name: str, namespace: str) -> str:
    """Return the name of a node with its namespace."""
    return f'{namespace.rstrip("/")}/{name}'


def known_nodes(infos: Iterable[Any]) -> list[str]:
    """Return the full name of each node in a list of topic endpoints, if the name is known."""
    return [full_name(info.node_name, info.node_namespace) for info in infos
            if info.node_name != UNKNOWN_NODE]


def subscription_qos(latched: bool, reliable: bool = True) -> QoSProfile:
    """Return a QoS profile for subscriptions with the queue size DEPTH."""
    return QoSProfile(
        depth=DEPTH,
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE),
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT)


def matching_qos(publishers: Iterable[Any]) -> QoSProfile:
    """Return a QoS profile with which a subscription receives the messages of all publishers."""
    offered = [info.qos_profile for info in publishers]
    return subscription_qos(
        latched=all(qos.durability == DurabilityPolicy.TRANSIENT_LOCAL for qos in offered),
        reliable=all(qos.reliability == ReliabilityPolicy.RELIABLE for qos in offered))


Callback = Callable[[Any, Any], None]
"""A function that receives a message and its MessageInfo (a dictionary in rclpy)."""


class PollingNode(Node):
    """
    A node that receives messages only when its `fetch` method is called.

    Polling avoids a thousand wake-ups per second and preserves publication times, which the
    EventsExecutor of rclpy 7.1 does not pass to callbacks. The `fetch` method therefore reads
    from the subscription handles, as rclpy.wait_for_message does.
    """

    def __init__(self, name: str = 'listener', **node_options: Any) -> None:
        super().__init__(name, **{
            'start_parameter_services': False, 'enable_rosout': False, **node_options})
        self._callbacks: list[tuple[Subscription, Callback]] = []
        self._paused: dict[str, float] = {}  # Time (s) at which a pause in reading ends, by topic.
        self.skipped: dict[str, int] = {}  # Number of messages that were not decoded, by topic.
        self._calls: dict[tuple[Any, int], list[Received]] = {}

    def subscribe(self, message_type: Any, topic: str, callback: Callback,
                  qos: QoSProfile | int = DEPTH, raw: bool = False) -> None:
        """Subscribe to a topic with a callback that `fetch` calls for each message."""
        subscription = self.create_subscription(
            message_type, topic, lambda message: None, qos, raw=raw)
        self._callbacks.append((subscription, callback))

    def call(self, client: Any, request: Any) -> list[Received]:
        """Call a service and return a list to which `fetch` appends the response."""
        responses: list[Received] = []
        with client.handle:
            self._calls[client, client.handle.send_request(request)] = responses
        return responses

    def fetch(self) -> None:
        """Store all new responses and pass all new messages to the callbacks."""
        for client in {client for client, _ in self._calls}:
            with client.handle:
                while (taken := client.handle.take_response(client.srv_type.Response))[0]:
                    info, response = taken
                    # If two nodes provide the service, only the first response is stored.
                    self._calls.pop((client, info.request_id.sequence_number), []).append(
                        Received(info.source_timestamp, response))
        for subscription, callback in self._callbacks:
            name, begin = subscription.topic_name, thread_time()
            with subscription.handle:
                for number in range(DEPTH):
                    if number < FEW and thread_time() - begin > MAX_READING:
                        self._paused[name] = monotonic() + PAUSE
                    skip = monotonic() < self._paused.get(name, 0.0)
                    taken = subscription.handle.take_message(subscription.msg_type, skip)
                    if taken is None:
                        break
                    if skip:  # The message was taken but not decoded.
                        self.skipped[name] = self.skipped.get(name, 0) + 1
                    else:
                        callback(*taken)


class Observer(Node):
    """A node that records a running graph and sends commands to the graph."""

    def __init__(self, profile: Profile | None = None, name: str = 'referee',
                 processes: Callable[[], Iterable[int]] = lambda: [os.getpid()],
                 **node_options: Any) -> None:
        """
        Record the topics listed in a profile.

        :param processes: function that returns the IDs of the graph's processes. If they are
            unknown, this process must wake up on time instead.
        """
        super().__init__(name, **{'start_parameter_services': False, **node_options})
        self.poller = PollingNode(f'{name}_poller', **node_options)
        self.record = Record(profile or Profile())
        self.record.namespace = self.get_namespace()
        self.after_fetch: Callable[[], None] = lambda: None
        self._meter = LoadMeter(processes)
        self._discovered_at = 0
        self._subscribed: set[str] = set()
        self._publishers_by_topic: dict[str, Publisher] = {}
        self._clients_by_service: dict[str, Client] = {}
        # All namespaces may share the TF topics, or each namespace may have its own TF topics.
        for topic, static in (('tf', False), ('tf_static', True)):
            for name in {self.resolve_topic_name(f'/{topic}'), self.resolve_topic_name(topic)}:
                self.poller.subscribe(TFMessage, name, partial(self._on_transforms, static),
                                      subscription_qos(static))
        self.create_timer(FETCH_PERIOD, self.update)

    def destroy_node(self) -> None:
        """Destroy both nodes."""
        self.poller.destroy_node()
        super().destroy_node()

    def update(self) -> None:
        """Fetch messages and measure the load. Every DISCOVERY_PERIOD, discover topics."""
        now = time_ns()
        if window := self._meter.measure(now):
            self.record.windows.append(window)
            self.record.loads.append(os.getloadavg()[0])
        if now - self._discovered_at > DISCOVERY_PERIOD * NS_PER_SECOND:
            self._discovered_at = now
            self.subscribe_to_new_topics()
        self.poller.fetch()
        self.after_fetch()

    def subscribe_to_new_topics(self) -> None:
        """Subscribe to the topics in the profile and to all markers in this node's namespace."""
        record, inside = self.record, f'{self.get_namespace().rstrip("/")}/'
        if (record.topics['pose'] and record.profile.topics['cmd_vel'] == TURTLE_COMMANDS
                and not self.count_subscribers(TURTLE_COMMANDS)
                and self.count_publishers('cmd_vel')):
            record.profile.topics['cmd_vel'] = 'cmd_vel'  # The topic of turtlesim is remapped.
        names = {self.resolve_topic_name(topic): name
                 for name, topic in record.profile.topics.items()}
        for topic, types in self.get_topic_names_and_types():
            infos = self._others(self.get_publishers_info_by_topic(topic))
            if not infos:
                continue
            record.publishers.setdefault(topic, set()).update(known_nodes(infos))
            qos = matching_qos(infos)
            record.latched.setdefault(
                topic, qos.durability == DurabilityPolicy.TRANSIENT_LOCAL)
            if topic in self._subscribed:
                continue
            if topic in names:
                callback = partial(self._on_message, names[topic])
            elif MARKER_MESSAGES.intersection(types) and topic.startswith(inside):
                callback = partial(self._on_markers, topic)
            else:
                continue
            self._subscribed.add(topic)
            try:
                self.poller.subscribe(load_type(types[0]), topic, callback, qos)
            except LookupError as error:
                record.notes.append(str(error))

    def _on_message(self, name: str, message: Any, info: Any) -> None:
        content = angle_in(message) if name == 'tilt' else message
        self.record.topics[name].append(Received(info['source_timestamp'], content))

    def _on_markers(self, topic: str, message: Any, info: Any) -> None:
        for marker in getattr(message, 'markers', [message]):
            self.record.markers.append(ReceivedMarker(info['source_timestamp'], topic, marker))

    def _on_transforms(self, static: bool, message: TFMessage, info: Any) -> None:
        for transform in message.transforms:
            self.record.add_transform(info['source_timestamp'],
                                      info['publication_sequence_number'] or 0, transform, static)

    def _client(self, service: str, service_type: Any) -> Client:
        if service not in self._clients_by_service:
            self._clients_by_service[service] = self.poller.create_client(service_type, service)
        return self._clients_by_service[service]

    def _others(self, infos: Iterable[Any]) -> list[Any]:
        own = (self.get_name(), self.poller.get_name())
        return [info for info in infos if info.node_name not in own]

    def command_publisher(self, name: str) -> Any:
        """Return a publisher for 'goal_pose' or 'tilt', or None if the topic has no subscriber."""
        topic = self.resolve_topic_name(self.record.profile.topics[name])
        if topic not in self._publishers_by_topic:
            try:
                for info in self._others(self.get_subscriptions_info_by_topic(topic))[:1]:
                    # A subscription that requires latched messages receives no others.
                    qos = QoSProfile(depth=10, durability=info.qos_profile.durability)
                    self._publishers_by_topic[topic] = self.create_publisher(
                        load_type(info.topic_type), topic, qos)
            except LookupError as error:
                self.record.unclear[name] = str(error)
        return self._publishers_by_topic.get(topic)

    def send_goal(self, x: float, y: float) -> bool:
        """Send a goal position (m) in the world frame. Return whether the goal was published."""
        return self._send('goal_pose', lambda goal: fill_position(goal, (x, y)) == 2)

    def send_tilt(self, angle: float) -> bool:
        """Tilt the platform to an angle (rad), and return whether the command was published."""
        return self._send('tilt', lambda tilt: fill_angle(tilt, angle))

    def _send(self, name: str, fill: Callable[[Any], bool]) -> bool:
        publisher = self.command_publisher(name)
        if publisher is None:
            return False
        message = publisher.msg_type()
        if hasattr(message, 'header'):
            message.header.frame_id = self.record.actual('world')
            message.header.stamp = self.get_clock().now().to_msg()
        if not fill(message):
            self.record.unclear[name] = f'the type of {publisher.topic} has no suitable field'
            return False
        publisher.publish(message)
        return True

    def recognize_names(self) -> None:
        """In the profile, replace names missing from the graph with similar names in the graph."""
        record, types = self.record, dict(self.get_topic_names_and_types())
        published = {topic: types.get(topic, []) for topic in record.publishers}
        subscribed = {topic: kinds for topic, kinds in types.items()
                      if self._others(self.get_subscriptions_info_by_topic(topic))}
        services = dict(self.get_service_names_and_types())
        frames: dict[str, list[str]] = {frame: [] for frame in record.frame_names()}
        for names, offered in ((record.profile.topics, published),
                               (record.profile.services, services),
                               (record.profile.frames, frames)):
            for name, used in names.items():
                available = subscribed if name in COMMANDS else offered
                # A name that comes from a profile file must not be replaced.
                if used in (name, f'turtle1/{name}') and not (
                        {used, self.resolve_topic_name(used)} & available.keys()):
                    self._recognize(name, names, available)

    def _recognize(self, name: str, names: dict[str, str], available: dict[str, list[str]]
                   ) -> None:
        candidates = [candidate for candidate in similar_names(name, available)
                      if candidate[0] != '/' or candidate.startswith(self.get_namespace())]
        if len(candidates) > 1:
            self.record.unclear[name] = (
                f'{name} could be {" or ".join(sorted(candidates))}; add it to a profile')
        elif candidates:
            names[name], = candidates
            kinds = ''.join(f' ({kind})' for kind in available[names[name]])
            self.record.note(f'assumed: {name} is {names[name]}{kinds}')

    def service_client(self, name: str) -> Any:
        """Return a client for 'place' or 'drop', or raise LookupError if none can be created."""
        service = self.resolve_service_name(self.record.profile.services[name])
        types = dict(self.get_service_names_and_types()).get(service)
        if not types:
            raise LookupError(f'there is no service {service}')
        return self._client(service, load_type(types[0]))

    def find_duplicates(self) -> None:
        """Mark the topics and frames that several graphs in this domain publish as unclear."""
        record = self.record
        for name in ('pose', 'cmd_vel', 'odom', 'joint_states'):
            topic = self.resolve_topic_name(record.profile.topics[name])
            nodes = known_nodes(self._others(self.get_publishers_info_by_topic(topic)))
            # Several nodes may publish different joints.
            joints = {tuple(getattr(received.message, 'name', ()))
                      for received in record.topics[name]}
            if len(nodes) > max(1, len(joints)):
                record.unclear[name] = (f'{len(nodes)} nodes publish '
                                        f'{record.profile.topics[name]}: {", ".join(nodes)}')
        for name, frame in record.frames.items():
            if frame.broadcasters > 1:
                record.unclear[f'frame {name}'] = f'several nodes broadcast {name}'

    def record_users(self) -> None:
        """Record which nodes subscribe to the topics and provide the services."""
        users = self.record.users
        for topic, _ in self.get_topic_names_and_types():
            infos = self._others(self.get_subscriptions_info_by_topic(topic))
            users.setdefault(topic, set()).update(known_nodes(infos))
        for node in self.get_node_names_and_namespaces():
            with suppress(NodeNameNonExistentError):  # The node may have ended.
                for service, _ in self.get_service_names_and_types_by_node(*node):
                    users.setdefault(service, set()).add(full_name(*node))

    def other_namespaces(self) -> set[str]:
        """Return all namespaces that contain nodes, except '/' and the namespace of this node."""
        return {namespace for _, namespace in self.get_node_names_and_namespaces()
                } - {'/', self.get_namespace()}

    def parameter_clients(self) -> list[Client]:
        """Return clients for the get_parameters services of all other nodes."""
        own = (self.get_name(), self.poller.get_name())
        return [self._client(f'{full_name(*node)}/get_parameters', GetParameters)
                for node in self.get_node_names_and_namespaces() if node[0] not in own]
