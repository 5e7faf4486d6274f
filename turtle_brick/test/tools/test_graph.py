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

"""The graph in one process: an interrupt costs no node, and leaves nothing behind."""

import signal

import pytest
from rclpy.node import Node
from turtle_brick.tools.graph import Graph
from turtle_referee.spinning import INTERRUPTED, note_interrupts


@pytest.fixture
def signals():
    """Have signals noted, and give them back to whoever had them before."""
    before = note_interrupts()
    yield list(before)
    INTERRUPTED.clear()
    for number, handler in before.items():
        signal.signal(number, handler)


def test_an_interrupt_waits_for_the_end_of_a_piece_of_work(signals, domain_id):
    """Of a callback, and of the making of a node."""
    done = []

    class Interrupted(Node):

        def __init__(self, **options):
            super().__init__('interrupted', **options)
            self.create_timer(0.001, self.work)

        def work(self):
            signal.raise_signal(signals[len(done)])
            done.append(True)

    with Graph(domain_id) as live:
        live.add(Interrupted, parameters=False)
        for number in (1, 2):
            with pytest.raises(KeyboardInterrupt):
                live.spin_until(lambda: False, 20.0, 'never')
            assert len(done) == number
            INTERRUPTED.clear()


def test_what_does_not_come_is_named(domain_id):
    with Graph(domain_id) as live, pytest.raises(TimeoutError, match='a brick: not within 0.1 s'):
        live.spin_until(lambda: False, 0.1, 'a brick')
