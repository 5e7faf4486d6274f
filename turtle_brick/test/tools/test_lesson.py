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

"""The lesson's laws hold in what it computes, and its program refuses what cannot be."""

from dataclasses import replace
from math import e, pi

import pytest
from turtle_brick.core.parameters import default_path, load
from turtle_brick.core.reachability import (COMMAND_LATENCY, fall_time, guaranteed_distance,
                                            GUARANTEED_LATENCY, resting_height)
from turtle_brick.tools.lesson import __main__ as lesson
from turtle_brick.tools.lesson import falling, frames, queueing, reach, rolling

PARAMETERS = load()
OTHERS = replace(PARAMETERS, wheel_radius=0.13, max_velocity=1.7, gravity_accel=3.7,
                 tilt_angle=0.4, brick_size=(0.3, 0.3, 0.1))


def test_odometry_and_world_are_one_way_in_two_frames():
    way, stops = frames.drive(PARAMETERS)
    origin = stops[0].world
    assert origin == pytest.approx(frames.START)
    for stop, place in zip(stops, (frames.START[:2], *frames.CORNERS)):
        assert stop.world[:2] == pytest.approx(place, abs=1e-3)
        assert origin.compose(stop.odom)[:2] == pytest.approx(stop.world[:2], abs=1e-6)
    assert all(pose.yaw == origin.yaw for pose in way)


@pytest.mark.parametrize('parameters', [PARAMETERS, OTHERS])
def test_the_wheel_rolls_where_the_turtle_drives_and_nowhere_else(parameters):
    rolls = rolling.roll(parameters)
    driven, teleported, end = (
        next(roll for roll in rolls if roll.time >= time) for time in (1.2, 2.3, 4.4))
    ticks = 62 * 0.016  # of the first second
    assert driven.rolled == pytest.approx(parameters.max_velocity * ticks, abs=1e-5)
    assert teleported.rolled == driven.rolled
    assert teleported.seen > driven.seen + 1.0
    assert end.rolled == pytest.approx(driven.rolled + parameters.max_velocity, abs=1e-4)
    assert end.commanded > end.rolled + 0.4 * parameters.max_velocity


@pytest.mark.parametrize('parameters', [PARAMETERS, OTHERS])
def test_fall_and_slide_are_the_closed_forms(parameters):
    *fall, landed = falling.fall(parameters)
    for time, brick in fall:
        assert brick[2] == pytest.approx(falling.closed_fall(time, parameters), abs=1e-9)
    assert landed.brick[2] == pytest.approx(resting_height(parameters))
    assert falling.closed_fall(landed.time, parameters) <= landed.brick[2] < fall[-1].brick[2]
    # Each step of Euler's method misses g dt^2 / 2.
    steps = len(fall) - 1
    assert falling.summed(steps, parameters)[-1] - fall[-1].brick[2] == pytest.approx(
        steps * parameters.gravity_accel * falling.DT ** 2 / 2.0)

    slide = falling.slide(parameters)
    for time, brick in slide:
        assert falling.along_slope(brick, parameters) == pytest.approx(
            falling.closed_slide(time, parameters), abs=1e-9)
    rim = parameters.platform_radius + parameters.brick_size[0] / 2.0
    before, after = (falling.along_slope(brick, parameters) for _, brick in slide[-2:])
    assert before <= rim < after
    assert falling.closed_slide(falling.slide_time(rim, parameters), parameters) == (
        pytest.approx(rim))
    time = fall_time(parameters.brick_start[2], parameters)
    assert falling.closed_fall(time, parameters) == pytest.approx(resting_height(parameters))


def test_of_eight_commands_five_are_taken_each_61_to_77_ms_late():
    for phase in range(16):
        sent = queueing.commands(1e-3 * phase + 1e-4)
        assert sum(one.taken for one in sent[:48]) == 30
        assert all(0.060 < one.latency < (0.0712 if one.taken else 0.0772) for one in sent)


def test_naive_controllers_overshoot_or_are_late_and_ours_does_neither():
    seen = [queueing.approach(driver, PARAMETERS)
            for driver in queueing.controllers(PARAMETERS).values()]
    beyond = [max(place for _, place in way) for way in seen]
    there = [max(time for time, place in way if abs(place) > queueing.NEAR) for way in seen]
    until, quick, slow, ours = range(4)
    assert beyond[until] > 0.1 and there[until] > 2.9
    assert 0.02 < beyond[quick] < 0.1
    assert beyond[slow] < 0.001
    assert beyond[ours] < 0.001
    least = queueing.WAY / PARAMETERS.max_velocity
    assert least < there[ours] < least + 0.1 < min(there[:ours])


def test_the_limits_of_a_proportional_controller_are_those_of_its_delay():
    delay = 0.069

    def beyond(gain):
        naive = queueing.Naive(lambda gap: min(PARAMETERS.max_velocity, gain * gap))
        return [place for time, place in queueing.approach(naive, PARAMETERS) if time > 1.0]

    assert max(beyond(0.9 / (e * delay))) < 0.001 < max(beyond(2.0 / (e * delay)))
    late = slice(-125, None)  # half a second
    assert max(beyond(0.5 * pi / (2.0 * delay))[late]) < 0.001
    assert max(beyond(1.2 * pi / (2.0 * delay))[late]) > 0.05


def test_the_boundary_is_between_the_promise_and_no_latency_at_all():
    for height in reach.SAMPLES[::3]:
        promised = guaranteed_distance(height, PARAMETERS)
        without = promised + PARAMETERS.max_velocity * GUARANTEED_LATENCY
        assert promised <= reach.farthest_caught(height, PARAMETERS) < without
    latency = sum(time for _, time in reach.STEPS_OF_LATENCY)
    assert latency == pytest.approx(COMMAND_LATENCY + 3 * falling.DT)
    assert latency <= GUARANTEED_LATENCY


def test_each_part_is_told_and_drawn(tmp_path, capsys, monkeypatch):
    """With fewer bricks than on the page."""
    monkeypatch.setattr(reach, 'HEIGHTS', (1.0, 4.0, 9.0))
    monkeypatch.setattr(reach, 'SAMPLES', (4.0,))
    assert lesson.main(['--output', str(tmp_path / 'new')]) == 0
    files = list((tmp_path / 'new').iterdir())
    assert {file.name for file in files} == {f'lesson-{part}.png' for part in lesson.PARTS}
    assert all(file.read_bytes().startswith(b'\x89PNG\r\n') for file in files)
    said = capsys.readouterr().out
    assert all(f'{part}:\n' in said for part in lesson.PARTS)
    assert 'one turn is 1.257 m' in said


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
