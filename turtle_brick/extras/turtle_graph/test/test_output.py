# SPDX-License-Identifier: Apache-2.0
"""Test that the output of other programs is bounded and cannot change the terminal."""

import psutil
import pytest
from turtle_graph.client.launch_errors import crashes
from turtle_graph.client.processes import MAX_SIZE, Output, printable, Process

TIMEOUT = 20.0
"""Timeout (s) for an action of another process."""
CRASH = '[arena-1] Traceback (most recent call last):\n[arena-1]   x\n[arena-1] KeyError: 1\n'
DIED = "[ERROR] [arena-1]: process has died [pid 7, exit code 1, cmd '/lib/arena --ros-args'].\n"


def test_output_is_complete_until_it_is_very_long():
    output = Output()
    assert output.add('[a-1] one\ntwo\n[b-1]') == ['[a-1] one\n', 'two\n']
    assert output.add(' three\n?') == ['[b-1] three\n']
    assert str(output) == '[a-1] one\ntwo\n[b-1] three\n?'


@pytest.mark.parametrize('flood', ('[catcher-2] falling\n', 'x\n', 'x'))
def test_endless_output_is_bounded_and_hides_no_crash(flood):
    output = Output()
    for text in (CRASH, DIED, *[flood * 10_000] * 30):
        output.add(text)
    assert len(str(output)) < 2 * MAX_SIZE
    assert crashes(str(output)) == ['arena crashed: KeyError: 1']


def test_many_sources_of_output_share_one_limit():
    output = Output()
    for number in range(100_000):
        output.add(f'[node-{number}] {"x" * 100}\n')
    assert len(str(output)) < 2 * MAX_SIZE


@pytest.mark.parametrize('text, expected', (
    ('\x1b[31;1mred\x1b[0m\tä\n', 'red\tä\n'),
    ('\x1b]0;title\x07\x1b]8;;x\x1b\\text', 'text'),
    ('a\rb\x08\x9b2Jc\x1b', 'ab2Jc')))
def test_control_characters_are_removed(text, expected):
    assert printable(text) == expected


def test_a_program_with_an_empty_environment_ends_with_the_others():
    # The shell exits before the program that it has started.
    with Process(['bash', '-c', 'env -i sleep 100 & echo process $!']) as process:
        child = psutil.Process(int(process.wait_for_output(r'process (\d+)', TIMEOUT)[1]))
    child.wait(TIMEOUT)  # Shorter than the sleep.
