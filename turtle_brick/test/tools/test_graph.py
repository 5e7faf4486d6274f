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
"""A graph that is interrupted while it comes up."""

import builtins
import signal

import pytest
from rclpy.node import Node
from turtle_brick.tools import graph
from turtle_brick.tools.graph import Graph


class Finalized:
    """Interrupts the process when it is let go: Python prints and forgets what is raised there."""

    def __del__(self):
        """Press Ctrl-C."""
        signal.raise_signal(signal.SIGINT)


class Interrupted(Node):
    """A node that is interrupted while it is made."""

    def __init__(self, **node_options):
        """Make the node."""
        super().__init__('interrupted', **node_options)
        Finalized()
        self.is_made = True


@pytest.fixture
def live(domain_id, interrupts, monkeypatch):
    """Return a graph in a process whose signals are handled as those of the tools."""
    monkeypatch.setattr(graph, 'INTERRUPTS', interrupts)
    with Graph(domain_id) as live:
        yield live


def test_ctrl_c_waits_until_a_node_is_made(live):
    with pytest.raises(KeyboardInterrupt):
        live.add(Interrupted, parameters=False)
    node, = live.nodes
    assert node.is_made


@pytest.mark.parametrize('name, module', [
    ('robot', 'turtle_robot'), ('arena', 'arena'), ('catcher', 'catcher')])
def test_ctrl_c_waits_until_a_module_is_imported(live, monkeypatch, name, module):
    def importing(imported, *rest):
        if imported == f'turtle_brick.{module}':
            Finalized()
        return real(imported, *rest)

    real = builtins.__import__
    monkeypatch.setattr(builtins, '__import__', importing)
    with pytest.raises(KeyboardInterrupt):
        getattr(live, f'add_{name}')()
    assert live.nodes == []
