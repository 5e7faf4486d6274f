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

from itertools import permutations

import pytest
from turtle_brick.view.catch_status import CatchStatus

WAITING = 'Waiting for a brick to fall'
FALLING = 'The brick is falling'
DRIVING = 'Reachable: driving under the brick'
REASON = 'the robot needs 1 s, 0.009 s too long'
GROUNDED = f'The unreachable brick fell to the ground: {REASON}'
MISSED = 'Missed: the brick fell to the ground'


def record(status, event):
    """Record a decision, a state of the catcher or a state of the brick."""
    if ': ' in event:
        status.on_decision(event)
    elif event in ('waiting', 'approaching', 'carrying', 'tilting', 'leveling'):
        status.catcher_state = event
    else:
        status.on_brick_state(event)


@pytest.mark.parametrize('story', [
    (('hovering', WAITING), ('falling', FALLING), ('reachable: 0.2 s to spare', DRIVING),
     ('approaching', DRIVING), ('riding', 'Caught'), ('carrying', 'Caught: carrying'),
     ('tilting', 'Caught: tilting'), ('leveling', 'Caught'), ('floating', WAITING),
     ('falling', FALLING), ('grounded', WAITING)),
    (('hovering', WAITING), ('falling', FALLING),
     (f'unreachable: {REASON}', f'Unreachable: {REASON}'), ('grounded', GROUNDED),
     ('', WAITING), ('hovering', WAITING), ('falling', FALLING)),
    (('unreachable: the previous brick', WAITING),
     ('falling', 'Unreachable: the previous brick'), ('reachable: 0.2 s to spare', DRIVING),
     ('grounded', MISSED))],
    ids=['caught', 'unreachable', 'joined late'])
def test_status_during_a_fall(story):
    status = CatchStatus()
    assert status.text == WAITING
    for event, text in story:
        record(status, event)
        assert status.text == text
        assert status.is_unreachable == ('nreachable' in text)


@pytest.mark.parametrize(('topics', 'last', 'text'), [
    ((['falling', 'grounded'], [f'unreachable: {REASON}'], ['waiting']), [], GROUNDED),
    ((['falling'], ['reachable: 0.2 s to spare'], ['approaching']), ['grounded'], MISSED),
    ((['falling', 'riding'], ['reachable: 0.2 s to spare'], ['approaching', 'carrying']),
     [], 'Caught: carrying')],
    ids=['unreachable', 'missed', 'caught'])
def test_final_status_does_not_depend_on_the_order_of_topics(topics, last, text):
    """The previous brick was unreachable, and a new brick follows."""
    numbers = [number for number, events in enumerate(topics) for _ in events]
    for order in set(permutations(numbers)):
        queues = [iter(events) for events in topics]
        status = CatchStatus()
        for event in ('falling', 'unreachable: too high', 'grounded', 'hovering',
                      *(next(queues[number]) for number in order), *last):
            record(status, event)
        assert status.text == text
        status.on_brick_state('hovering')
        status.on_brick_state('falling')
        assert status.text == FALLING
