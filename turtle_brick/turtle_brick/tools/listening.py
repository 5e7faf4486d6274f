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

"""What the benchmark hears of the graph, and how it drops a brick into it."""

from collections.abc import Iterator
from typing import Any

from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from turtle_brick.view.polling import PollingNode
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_interfaces.srv import Place
from turtlesim.msg import Pose
from visualization_msgs.msg import Marker

FETCH_PERIOD = 0.1
"""Time (s) after which what is listened to is fetched."""


class Recording:
    """Messages of a topic, as they were sent, and when."""

    def __init__(self, message_type: type) -> None:
        """Begin with none."""
        self._type = message_type
        self.published: list[int] = []
        self.received: list[int] = []
        self._data: list[bytes] = []

    def take(self, data: bytes, info: dict[str, int]) -> None:
        """Keep a message, with what rmw knows of its way."""
        self.published.append(info['source_timestamp'])
        self.received.append(info['received_timestamp'])
        self._data.append(data)

    def messages(self) -> Iterator[tuple[int, Any]]:
        """Yield the messages, each with the instant of its publication (ns)."""
        for published, data in zip(self.published, self._data):
            yield published, deserialize_message(data, self._type)


class Observer(PollingNode):
    """What places and drops bricks, and what listens when it is to."""

    TOPICS = {
        'cmd_vel': (Twist, 'turtle1/cmd_vel'),
        'odom': (Odometry, 'odom'),
        'joint_states': (JointState, 'joint_states'),
        'tf': (TFMessage, '/tf'),
        'pose': (Pose, 'turtle1/pose'),
        'goal': (PoseStamped, 'goal_pose'),
    }

    def __init__(self, **node_options: Any) -> None:
        """Listen to nothing but what tells how drops end: the platform's angle, the verdict."""
        super().__init__('benchmark', **node_options)
        self.place_client = self.create_client(Place, 'place')
        self.drop_client = self.create_client(Trigger, 'drop')
        self.create_subscription(Tilt, 'tilt', self._on_tilt, 10)
        self.create_subscription(Marker, 'catcher_marker', self._on_marker, 10)
        self.create_timer(FETCH_PERIOD, self.fetch)
        self._listening: list[Subscription] = []
        self.tilted = False
        self.levelled = False
        self.refused = False

    def is_complete(self) -> bool:
        """Tell whether every node of a graph has all that it publishes and hears."""
        return (self.count_publishers('/tf') == 3
                and self.count_subscribers('/tf') == 2
                and all(self.count_publishers(topic) == 1 for topic in (
                    'odom', 'turtle1/pose', 'turtle1/cmd_vel', 'joint_states', 'goal_pose'))
                and all(self.count_subscribers(topic) == 1 for topic in (
                    'turtle1/pose', 'turtle1/cmd_vel', 'joint_states', 'goal_pose'))
                and self.place_client.service_is_ready() and self.drop_client.service_is_ready())

    def is_alone(self) -> bool:
        """Tell whether no other node is left."""
        return self.count_publishers('/tf') == 0 and self.count_subscribers('/tf') == 0

    def record(self) -> dict[str, Recording]:
        """Listen to everything from now on."""
        recordings = {}
        for name, (message_type, topic) in self.TOPICS.items():
            recordings[name] = Recording(message_type)
            self._listening.append(self.poll(
                message_type, topic, recordings[name].take, QoSProfile(depth=2000), raw=True))
        return recordings

    def expect_drop(self) -> None:
        """Forget how the last drop ended."""
        self.tilted = self.levelled = self.refused = False

    def stop_listening(self) -> None:
        """Listen to nothing of it again."""
        self.fetch()
        for subscription in self._listening:
            self.destroy_subscription(subscription)
        self._listening.clear()

    def _on_tilt(self, message: Tilt) -> None:
        """Note that the platform has been tilted, or has come back."""
        if message.angle > 0.0:
            self.tilted = True
        elif self.tilted:
            self.levelled = True

    def _on_marker(self, message: Marker) -> None:
        """Note that the brick has been called unreachable."""
        self.refused = True
