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
A node that hears all that a graph says, and asks it for what a user would.

It knows the graph by the names of a profile and reads every type from the graph, so that any
implementation will do. It publishes nothing until it is asked to.
"""

from collections import Counter
from collections.abc import Callable
from importlib import import_module
from time import monotonic, time_ns
from typing import Any

from geometry_msgs.msg import PoseStamped
from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo
from tf2_msgs.msg import TFMessage
from turtle_brick.core.geometry import Vector
from turtle_brick.view.polling import PollingNode
from turtle_referee.names import NUMBERS, Profile
from turtle_referee.record import Ask, Heard, MarkerHeard, Record

FETCH_PERIOD = 0.02
"""Time (s) after which what has come is fetched."""

LOOK_PERIOD = 0.5
"""Time (s) after which new topics are looked for."""

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


def fill(message: Any, place: Vector) -> bool:
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


class Observer(PollingNode):
    """Hear a graph, and ask it for what a user would."""

    def __init__(self, profile: Profile | None = None, name: str = 'referee',
                 **node_options: Any) -> None:
        """
        Begin to listen.

        :param profile: what things are called; as in the assignment if None
        :param name: of the node
        :param node_options: passed on to rclpy.node.Node
        """
        super().__init__(name, **node_options)
        self.record = Record(profile or Profile())
        self.record.namespace = self.get_namespace()
        self.on_news: Callable[[], None] = lambda: None
        """Called whenever what has come was fetched."""
        self._heard_topics: set[str] = set()
        self._topics_told: dict[str, Publisher] = {}
        self._services_asked: dict[str, Client] = {}
        self._looked_at = 0.0
        for topic, static in (('/tf', False), ('/tf_static', True)):
            qos = QoSProfile(depth=2000, durability=(
                DurabilityPolicy.TRANSIENT_LOCAL if static else DurabilityPolicy.VOLATILE))
            self.poll(TFMessage, topic, self._transform_keeper(static), qos)
        self.create_timer(FETCH_PERIOD, self.update)

    def update(self) -> None:
        """Fetch what has come, and look for new topics now and then."""
        if monotonic() - self._looked_at > LOOK_PERIOD:
            self._looked_at = monotonic()
            self.look_around()
        self.fetch()
        self.on_news()

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
            wanted = TYPES.get(name, types)
            usable = [kind for kind in types if kind in wanted]
            if usable and full not in self._heard_topics:
                latched = name == 'robot_description'
                self._listen(full, usable[0], self._keeper(name), latched)
        for topic, types in there.items():
            for kind in MARKER_TYPES:
                if kind in types and topic not in self._heard_topics:
                    infos = self.get_publishers_info_by_topic(topic)
                    latched = all(info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
                                  for info in infos)
                    record.latched[topic] = latched
                    self._listen(topic, kind, self._marker_keeper(topic), latched)

    def _listen(self, topic: str, kind: str, hear: Callable[[Any, dict[str, int]], None],
                latched: bool) -> None:
        """Record a topic from now on."""
        try:
            message_type = load_type(kind)
        except LookupError as error:
            self.note(str(error))
        else:
            # Whoever speaks without repeating what gets lost can't be asked to repeat it.
            reliable = all(info.qos_profile.reliability == ReliabilityPolicy.RELIABLE
                           for info in self.get_publishers_info_by_topic(topic))
            self.poll(message_type, topic, hear, QoSProfile(
                depth=2000,
                durability=(DurabilityPolicy.TRANSIENT_LOCAL if latched
                            else DurabilityPolicy.VOLATILE),
                reliability=(ReliabilityPolicy.RELIABLE if reliable
                             else ReliabilityPolicy.BEST_EFFORT)))
        self._heard_topics.add(topic)

    def doubts(self) -> list[str]:
        """Say what seems to be wrong with where one listens: a sentence for each."""
        found = []
        counts = Counter(self.get_fully_qualified_node_names())
        twice = sorted(name for name, count in counts.items() if count > 1)
        if twice:
            found.append(f'several nodes are called {", ".join(twice)}: do two graphs run here?')
        topic = '/' + self.record.profile.topics['pose'].lstrip('/')
        there = sorted(name.removesuffix(topic) for name, _ in self.get_topic_names_and_types()
                       if name.endswith(topic) and self.count_publishers(name))
        if there and self.get_namespace().rstrip('/') not in there:
            found.append(f'a turtle is in the namespace {there[0] or "/"}: say --namespace '
                         f'{there[0].lstrip("/") or "/"}')
        return found

    def note(self, sentence: str) -> None:
        """Keep what went wrong, once."""
        if sentence not in self.record.notes:
            self.record.notes.append(sentence)

    def _keeper(self, name: str) -> Callable[[Any, dict[str, int]], None]:
        messages = self.record.topics[name]
        return lambda message, info: messages.append(Heard(info['source_timestamp'], message))

    def _marker_keeper(self, topic: str) -> Callable[[Any, dict[str, int]], None]:
        def keep(message: Any, info: dict[str, int]) -> None:
            for marker in getattr(message, 'markers', [message]):
                self.record.markers.append(MarkerHeard(info['source_timestamp'], topic, marker))
        return keep

    def _transform_keeper(self, static: bool) -> Callable[[Any, dict[str, int]], None]:
        def keep(message: TFMessage, info: dict[str, int]) -> None:
            for transform in message.transforms:
                self.record.add_transform(
                    info['source_timestamp'], info['publication_sequence_number'] or 0,
                    transform, static)
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

    def tilt_type(self) -> Any:
        """
        Return the type of the tilt topic, as its hearers have it.

        :raises LookupError: nobody hears it, or the type is not installed here
        """
        topic = self.resolve_topic_name(self.record.profile.topics['tilt'])
        kinds = sorted({info.topic_type for info in self.get_subscriptions_info_by_topic(topic)
                        if full_name(info) != self.get_fully_qualified_name()})
        if not kinds:
            raise LookupError(f'nobody hears {topic}')
        return load_type(kinds[0])

    def send_tilt(self, angle: float) -> None:
        """
        Tilt the platform (rad).

        :raises LookupError: it can't be asked for; the text says why
        """
        message = self.tilt_type()()
        field = angle_field(message)
        if field is None:
            raise LookupError(f'{type(message).__name__} has no field for an angle')
        setattr(message, field, float(angle))
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
            self._services_asked[name] = self.create_client(load_type(kinds[0]), full)
        return self._services_asked[name]

    def request_place(self, place: Vector) -> Any:
        """Return a request to put the brick somewhere (m); LookupError if it has no place."""
        request = self.client('place').srv_type.Request()
        if not fill(request, place):
            raise LookupError('the request of place has no fields x, y and z')
        return request

    def request_drop(self) -> Any:
        """Return a request to drop the brick; LookupError if there is no such service."""
        request = self.client('drop').srv_type.Request()
        for name, kind in request.get_fields_and_field_types().items():
            if kind == 'boolean':
                setattr(request, name, True)
        return request

    def has_parameters(self, node: str) -> bool:
        """Tell whether a node can be asked for its parameters."""
        return self._parameter_client(node).service_is_ready()

    def ask_parameters(self, node: str) -> Any:
        """Ask a node for the numbers; return the future of the answer."""
        return self._parameter_client(node).call_async(
            GetParameters.Request(names=list(NUMBERS)))

    def _parameter_client(self, node: str) -> Client:
        """Return the client of a node's parameters, made when it is needed first."""
        if node not in self._services_asked:
            self._services_asked[node] = self.create_client(
                GetParameters, f'{node}/get_parameters')
        return self._services_asked[node]


def full_name(info: TopicEndpointInfo) -> str:
    """Return the full name of the node that has a publisher or subscription."""
    return f'{info.node_namespace.rstrip("/")}/{info.node_name}'


def angle_field(message: Any) -> str | None:
    """Return the name of a message's first field of a floating-point number, None without one."""
    return next((name for name, kind in message.get_fields_and_field_types().items()
                 if kind in ('double', 'float')), None)


def answer(begin: int, what: Any, response: Any) -> Ask:
    """Return what a service said to a request that was made at an instant (ns)."""
    return Ask(begin, time_ns(), what, True, bool(getattr(response, 'success', True)),
               str(getattr(response, 'message', '')))
