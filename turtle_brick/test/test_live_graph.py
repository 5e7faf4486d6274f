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
import sys

from live_graph import graph, process
import pytest
from rclpy.context import Context
from rclpy.node import Node
from std_msgs.msg import Int64
from std_srvs.srv import Trigger
from turtle_referee.record import rate


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
    for begin in (0.0, 0.4, 1.5, 2.8):
        late = [max(time, begin + 0.2) if time >= begin else time for time in times]
        assert rate(late) == pytest.approx(100.0, rel=0.001)
    assert rate([time for number, time in enumerate(times) if number % 50]) == pytest.approx(
        98.0, rel=0.002)
