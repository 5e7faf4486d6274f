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
"""A short slice of the chaos: the graph comes back from what hurts most, and catches."""

from random import Random
import sys

from chaos import Scene
import far
from live_graph import NodeProcess
import pytest


@pytest.fixture
def scene(domain_id):
    """Start what is dealt with as processes of their own, and the robot as one."""
    with Scene(domain_id, Random(10), ('arena', 'catcher')) as scene, \
            NodeProcess([sys.executable, str(far.HERE), '--robot'], domain_id) as robot:
        yield scene
        assert robot.running, robot.output


def test_the_next_brick_is_caught_whoever_died_or_stood_still(scene):
    """The catcher is killed while it carries a brick, the arena frozen; then all is fired at."""
    scene.look()
    scene.recover()
    scene.go_to('carrying')
    scene.deal('catcher', None)
    scene.deal('arena', 0.3)
    scene.stand_fire(100)
