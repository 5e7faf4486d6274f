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

"""
The lesson's laws hold for other robots too, and its program refuses what cannot be.

For ours its pages show all that it tells, and test_pages.py sees that they are right.
"""

from dataclasses import replace

import pytest
from turtle_brick.core.parameters import default_path, load
from turtle_brick.core.reachability import resting_height
from turtle_brick.tools.lesson import __main__ as lesson
from turtle_brick.tools.lesson import falling, rolling

OTHERS = replace(load(), wheel_radius=0.13, max_velocity=1.7, gravity_accel=3.7, tilt_angle=0.4,
                 brick_size=(0.3, 0.3, 0.1))


def test_the_wheel_rolls_where_the_turtle_drives_and_nowhere_else():
    rolls = rolling.roll(OTHERS)
    driven, teleported, end = (
        next(roll for roll in rolls if roll.time >= time) for time in (1.2, 2.3, 4.4))
    ticks = 62 * 0.016  # of the first second
    assert driven.rolled == pytest.approx(OTHERS.max_velocity * ticks, abs=1e-5)
    assert teleported.rolled == driven.rolled
    assert teleported.seen > driven.seen + 1.0
    assert end.rolled == pytest.approx(driven.rolled + OTHERS.max_velocity, abs=1e-4)
    assert end.commanded > end.rolled + 0.4 * OTHERS.max_velocity


def test_fall_and_slide_are_the_closed_forms():
    *fall, landed = falling.fall(OTHERS)
    for time, brick in fall:
        assert brick[2] == pytest.approx(falling.closed_fall(time, OTHERS), abs=1e-9)
    assert landed.brick[2] == pytest.approx(resting_height(OTHERS))
    assert falling.closed_fall(landed.time, OTHERS) <= landed.brick[2] < fall[-1].brick[2]
    # Each step of Euler's method misses g dt^2 / 2.
    steps = len(fall) - 1
    assert falling.summed(steps, OTHERS)[-1] - fall[-1].brick[2] == pytest.approx(
        steps * OTHERS.gravity_accel * falling.DT ** 2 / 2.0)

    slide = falling.slide(OTHERS)
    for time, brick in slide:
        assert falling.along_slope(brick, OTHERS) == pytest.approx(
            falling.closed_slide(time, OTHERS), abs=1e-9)
    rim = OTHERS.platform_radius + OTHERS.brick_size[0] / 2.0
    before, after = (falling.along_slope(brick, OTHERS) for _, brick in slide[-2:])
    assert before <= rim < after
    assert falling.closed_slide(falling.slide_time(rim, OTHERS), OTHERS) == pytest.approx(rim)


def test_without_a_name_each_part_is_told_and_drawn(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(lesson, 'PARTS', {'rolling': rolling, 'falling': falling})
    assert lesson.main(['--output', str(tmp_path / 'new')]) == 0
    files = list((tmp_path / 'new').iterdir())
    assert {file.name for file in files} == {
        f'{kind}-{name}.png' for kind in ('sketch', 'lesson') for name in ('rolling', 'falling')}
    assert all(file.read_bytes().startswith(b'\x89PNG\r\n') for file in files)
    said = capsys.readouterr().out
    assert 'rolling:\n' in said and 'falling:\n' in said and 'one turn is 1.257 m' in said


def test_what_cannot_be_is_refused_with_a_sentence(tmp_path, capsys):
    with pytest.raises(SystemExit, match='2'):
        lesson.main(['flying'])
    assert "'flying' is none of frames, rolling" in capsys.readouterr().err
    assert lesson.main(['--params-file', str(tmp_path / 'none.yaml')]) == 2
    high = tmp_path / 'high.yaml'
    high.write_text(default_path().read_text().replace('1.6  ', '7.0  '))
    assert lesson.main(['--params-file', str(high)]) == 2
    (tmp_path / 'file').touch()
    assert lesson.main(['frames', '--output', str(tmp_path / 'file' / 'inside')]) == 2
    errors = capsys.readouterr().err.splitlines()
    assert len(errors) == 3 and all(line.startswith('lesson: ') for line in errors)
