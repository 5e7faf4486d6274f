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
"""Apply sample solutions for the exercises to a copy of the package and check the effects."""

from importlib.util import module_from_spec, spec_from_file_location
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
from types import SimpleNamespace

from geometry_msgs.msg import Point
from graph_client.record import ReceivedMarker
from live_graph import graph, TIMEOUT
import pytest
from std_srvs.srv import Trigger
from turtle_brick.physics import Phase
from turtle_brick_interfaces.srv import Place
from turtle_referee.rules.arena_rules import brick_markers
import yaml

PACKAGE = Path(__file__).resolve().parents[2]
BOUNCES = """
from turtle_brick.core.parameters import load
from turtle_brick.physics import Phase, World
world = World.from_parameters(load())
world.release()
speeds = [0.0]
while world.phase is not Phase.GROUNDED:
    before = world.brick[2]
    world.step()
    speeds.append((world.brick[2] - before) * 250)
print(max(speeds), min(speeds))
"""

SECOND_ARENA = ('-p frame:=brick2 -r __node:=arena2 -r place:=place2 -r drop:=drop2 '
                '-r brick_state:=brick_state2 -r brick_marker:=brick_marker2')


@pytest.fixture
def copy(tmp_path):
    """Copy the package except for the tests that start nodes, and return the path to the copy."""
    for name in ('turtle_brick', 'config'):
        shutil.copytree(PACKAGE / name, tmp_path / name)
    for name in ('laws.py', 'core/test_physics.py', 'core/test_physics_laws.py'):
        shutil.copy(PACKAGE / 'test' / name, tmp_path)
    return tmp_path


def replace(path, old, new):
    text = path.read_text()
    assert text.count(old) == 1, old
    path.write_text(text.replace(old, new))


def apply(solution, path):
    """Apply the replacements from a solution file in test/data to a given file."""
    for change in yaml.safe_load((PACKAGE / 'test/data' / solution).read_text()):
        replace(path, change['old'], change['new'])


def run(copy, *arguments):
    env = {**os.environ, 'PYTHONPATH': f'{copy}:{os.environ.get("PYTHONPATH", "")}',
           'PYTEST_DISABLE_PLUGIN_AUTOLOAD': '1'}
    env.pop('AMENT_PREFIX_PATH', None)  # Hide the installed parameters from the copied package.
    env.pop('PYTEST_ADDOPTS', None)
    return subprocess.run([sys.executable, *arguments], cwd=copy, env=env, text=True, check=True,
                          stdout=subprocess.PIPE, timeout=60.0).stdout


def code(page, word):
    """Return the only code block that contains a given word on a page."""
    text = (PACKAGE / 'doc' / page).read_text()
    block, = [block for block in re.findall('```(?:python|yaml)\n(.*?)```', text, re.S)
              if word in block]
    return block


def test_a_bouncing_brick_passes_the_tests_of_the_physics(copy):
    parameters = copy / 'turtle_brick/core/parameters.py'
    for path, neighbor, word in (
            (copy / 'config/turtle.yaml', '    wall_height: ', 'bounce: 0.3'),
            (parameters, "    'wall_height': ", 'ParameterRule'),
            (parameters, '    wall_height: float', 'bounce: float')):
        replace(path, neighbor, code('changing.md', word) + neighbor)
    apply('bounce.yaml', copy / 'turtle_brick/physics.py')
    fastest, slowest = map(float, run(copy, '-c', BOUNCES).split())
    assert fastest == pytest.approx(-0.3 * slowest, rel=0.02)
    run(copy, '-m', 'pytest', '-q', 'test_physics.py', 'test_physics_laws.py')


def test_a_second_brick_lands_on_the_waiting_robot(copy, domain_id):
    """The catcher ignores the second brick, but the referee confuses the two markers."""
    apply('second_brick.yaml', copy / 'turtle_brick/arena.py')
    spec = spec_from_file_location('arena2', copy / 'turtle_brick/arena.py')
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    above_robot = Place.Request(location=Point(x=5.5, y=5.5, z=3.0))
    with graph(domain_id, quiet=True) as live:
        live.add_turtlesim()
        live.add_robot_state_publisher()
        live.add_robot()
        catcher = live.add_catcher().catcher
        first = live.add(module.Arena)
        second = live.add(module.Arena, *SECOND_ARENA.split())
        transforms = live.record_transforms('brick2')
        assert live.call('place2', Place, above_robot).success
        live.wait_for(lambda: second.world.platform, TIMEOUT, 'the platform')
        assert live.call('drop2', Trigger).success
        live.wait_for(lambda: second.phase is Phase.RIDING, TIMEOUT, 'the second brick rides')
        live.wait_for(lambda: transforms.last.header.frame_id == 'platform', TIMEOUT, 'brick2')
        assert catcher.decision is None and first.phase is Phase.HOVERING
        for topic in ('brick_state', 'brick_state2', 'brick_marker', 'brick_marker2'):
            assert live.listener.count_publishers(topic) == 1
    marker = module.brick_marker(Phase.RIDING, (0.4, 0.2, 0.1), 'brick2')
    received = [ReceivedMarker(0, 'brick_marker2', marker)]
    assert brick_markers(SimpleNamespace(markers=received)) == received


@pytest.mark.parametrize('fraction, overshoot', [('0.5', '16.4 cm'), ('0.08', '0.0 cm')])
def test_a_controller_without_prediction_overshoots_with_a_high_gain(copy, fraction, overshoot):
    driving = copy / 'turtle_brick/core/driving.py'
    prediction = code('exercises.md', 'self._queue.predict')
    replace(driving, prediction, '        x, y = pose.x, pose.y\n')
    replace(driving, 'APPROACH_FRACTION = 0.5\n', f'APPROACH_FRACTION = {fraction}\n')
    output = run(copy, '-m', 'turtle_brick.tools.lesson', 'queue')
    assert re.search('turtle_robot: predicted pose +(.* cm)', output)[1] == overshoot
    assert overshoot in (PACKAGE / 'doc/exercises.md').read_text()
