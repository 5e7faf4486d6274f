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
"""Run chaos.py and far.py with short scenarios."""

from pathlib import Path
from random import Random
import subprocess
import sys

from chaos import Scene
from live_graph import NodeProcess
import pytest

FAR = Path(__file__).parent / 'far.py'


def missing_permission() -> str:
    try:
        with open('/dev/net/tun', 'r+b', buffering=0):
            pass
        subprocess.run(['unshare', '--user', '--map-root-user', '--net', 'true'], check=True,
                       capture_output=True)
    except (OSError, subprocess.CalledProcessError) as error:
        return f'network namespaces are not available: {error}'
    return ''


MISSING = missing_permission()


def test_the_next_brick_is_caught_after_kills_freezes_and_random_messages(domain_id):
    """The catcher is killed while the robot carries a brick. Then the arena is frozen."""
    with Scene(domain_id, Random(10), ('arena', 'catcher')) as scene:
        scene.add_turtlesim()
        scene.add_robot_state_publisher()
        scene.add_robot()
        scene.recover()
        scene.go_to('carrying')
        scene.inject('catcher', None)
        scene.inject('arena', 0.3)
        scene.check_messages(100)


@pytest.mark.skipif(MISSING != '', reason=MISSING)
def test_bricks_are_caught_over_slow_links(domain_id):
    """Every brick that the catcher reports as reachable is caught."""
    options = ['--delay', '30', '--jitter', '5', '--latency', '0.2', '--drops', '1']
    with NodeProcess([sys.executable, str(FAR), *options], domain_id) as far:
        assert far.wait(900.0) == 0, far.output
        assert '| 30 ± 5 ms | 0.2 s | ' in far.output, far.output
