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
from turtle_brick.physics import Phase
from turtle_brick.view.account import Account

WAITING = 'Waiting for a brick to fall'
BRICK = (7.5, 7.0)
"""Where the brick is, on the ground below it (m)."""


def phase(phase):
    """Return the event that the brick does something."""
    return lambda account: account.see_phase(phase)


def goal(x, y):
    """Return the event that the robot is sent somewhere."""
    return lambda account: account.see_goal(x, y, BRICK)


def tilt(angle):
    """Return the event that the platform is tilted."""
    return lambda account: account.see_tilt(angle)


def state(text):
    """Return the event that the catcher says what it does."""
    return lambda account: account.see_state(text)


FALLS = 'The brick falls'
WHY = 'the robot needs 1 s, 0.009 s too early'
CAUGHT = ((phase(Phase.HOVERING), WAITING), (phase(Phase.FALLING), FALLS),
          (goal(7.54, 7.0), 'Reachable: driving under the brick'), (phase(Phase.RIDING), 'Caught'),
          (goal(5.54, 5.5), 'Caught: carrying it to (5.54, 5.50)'),
          (tilt(0.3), 'Tipping the brick off'), (phase(Phase.FLOATING), 'Tipped off'),
          (tilt(0.001), WAITING), (tilt(0.3), 'Platform tilted'))
REFUSED = ((phase(Phase.HOVERING), WAITING), (phase(Phase.FALLING), FALLS),
           (Account.see_unreachable, 'Unreachable'),
           (phase(Phase.GROUNDED), 'Unreachable, it fell to the ground'),
           (state(f'unreachable: {WHY}'), f'Unreachable, it fell to the ground: {WHY}'),
           (phase(Phase.HOVERING), WAITING), (phase(Phase.FALLING), FALLS))
IGNORED = ((phase(Phase.FALLING), FALLS), (goal(7.5, 7.06), FALLS),
           (phase(Phase.GROUNDED), WAITING), (goal(*BRICK), WAITING),
           (tilt(-0.002), 'Platform tilted'))
MISSED = ((goal(9.0, 9.0), WAITING), (phase(Phase.FALLING), FALLS),
          (goal(*BRICK), 'Reachable: driving under the brick'),
          (phase(Phase.FALLING), 'Reachable: driving under the brick'),
          (phase(Phase.GROUNDED), 'Missed: it fell to the ground'),
          (phase(Phase.HOVERING), WAITING), (phase(Phase.FALLING), FALLS), (phase(None), WAITING))
JOINED_LATE = ((phase(Phase.FLOATING), WAITING), (tilt(0.3), 'Platform tilted'),
               (state('unreachable: of the brick before'), 'Platform tilted'),
               (phase(Phase.HOVERING), 'Platform tilted'), (tilt(0.0), WAITING),
               (state('unreachable: of the brick before'), WAITING),
               (phase(Phase.FALLING), 'Unreachable: of the brick before'),
               (state('approaching'), 'Reachable: driving under the brick'))


@pytest.mark.parametrize('story', [CAUGHT, REFUSED, IGNORED, MISSED, JOINED_LATE],
                         ids=['caught', 'refused', 'ignored', 'missed', 'joined late'])
def test_a_fall_is_told_as_it_goes(story):
    account = Account()
    assert account.sentence() == WAITING
    for event, said in story:
        event(account)
        assert account.sentence() == said
        assert account.alarm == said.startswith('Unreachable')


def orders(*topics):
    """Yield all orders in which the events of some topics may come, each topic's in its own."""
    numbers = [number for number, events in enumerate(topics) for _ in events]
    for order in set(permutations(numbers)):
        coming = [iter(events) for events in topics]
        yield [next(coming[number]) for number in order]


@pytest.mark.parametrize(('topics', 'states', 'then', 'said'), [
    ([[phase(Phase.FALLING), phase(Phase.GROUNDED)], [Account.see_unreachable]],
     [f'unreachable: {WHY}'], [], 'Unreachable, it fell to the ground'),
    ([[phase(Phase.FALLING)], [goal(*BRICK)], [tilt(0.0)]],
     ['approaching'], [phase(Phase.GROUNDED)], 'Missed: it fell to the ground'),
    ([[phase(Phase.FALLING), phase(Phase.RIDING)], [goal(*BRICK), goal(5.54, 5.54)]],
     ['approaching', 'carrying'], [], 'Caught: carrying it to (5.54, 5.54)')],
    ids=['unreachable', 'missed', 'caught'])
def test_in_whatever_order_topics_come_the_end_is_told_right(topics, states, then, said):
    """Also of a brick that comes after one that was refused."""
    beginning = (phase(Phase.HOVERING), Account.see_unreachable, phase(Phase.FALLING),
                 phase(Phase.GROUNDED), phase(Phase.HOVERING))
    with_state = [state(text) for text in states]
    for heard, why in ((topics, ''), ([*topics, with_state], f': {WHY}' * (WHY in states[0]))):
        for events in orders(*heard):
            account = Account()
            for event in (*beginning, *events, *then):
                event(account)
            assert account.sentence() == said + why
            account.see_phase(Phase.HOVERING)
            account.see_phase(Phase.FALLING)
            assert account.sentence() == FALLS
