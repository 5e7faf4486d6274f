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

from collections import deque
from time import monotonic

from rclpy.node import Node

PERIOD = 10.0
"""Time (s) in which the number of warnings of a kind is limited."""

LIMIT = 5
"""How many warnings of a kind there may be in that time."""


class Warner:
    """
    Log warnings, a limited number of each kind: bad messages may come by the thousand.

    The logger's own `throttle_duration_sec` takes a quarter of a millisecond per call, to look up
    the caller: a thousand bad messages would delay a node.
    """

    def __init__(self, node: Node) -> None:
        """Begin without any warning of a node."""
        self._logger = node.get_logger()
        self._given: dict[str, deque[float]] = {}

    def warn(self, kind: str, sentence: str) -> None:
        """Log a warning, unless the limit of its kind is reached."""
        now = monotonic()
        given = self._given.setdefault(kind, deque(maxlen=LIMIT))
        if len(given) < LIMIT or now - given[0] > PERIOD:
            given.append(now)
            self._logger.warning(sentence)
