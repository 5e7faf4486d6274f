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
"""The helpers of the live tests tell the truth: rates, domains, errors, processes."""

import functools
import signal
import sys
import time

from live_graph import graph, LiveGraph, process
import pytest
from rclpy.context import Context
from rclpy.node import Node
from std_msgs.msg import Int64
from std_srvs.srv import Trigger
from turtle_referee.domains import reserved_domain


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


def test_what_is_published_is_recorded_in_order(domain_id):
    with graph(domain_id, functools.partial(Counter, 0.005)) as live:
        counts = live.record('count', Int64)
        live.wait_for(lambda: len(counts.messages) >= 50, 10.0, '50 counts')
    numbers = [message.data for message in counts.messages]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert counts.times == sorted(counts.times)
    assert counts.last.data == numbers[-1]


def test_graphs_in_different_domains_do_not_hear_each_other(domain_id):
    with reserved_domain() as other, graph(domain_id) as here, \
            graph(other, functools.partial(Counter, 0.005)) as there:
        heard, not_heard = there.record('count', Int64), here.record('count', Int64)
        there.wait_for(lambda: len(heard.messages) >= 50, 10.0, '50 counts')
        assert not not_heard.messages


def test_waiting_in_vain_ends_in_time_and_says_for_what(domain_id):
    with graph(domain_id) as live:
        start = time.monotonic()
        with pytest.raises(TimeoutError, match=r'waited 0\.2 s in vain for Godot'):
            live.wait_for(lambda: False, 0.2, 'Godot')
        assert 0.2 <= time.monotonic() - start < 2.0


def test_an_error_in_a_callback_is_raised_in_the_test(domain_id):
    with pytest.raises(ZeroDivisionError, match='as asked'):
        with graph(domain_id, functools.partial(Counter, 0.01)) as live:
            live.call('fail', Trigger)


def test_an_error_in_an_action_is_the_callers(domain_id):
    with graph(domain_id) as live:
        with pytest.raises(KeyError):
            live.do(lambda: {}['missing'])
        assert live.do(lambda: 6 * 7) == 42


def test_a_node_that_cannot_start_leaves_no_graph_behind(domain_id):
    def failing(context):
        contexts.append(context)
        raise OSError('no start')

    contexts = []
    with pytest.raises(OSError, match='no start'):
        LiveGraph(domain_id, failing)
    assert not contexts[0].ok()


PATIENT = """
import signal, sys, threading
end = threading.Event()
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, lambda *_: end.set())
print('ready', flush=True)
end.wait()
sys.exit(int(sys.argv[1]))
"""


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_process_that_ends_when_asked_is_accepted(domain_id, number):
    with process([sys.executable, '-c', PATIENT, '0'], domain_id, stop=number) as running:
        running.wait_for_output('ready', 10.0)
        assert running.running
    assert not running.running


def test_a_process_with_another_status_is_not(domain_id):
    with pytest.raises(AssertionError, match='status 3.*\nready'):
        with process([sys.executable, '-c', PATIENT, '3'], domain_id) as running:
            running.wait_for_output('ready', 10.0)


def test_a_process_that_does_not_end_is_killed_and_reported(domain_id):
    with pytest.raises(TimeoutError, match='did not end'):
        with process([sys.executable, '-c', PATIENT, '0'], domain_id, stop=signal.SIGWINCH,
                     timeout=0.2) as running:
            running.wait_for_output('ready', 10.0)
    assert not running.running


def test_a_process_that_ends_without_a_word_does_not_let_the_test_wait(domain_id):
    with process([sys.executable, '-c', 'print("bye")'], domain_id) as running:
        with pytest.raises(TimeoutError, match=r"(?s)ended without printing 'hello'.*bye"):
            running.wait_for_output('hello', 60.0)
