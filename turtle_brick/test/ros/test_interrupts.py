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
"""Ctrl-C and SIGTERM: when they come, and when they don't."""

import signal

import pytest
from turtle_brick.ros.interrupts import Interrupts


@pytest.fixture(params=Interrupts.NUMBERS)
def number(request):
    """Return each of the signals."""
    return request.param


def test_a_signal_interrupts(interrupts, number):
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(number)


def test_only_the_first_one_counts(interrupts, number):
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(number)
    signal.raise_signal(signal.SIGINT)
    with interrupts.held():
        signal.raise_signal(signal.SIGTERM)


def test_it_comes_after_what_must_not_be_disturbed(interrupts, number):
    done = []
    with pytest.raises(KeyboardInterrupt):
        with interrupts.held():
            signal.raise_signal(number)
            with interrupts.held():
                signal.raise_signal(number)
            done.append('all')
    assert done == ['all']
    with interrupts.held():
        pass


def test_an_error_matters_more(interrupts, number):
    with pytest.raises(ZeroDivisionError):
        with interrupts.held():
            signal.raise_signal(number)
            1 / 0
    with pytest.raises(KeyboardInterrupt):
        with interrupts.held():
            pass


def test_none_comes_once_they_are_ignored(interrupts, number):
    interrupts.ignore()
    signal.raise_signal(number)
