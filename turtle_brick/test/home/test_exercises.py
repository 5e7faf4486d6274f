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
"""Apply sample solutions for the exercises to a copy of the package and check their effects."""

import os
from pathlib import Path
import re
import shutil
import subprocess
import sys

import pytest
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


@pytest.fixture
def copy(tmp_path):
    """Return the path to a copy of the package without the tests that start nodes."""
    for name in ('turtle_brick', 'config'):
        shutil.copytree(PACKAGE / name, tmp_path / name)
    for name in ('laws.py', 'core/test_physics.py', 'core/test_physics_laws.py'):
        shutil.copy(PACKAGE / 'test' / name, tmp_path)
    return tmp_path


def replace(path, old, new):
    """Replace text that occurs exactly once in a file."""
    text = path.read_text()
    assert text.count(old) == 1, old
    path.write_text(text.replace(old, new))


def run(copy, *arguments):
    """Run Python in the copy and return the output."""
    env = {**os.environ, 'PYTHONPATH': f'{copy}:{os.environ.get("PYTHONPATH", "")}',
           'PYTEST_DISABLE_PLUGIN_AUTOLOAD': '1'}
    env.pop('AMENT_PREFIX_PATH', None)  # so that the copy does not read the installed turtle.yaml
    env.pop('PYTEST_ADDOPTS', None)
    return subprocess.run([sys.executable, *arguments], cwd=copy, env=env, text=True, check=True,
                          stdout=subprocess.PIPE, timeout=60.0).stdout


def code(page, word):
    """Return the page's only code block that contains a word."""
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
    for change in yaml.safe_load((PACKAGE / 'test/data/bounce.yaml').read_text()):
        replace(copy / 'turtle_brick/physics.py', change['old'], change['new'])
    fastest, slowest = map(float, run(copy, '-c', BOUNCES).split())
    assert fastest == pytest.approx(-0.3 * slowest, rel=0.02)
    run(copy, '-m', 'pytest', '-q', 'test_physics.py', 'test_physics_laws.py')


@pytest.mark.parametrize('fraction, overshoot', [('0.5', '16.4 cm'), ('0.08', '0.0 cm')])
def test_a_controller_without_prediction_overshoots_with_a_high_gain(copy, fraction, overshoot):
    driving = copy / 'turtle_brick/core/driving.py'
    prediction = code('exercises.md', 'self._queue.predict')
    replace(driving, prediction, '        x, y = pose.x, pose.y\n')
    replace(driving, 'APPROACH_FRACTION = 0.5\n', f'APPROACH_FRACTION = {fraction}\n')
    output = run(copy, '-m', 'turtle_brick.tools.lesson', 'queue')
    assert re.search('turtle_robot: predicted pose +(.* cm)', output)[1] == overshoot
    assert overshoot in (PACKAGE / 'doc/exercises.md').read_text()
