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
"""Domains are reserved exclusively and are not used by any other node."""

from live_graph import LiveGraph
import pytest
from turtle_referee.graph_client.domains import DomainError, is_empty, reserved_domain


def test_the_first_free_candidate_is_reserved():
    with reserved_domain() as first, reserved_domain() as second:
        assert first != second and {first, second} <= set(range(1, 101))
        with pytest.raises(DomainError, match='in use'), reserved_domain([first, second]):
            pass
    with reserved_domain([first, second]) as reserved:
        assert reserved == first


def test_a_domain_with_a_node_is_not_empty():
    """The first of two nodes leaves, and the second one remains."""
    with reserved_domain() as free:
        pass
    first, second = LiveGraph(free), LiveGraph(free)
    first.close()
    with pytest.raises(DomainError, match='in use'), reserved_domain([free]):
        pass
    second.close()
    assert is_empty(free)
