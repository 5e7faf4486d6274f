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

"""A node that fetches messages when it needs them."""

from collections.abc import Callable, Iterator
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription


class PollingNode(Node):
    """
    A node that fetches frequent messages, instead of being woken by each of them.

    No executor knows the fetched subscriptions, so they can be destroyed at any time. An
    EventsExecutor may crash when a subscription or publisher of a living node is destroyed, unless
    it has no event callbacks (https://github.com/ros2/rclpy/issues/1644).
    """

    def __init__(self, name: str, **node_options: Any) -> None:
        """
        Fetch nothing yet.

        :param name: of the node
        :param node_options: passed on to rclpy.node.Node
        """
        # First, since Node's constructor uses `subscriptions`.
        self._polled: dict[Subscription, Callable[[Any, dict[str, int]], None]] = {}
        super().__init__(name, **node_options)

    def poll(self, message_type: type, topic: str, hear: Callable[[Any, dict[str, int]], None],
             qos: QoSProfile, raw: bool = False) -> Subscription:
        """
        Subscribe to messages that will be fetched.

        :param message_type: the type of the messages
        :param topic: their topic
        :param hear: called by `fetch` with each message and with its source_timestamp and
            received_timestamp, in ns of the system's clock
        :param qos: how to subscribe; its depth is how many messages wait to be fetched
        :param raw: whether messages stay serialized
        :return: The subscription.
        """
        subscription = self.create_subscription(
            message_type, topic, _ignore, qos, raw=raw,
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False))
        self._polled[subscription] = hear
        return subscription

    def fetch(self) -> None:
        """Hear all messages since the last time, topic by topic."""
        for subscription, hear in self._polled.items():
            with subscription.handle:
                while (taken := subscription.handle.take_message(
                        subscription.msg_type, subscription.raw)) is not None:
                    hear(*taken)

    @property
    def subscriptions(self) -> Iterator[Subscription]:
        """Return the subscriptions that an executor waits for: not those that are fetched."""
        return (one for one in super().subscriptions if one not in self._polled)

    def destroy_subscription(self, subscription: Subscription) -> bool:
        """Destroy a subscription, fetched or not."""
        self._polled.pop(subscription, None)
        return super().destroy_subscription(subscription)


def _ignore(message: Any) -> None:
    """Stand in for the callback of a subscription that is fetched."""
