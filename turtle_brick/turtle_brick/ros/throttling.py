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

"""Warnings, limited in number."""

from time import monotonic

from rclpy.node import Node


class Warner:
    """
    Log warnings, a limited number of each kind per PERIOD: bad messages may come by the thousand.

    The logger's own `throttle_duration_sec` takes a quarter of a millisecond per call, to look up
    the caller: a thousand bad messages would delay a node.
    """

    PERIOD = 10.0
    """Time (s) in which the number of warnings of a kind is limited."""

    def __init__(self, node: Node, limit: int = 1) -> None:
        """
        Begin without any warning.

        :param node: the node that warns
        :param limit: number of warnings of a kind in a period
        """
        self._node = node
        self._limit = limit
        self._given: dict[str, list[float]] = {}

    def warn(self, kind: str, sentence: str) -> None:
        """Log a warning, unless the limit of its kind is reached."""
        now = monotonic()
        given = self._given.setdefault(kind, [])
        while given and now - given[0] > self.PERIOD:
            del given[0]
        if len(given) < self._limit:
            given.append(now)
            self._node.get_logger().warning(sentence)
