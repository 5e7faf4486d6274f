# SPDX-License-Identifier: Apache-2.0

"""Test the helpers for live tests."""

import sys

from live_graph import LiveGraph, process, TIMEOUT
from live_nodes import Recording
import pytest
from turtle_graph.client.record import message_rate


def test_node_errors_and_timeouts_fail_the_test(domain_id):
    with pytest.raises(ZeroDivisionError), LiveGraph(domain_id) as live:
        with pytest.raises(TimeoutError, match='nothing'):
            live.wait_for(lambda: False, 0.1, 'nothing')
        live.listener.create_timer(0.01, lambda: 1 / 0)
        live.wait_for(lambda: False, TIMEOUT, 'an error')


SIGNAL_HANDLER = """
import signal, sys
signal.signal(signal.SIGINT, lambda *_: sys.exit(int(sys.argv[1])))
print('ready', flush=True)
signal.pause()
"""


def test_process_must_end_with_status_0(domain_id):
    with process([sys.executable, '-c', SIGNAL_HANDLER, '0'], domain_id) as running:
        running.wait_for_output('ready', TIMEOUT)
    with pytest.raises(AssertionError, match='status 3.*\nready'):
        with process([sys.executable, '-c', SIGNAL_HANDLER, '3'], domain_id) as running:
            running.wait_for_output('ready', TIMEOUT)


def rate_of_recording(times):
    recording = Recording()
    recording.times = times
    return recording.rate()


@pytest.mark.parametrize('rate', [message_rate, rate_of_recording])
def test_rate_ignores_late_messages_but_not_missing_ones(rate):
    times = [number * 0.01 for number in range(300)]
    for begin in (0.0, 0.4, 1.5, 2.8):
        late = [max(time, begin + 0.2) if time >= begin else time for time in times]
        assert rate(late) == pytest.approx(100.0, rel=0.001)
    kept = [time for number, time in enumerate(times) if number % 50]
    assert rate(kept) == pytest.approx(98.0, rel=0.002)


def test_messages_in_the_wrong_order_have_no_rate():
    assert message_rate([2.0, 1.0, 1.0, 1.0, 1.0, 1.0, 2.1]) == 0.0
