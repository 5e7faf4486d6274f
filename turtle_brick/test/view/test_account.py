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

WAITING, FALLS = 'Waiting for a brick to fall', 'The brick falls'
UNREACHABLE = 'the word on catcher_marker'
WHY = 'the robot needs 1 s, 0.009 s too early'


def tell(account, event):
    """Tell an account what the brick does, what the catcher does, or that it says UNREACHABLE."""
    if event == UNREACHABLE:
        account.see_unreachable()
    elif isinstance(event, str):
        account.see_state(event)
    else:
        account.see_phase(event)


@pytest.mark.parametrize('story', [
    ((Phase.HOVERING, WAITING), (Phase.FALLING, FALLS),
     ('approaching', 'Reachable: driving under the brick'), (Phase.RIDING, 'Caught'),
     ('carrying', 'Caught: carrying'), ('tilting', 'Caught: tilting'), ('leveling', 'Caught'),
     (Phase.FLOATING, WAITING), (Phase.FALLING, FALLS), (Phase.GROUNDED, WAITING)),
    ((Phase.HOVERING, WAITING), (Phase.FALLING, FALLS), (UNREACHABLE, 'Unreachable'),
     (Phase.GROUNDED, 'Unreachable, it fell to the ground'),
     (f'unreachable: {WHY}', f'Unreachable, it fell to the ground: {WHY}'),
     (None, WAITING), (Phase.HOVERING, WAITING), (Phase.FALLING, FALLS)),
    (('unreachable: of the brick before', WAITING), (Phase.FALLING,
     'Unreachable: of the brick before'), ('approaching', 'Reachable: driving under the brick'),
     (Phase.GROUNDED, 'Missed: it fell to the ground'))],
    ids=['caught', 'refused', 'joined late'])
def test_a_fall_is_told_as_it_goes(story):
    account = Account()
    assert account.sentence() == WAITING
    for event, said in story:
        tell(account, event)
        assert account.sentence() == said
        assert account.alarm == said.startswith('Unreachable')


@pytest.mark.parametrize(('topics', 'then', 'said'), [
    (([Phase.FALLING, Phase.GROUNDED], [UNREACHABLE]), [], 'Unreachable, it fell to the ground'),
    (([Phase.FALLING, Phase.GROUNDED], [UNREACHABLE], [f'unreachable: {WHY}']), [],
     f'Unreachable, it fell to the ground: {WHY}'),
    (([Phase.FALLING], ['approaching']), [Phase.GROUNDED], 'Missed: it fell to the ground'),
    (([Phase.FALLING, Phase.RIDING], ['approaching', 'carrying']), [], 'Caught: carrying')],
    ids=['unreachable', 'unreachable and why', 'missed', 'caught'])
def test_in_whatever_order_topics_come_the_end_is_told_right(topics, then, said):
    """Also of a brick that comes after one that was refused."""
    numbers = [number for number, events in enumerate(topics) for _ in events]
    for order in set(permutations(numbers)):
        coming = [iter(events) for events in topics]
        account = Account()
        for event in (Phase.FALLING, 'unreachable: too high', Phase.GROUNDED, Phase.HOVERING,
                      *(next(coming[number]) for number in order), *then):
            tell(account, event)
        assert account.sentence() == said
        account.see_phase(Phase.HOVERING)
        account.see_phase(Phase.FALLING)
        assert account.sentence() == FALLS
