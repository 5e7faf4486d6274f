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
Nodes that keep what a graph says: a `Listener` what it is told to hear, an `Observer` everything.

An observer knows the graph by the names of a profile and reads every type from the graph, so that
any implementation will do. It also asks for what a user would, and says nothing until then.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from importlib import import_module
from statistics import fmean
from time import time_ns
from typing import Any

from geometry_msgs.msg import PoseStamped
import psutil
from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo
from tf2_msgs.msg import TFMessage
from turtle_referee.constants import NANOSECONDS
from turtle_referee.names import Profile
from turtle_referee.record import Heard, LATE, MarkerHeard, Record

DEPTH = 2000
"""How many messages may wait to be heard: a reader that falls behind loses none."""

FETCH_PERIOD = 0.02
"""Time (s) after which what has come is fetched."""

LOOK_PERIOD = 0.5
"""Time (s) after which new topics are looked for, and how much the processors had to do."""

FULL = 95.0
"""How much (%) the processors have to do when nothing is left for a graph to be in time."""

MARKER_TYPES = ('visualization_msgs/msg/Marker', 'visualization_msgs/msg/MarkerArray')

TYPES = {
    'cmd_vel': ('geometry_msgs/msg/Twist', 'geometry_msgs/msg/TwistStamped'),
    'odom': ('nav_msgs/msg/Odometry',),
    'joint_states': ('sensor_msgs/msg/JointState',),
    'goal_pose': ('geometry_msgs/msg/PoseStamped',),
    'pose': ('turtlesim/msg/Pose',),
    'robot_description': ('std_msgs/msg/String',),
}
"""The types that the assignment names; of `tilt` it names none."""


def load_type(name: str) -> Any:
    """
    Return the class of an interface, as of 'std_srvs/srv/Trigger'.

    :raises LookupError: it is not installed here
    """
    package, kind, name_there = name.split('/')
    try:
        return getattr(import_module(f'{package}.{kind}'), name_there)
    except (ImportError, AttributeError):
        raise LookupError(f'the interface {name} is not installed here') from None


def fill(message: Any, place: Sequence[float]) -> bool:
    """
    Write a place (m) into a request: into the first fields x, y and z that it has at any depth.

    :return: Whether there are such fields.
    """
    fields = message.get_fields_and_field_types()
    if {'x', 'y', 'z'} <= set(fields):
        message.x, message.y, message.z = map(float, place)
        if 'orientation' not in fields and 'w' not in fields:
            return True
    for name in fields:
        part = getattr(message, name)
        if hasattr(part, 'get_fields_and_field_types') and fill(part, place):
            if hasattr(message, 'orientation'):
                message.orientation.w = 1.0
            return True
    return False


Keep = Callable[[Any, Any], None]
"""Called with a message, and with its source_timestamp and so on (rclpy's MessageInfo)."""


def keeper(messages: list[Heard]) -> Keep:
    """Return what adds a message to a list, with when it was published."""
    return lambda message, info: messages.append(Heard(info['source_timestamp'], message))


class Listener(Node):
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
        self._asked: dict[tuple[Any, int], list[Heard]] = {}

    def hear(self, message_type: Any, topic: str, qos: QoSProfile | int = DEPTH) -> list[Heard]:
        """Hear a topic from now on; return a list to which `fetch` adds what has come."""
        messages: list[Heard] = []
        self.listen(message_type, topic, keeper(messages), qos)
        return messages

    def listen(self, message_type: Any, topic: str, keep: Keep,
               qos: QoSProfile | int = DEPTH) -> None:
        """Have `fetch` call a function with each message of a topic, and what DDS says of it."""
        subscription = self.create_subscription(message_type, topic, lambda message: None, qos)
        self._kept.append((subscription, keep))

    def ask(self, client: Any, request: Any) -> list[Heard]:
        """Call a service; return a list to which `fetch` adds the answer."""
        answers: list[Heard] = []
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
                        Heard(info.source_timestamp, response))
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
        self.listener = Listener(f'{name}_ears', **node_options)
        self.record = Record(profile or Profile())
        self.record.namespace = self.get_namespace()
        self.on_news: Callable[[], None] = lambda: None
        """Called whenever what has come was fetched."""
        self._heard_topics: set[str] = set()
        self._topics_told: dict[str, Publisher] = {}
        self._services_asked: dict[str, Client] = {}
        self._looked_at = 0
        psutil.cpu_percent(percpu=True)  # since when the next one tells
        self.fetched_at = time_ns()
        """When (ns) what has come was fetched last."""
        for topic, static in (('/tf', False), ('/tf_static', True)):
            self.listener.listen(
                TFMessage, topic, self._transform_keeper(static), how_to_hear(static))
        self.create_timer(FETCH_PERIOD, self.update)

    def update(self) -> None:
        """Fetch what has come, and look for new topics now and then."""
        last, self.fetched_at = self.fetched_at, time_ns()
        if (self.fetched_at - last) > FETCH_PERIOD * NANOSECONDS + LATE:
            self.record.stalls.append((last, self.fetched_at))
        if self.fetched_at - self._looked_at > LOOK_PERIOD * NANOSECONDS:
            if fmean(psutil.cpu_percent(percpu=True)) >= FULL:
                self.record.full.append((self._looked_at, self.fetched_at))
            self._looked_at = self.fetched_at
            self.look_around()
        self.listener.fetch()
        self.on_news()

    def destroy_node(self) -> None:
        """Hear nothing any more."""
        self.listener.destroy_node()
        super().destroy_node()

    def others(self) -> list[str]:
        """Return the full names of the graph's nodes, without its own two."""
        own = (self.get_fully_qualified_name(), self.listener.get_fully_qualified_name())
        return [name for name in self.get_fully_qualified_node_names() if name not in own]

    def look_around(self) -> None:
        """Listen to all topics of the graph that matter."""
        record = self.record
        own = self.get_fully_qualified_name()
        there = {}
        for topic, types in self.get_topic_names_and_types():
            speakers = {
                full_name(info) for info in self.get_publishers_info_by_topic(topic)} - {own}
            if speakers:
                there[topic] = types
                record.speakers.setdefault(topic, set()).update(speakers)
        for name, topic in record.profile.topics.items():
            full = self.resolve_topic_name(topic)
            types = there.get(full, [])
            usable = [kind for kind in types if kind in TYPES.get(name, types)]
            if usable and full not in self._heard_topics:
                self._join(full, usable[0], keeper(record.topics[name]))
        # Not those of a neighbor in another namespace.
        inside = f'{self.get_namespace().rstrip("/")}/'
        for topic, types in there.items():
            for kind in MARKER_TYPES:
                if (kind in types and topic.startswith(inside)
                        and topic not in self._heard_topics):
                    record.latched[topic] = self._join(topic, kind, self._marker_keeper(topic))

    def _join(self, topic: str, kind: str, keep: Keep) -> bool:
        """Keep a topic from now on, if its type is installed; tell whether it is latched."""
        self._heard_topics.add(topic)
        # Whoever speaks without repeating what gets lost, or what was said before, can't be asked
        # to repeat it.
        speakers = [info.qos_profile for info in self.get_publishers_info_by_topic(topic)]
        latched = all(qos.durability == DurabilityPolicy.TRANSIENT_LOCAL for qos in speakers)
        reliable = all(qos.reliability == ReliabilityPolicy.RELIABLE for qos in speakers)
        try:
            self.listener.listen(load_type(kind), topic, keep, how_to_hear(latched, reliable))
        except LookupError as error:
            self.record.notes.append(str(error))
        return latched

    def doubts(self) -> list[str]:
        """Say what seems to be wrong with where one listens: a sentence for each."""
        found = []
        counts = Counter(self.get_fully_qualified_node_names())
        twice = sorted(name for name, count in counts.items() if count > 1)
        if twice:
            found.append(f'several nodes are called {", ".join(twice)}: do two graphs run here?')
        elif served := [name for name in map(
                self.resolve_service_name, self.record.profile.services.values())
                if self.count_services(name) > 1]:
            found.append(f'several nodes serve {", ".join(served)}: end all but one')
        if there := self.elsewhere():
            found.append(f'a turtle is in the namespace {there[0] or "/"}: say --namespace '
                         f'{there[0].lstrip("/") or "/"}')
        return found

    def elsewhere(self) -> list[str]:
        """Return the namespaces in which a turtle is, if none is in this one."""
        topic = '/' + self.record.profile.topics['pose'].lstrip('/')
        there = sorted(name.removesuffix(topic) for name, _ in self.get_topic_names_and_types()
                       if name.endswith(topic) and self.count_publishers(name))
        return [] if self.get_namespace().rstrip('/') in there else there

    def _marker_keeper(self, topic: str) -> Keep:
        def keep(message: Any, info: Any) -> None:
            for marker in getattr(message, 'markers', [message]):
                self.record.markers.append(MarkerHeard(info['source_timestamp'], topic, marker))
        return keep

    def _transform_keeper(self, static: bool) -> Keep:
        def keep(message: TFMessage, info: Any) -> None:
            for transform in message.transforms:
                self.record.add_transform(
                    info['source_timestamp'], info['publication_sequence_number'] or 0, transform,
                    static)
        return keep

    # ------------------------------------------------------------------- what a user would do

    def send_goal(self, x: float, y: float) -> None:
        """Send the robot to a point of the world (m)."""
        goal = PoseStamped()
        goal.header.frame_id = self.record.profile.frames['world']
        goal.header.stamp = self.get_clock().now().to_msg()
        goal.pose.position.x, goal.pose.position.y = x, y
        goal.pose.orientation.w = 1.0
        self._publisher('goal_pose', PoseStamped).publish(goal)

    def hears_goals(self) -> bool:
        """Tell whether somebody hears goals."""
        return self._publisher('goal_pose', PoseStamped).get_subscription_count() > 0

    def has_catcher(self) -> bool:
        """Tell whether somebody else sends goals."""
        return self.count_publishers(self.record.profile.topics['goal_pose']) > (
            'goal_pose' in self._topics_told)

    def send_tilt(self, angle: float) -> None:
        """
        Tilt the platform (rad), with the first field for a number that the topic's type has.

        :raises LookupError: it can't be asked for; the text says why
        """
        topic = self.resolve_topic_name(self.record.profile.topics['tilt'])
        kinds = sorted({info.topic_type for info in self.get_subscriptions_info_by_topic(topic)})
        if not kinds:
            raise LookupError(f'nobody hears {topic}')
        message = load_type(kinds[0])()
        fields = [name for name, kind in message.get_fields_and_field_types().items()
                  if kind in ('double', 'float')]
        if not fields:
            raise LookupError(f'{kinds[0]} has no field for an angle')
        setattr(message, fields[0], float(angle))
        self._publisher('tilt', type(message)).publish(message)

    def _publisher(self, name: str, message_type: Any) -> Publisher:
        """Return the publisher of a topic, made when it is needed first."""
        if name not in self._topics_told:
            self._topics_told[name] = self.create_publisher(
                message_type, self.record.profile.topics[name], 10)
        return self._topics_told[name]

    def client(self, name: str) -> Any:
        """
        Return the client of a service, with the type that the graph has.

        :raises LookupError: there is no such service, or its type is not installed here
        """
        if name not in self._services_asked:
            full = self.resolve_service_name(self.record.profile.services[name])
            kinds = dict(self.get_service_names_and_types()).get(full)
            if not kinds:
                raise LookupError(f'there is no service {full}')
            self._services_asked[name] = self.listener.create_client(load_type(kinds[0]), full)
        return self._services_asked[name]

    def request(self, name: str, place: Sequence[float] | None = None) -> Any:
        """
        Return a request to put the brick somewhere (m), or to drop it.

        :raises LookupError: it can't be asked for; the text says why
        """
        request = self.client(name).srv_type.Request()
        if place is not None and not fill(request, place):
            raise LookupError(f'the request of {name} has no fields x, y and z')
        for field, kind in request.get_fields_and_field_types().items():
            if kind == 'boolean':
                setattr(request, field, True)
        return request

    def has_parameters(self, node: str) -> bool:
        """Tell whether a node can be asked for its parameters."""
        return self._parameter_client(node).service_is_ready()

    def ask_parameter(self, node: str, name: str) -> Any:
        """Ask a node for a number; return the future of the answer."""
        # One by one: who lacks one of several gives none of them.
        return self._parameter_client(node).call_async(GetParameters.Request(names=[name]))

    def _parameter_client(self, node: str) -> Client:
        """Return the client of a node's parameters, made when it is needed first."""
        if node not in self._services_asked:
            self._services_asked[node] = self.create_client(
                GetParameters, f'{node}/get_parameters')
        return self._services_asked[node]


def how_to_hear(latched: bool, reliable: bool = True) -> QoSProfile:
    """Return how to subscribe to what is repeated to who comes late, or to what gets lost."""
    return QoSProfile(
        depth=DEPTH,
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE),
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT)


def full_name(info: TopicEndpointInfo) -> str:
    """Return the full name of the node that has a publisher or subscription."""
    return f'{info.node_namespace.rstrip("/")}/{info.node_name}'
