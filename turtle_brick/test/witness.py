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

"""What the tests of the live graph share: a node that listens, and the measure of a rate."""

from time import monotonic

from rclpy.node import Node
from rclpy.qos import QoSProfile
from tf2_msgs.msg import TFMessage
from turtle_referee import record


class Witness(Node):
    """Listen to topics and call services, beside the nodes under test."""

    def __init__(self, **node_options):
        """Listen to nothing yet."""
        super().__init__('witness', **node_options)

    def record(self, message_type, topic, **qos):
        """
        Record a topic from now on.

        :param message_type: its type
        :param topic: its name
        :param qos: what differs from reliable, volatile and a depth of 1000
        :return: A growing list of (time of receipt in s, message).
        """
        received = []
        self.create_subscription(
            message_type, topic, lambda message: received.append((monotonic(), message)),
            QoSProfile(**{'depth': 1000, **qos}))
        return received

    def record_transforms(self, child, topic='/tf', **qos):
        """
        Record the transforms to a frame from now on.

        :param child: the frame
        :param topic: /tf or /tf_static
        :param qos: as for `record`
        :return: A growing list of (time of receipt in s, TransformStamped).
        """
        received = []

        def sort(message):
            received.extend((monotonic(), transform) for transform in message.transforms
                            if transform.child_frame_id == child)

        self.create_subscription(TFMessage, topic, sort, QoSProfile(**{'depth': 1000, **qos}))
        return received


def rate(received):
    """Measure a recording, (time of receipt in s, message) in order, in Hz."""
    return record.rate([time for time, _ in received])


def measure(graph, recordings, seconds, warm_up=20):
    """
    Measure the rates of recordings while a graph works.

    :param graph: the graph, spun here
    :param recordings: lists that grow, as `Witness.record` returns them
    :param seconds: how long to measure (s)
    :param warm_up: messages on each that come first and don't count
    :return: The rates (Hz), in the recordings' order.
    """
    for recording in recordings:
        recording.clear()
    graph.spin_until(lambda: all(len(recording) >= warm_up for recording in recordings), 10.0,
                     f'{warm_up} messages on each topic')
    for recording in recordings:
        recording.clear()
    graph.spin_for(seconds)
    return [rate(recording) for recording in recordings]
