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


CAUGHT = ((phase(Phase.HOVERING), WAITING), (phase(Phase.FALLING), 'The brick falls'),
          (goal(7.54, 7.0), 'Reachable: driving under the brick'), (phase(Phase.RIDING), 'Caught'),
          (goal(5.54, 5.5), 'Caught: carrying it to (5.54, 5.50)'),
          (tilt(0.3), 'Tipping the brick off'), (phase(Phase.FLOATING), 'Tipped off'),
          (tilt(0.001), WAITING))
REFUSED = ((phase(Phase.FALLING), 'The brick falls'),
           (Account.see_unreachable, 'Unreachable'),
           (phase(Phase.GROUNDED), 'Unreachable: it fell to the ground'),
           (phase(Phase.HOVERING), WAITING), (phase(Phase.FALLING), 'The brick falls'))
IGNORED = ((phase(Phase.FALLING), 'The brick falls'), (goal(7.5, 7.06), 'The brick falls'),
           (phase(Phase.GROUNDED), WAITING), (phase(Phase.GROUNDED), WAITING),
           (tilt(-0.002), 'Platform tilted'))
MISSED = ((goal(*BRICK), WAITING), (phase(Phase.FALLING), 'The brick falls'),
          (goal(*BRICK), 'Reachable: driving under the brick'),
          (phase(Phase.FALLING), 'Reachable: driving under the brick'),
          (phase(Phase.GROUNDED), 'Missed: it fell to the ground'),
          (phase(Phase.FALLING), 'The brick falls'), (phase(None), WAITING))


@pytest.mark.parametrize('story', [CAUGHT, REFUSED, IGNORED, MISSED],
                         ids=['caught', 'refused', 'ignored', 'missed'])
def test_a_fall_is_told_as_it_goes(story):
    account = Account()
    assert account.sentence() == WAITING
    for event, said in story:
        event(account)
        assert account.sentence() == said
        assert account.unreachable == said.startswith('Unreachable')
