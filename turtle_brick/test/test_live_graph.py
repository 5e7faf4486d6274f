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

"""The harness of the live tests: what it hears, how it waits, and that it hides nothing."""

import functools
import signal
import sys

from live_graph import graph, process
import pytest
from rclpy.context import Context
from rclpy.node import Node
from std_msgs.msg import Int64
from std_srvs.srv import Trigger
from turtle_referee.record import rate
from turtle_referee.spinning import INTERRUPTED, note_interrupts


class Counter(Node):
    """Counts on the topic `count`, and fails when its service is called."""

    def __init__(self, period: float, *, context: Context) -> None:
        super().__init__('counter', context=context)
        self.count = 0
        self.publisher = self.create_publisher(Int64, 'count', 10)
        self.create_service(Trigger, 'fail', self.fail)
        self.create_timer(period, self.tick)

    def tick(self) -> None:
        self.publisher.publish(Int64(data=self.count))
        self.count += 1

    def fail(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        raise ZeroDivisionError('as asked')


def test_what_is_published_is_recorded_in_order_and_an_error_is_the_tests(domain_id):
    with pytest.raises(ZeroDivisionError, match='as asked'):
        with graph(domain_id, functools.partial(Counter, 0.005)) as live:
            counts = live.record('count', Int64)
            # A plain timer leaves out what a busy machine keeps it from.
            assert 0.0 < live.rates([counts], 100)[0] < 201.0
            numbers = [message.data for message in counts.messages]
            assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
            assert counts.times == sorted(counts.times)
            assert counts.last.data == numbers[-1]
            with pytest.raises(TimeoutError, match='Godot'):
                live.wait_for(lambda: False, 0.1, 'Godot')
            live.call('fail', Trigger)


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

    with graph(domain_id) as live:
        live.add(Interrupted, parameters=False)
        for number in (1, 2):
            with pytest.raises(KeyboardInterrupt):
                live.spin_until(lambda: False, 20.0, 'never')
            assert len(done) == number
            INTERRUPTED.clear()


PATIENT = """
import signal, sys, threading
end = threading.Event()
signal.signal(signal.SIGINT, lambda *_: end.set())
print('ready', flush=True)
end.wait()
sys.exit(int(sys.argv[1]))
"""


def test_a_process_that_ends_when_asked_is_accepted_with_status_0_only(domain_id):
    with process([sys.executable, '-c', PATIENT, '0'], domain_id) as running:
        running.wait_for_output('ready', 10.0)
    assert not running.running
    with pytest.raises(AssertionError, match='status 3.*\nready'):
        with process([sys.executable, '-c', PATIENT, '3'], domain_id) as running:
            running.wait_for_output('ready', 10.0)


def test_a_rate_is_that_of_even_steps_however_late_some_are():
    """All that was to come during a stall comes at its end; what was left out counts."""
    times = [number * 0.01 for number in range(300)]
    assert rate(times) == pytest.approx(100.0)
    for begin in (0.0, 0.4, 1.5, 2.8):
        late = [max(time, begin + 0.2) if time >= begin else time for time in times]
        assert rate(late) == pytest.approx(100.0, rel=0.001)
    assert rate([time for number, time in enumerate(times) if number % 50]) == pytest.approx(
        98.0, rel=0.002)
    assert rate(times[:5]) == 0.0
