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
from importlib.util import find_spec
from math import e, pi

import pytest
from turtle_brick.core.parameters import default_path, load
from turtle_brick.core.reachability import (COMMAND_LATENCY, fall_time, guaranteed_distance,
                                            GUARANTEED_LATENCY, resting_height)
from turtle_brick.tools import lesson
from turtle_brick.tools import lesson_laws as laws

PARAMETERS = load()
OTHERS = replace(PARAMETERS, wheel_radius=0.13, max_velocity=1.7, gravity_accel=3.7,
                 tilt_angle=0.4, brick_size=(0.3, 0.3, 0.1))
PNG = b'\x89PNG\r\n'


def test_odometry_and_world_are_one_way_in_two_frames():
    way, stops = laws.frames(PARAMETERS)
    origin = stops[0].world
    assert (origin.x, origin.y, origin.yaw) == pytest.approx(laws.START)
    for stop, place in zip(stops, (laws.START[:2], *laws.CORNERS)):
        assert (stop.world.x, stop.world.y) == pytest.approx(place, abs=1e-3)
        composed = origin.compose(stop.odom)
        assert (composed.x, composed.y) == pytest.approx((stop.world.x, stop.world.y), abs=1e-6)
    assert all(pose.yaw == origin.yaw for pose in way)


@pytest.mark.parametrize('parameters', [PARAMETERS, OTHERS])
def test_the_wheel_rolls_where_the_turtle_drives_and_nowhere_else(parameters):
    rolls = laws.rolling(parameters)
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
    fall = laws.falling(parameters)
    for place in fall[:-1]:
        assert place.brick[2] == pytest.approx(
            laws.closed_fall(place.time, parameters), abs=1e-9)
    assert fall[-1].brick[2] == pytest.approx(resting_height(parameters))
    assert laws.closed_fall(fall[-1].time, parameters) <= fall[-1].brick[2] < fall[-2].brick[2]
    # Each step of Euler's method misses g dt^2 / 2.
    steps = len(fall) - 2
    assert laws.summed(steps, parameters)[-1] - fall[-2].brick[2] == pytest.approx(
        steps * parameters.gravity_accel * laws.DT ** 2 / 2.0)

    slide = laws.sliding(parameters)
    for place in slide:
        assert laws.along_slope(place, parameters) == pytest.approx(
            laws.closed_slide(place.time, parameters), abs=1e-9)
    rim = parameters.platform_radius + parameters.brick_size[0] / 2.0
    before, after = (laws.along_slope(place, parameters) for place in slide[-2:])
    assert before <= rim < after
    assert laws.closed_slide(laws.slide_time(rim, parameters), parameters) == pytest.approx(rim)
    time = fall_time(parameters.brick_start[2], parameters)
    assert laws.closed_fall(time, parameters) == pytest.approx(resting_height(parameters))


def test_of_eight_commands_five_are_taken_each_61_to_77_ms_late():
    for phase in range(16):
        sent = laws.commands(1e-3 * phase + 1e-4)
        assert sum(one.taken for one in sent[:48]) == 30
        assert all(0.060 < one.latency < (0.0712 if one.taken else 0.0772) for one in sent)


def test_naive_controllers_overshoot_or_are_late_and_ours_does_neither():
    seen = {name: laws.approach(driver, PARAMETERS)
            for name, driver in laws.controllers(PARAMETERS).items()}
    beyond = [max(place for _, place in way) for way in seen.values()]
    there = [max(time for time, place in way if abs(place) > laws.NEAR)
             for way in seen.values()]
    until, quick, slow, ours = range(4)
    assert beyond[until] > 0.1 and there[until] > 2.9
    assert 0.02 < beyond[quick] < 0.1
    assert beyond[slow] < 0.001
    assert beyond[ours] < 0.001
    least = laws.WAY / PARAMETERS.max_velocity
    assert least < there[ours] < least + 0.1 < min(there[:ours])


def test_the_limits_of_a_proportional_controller_are_those_of_its_delay():
    delay = 0.069

    def beyond(gain):
        naive = laws.Naive(lambda gap: min(PARAMETERS.max_velocity, gain * gap))
        return [place for time, place in laws.approach(naive, PARAMETERS) if time > 1.0]

    assert max(beyond(0.9 / (e * delay))) < 0.001 < max(beyond(2.0 / (e * delay)))
    late = slice(-125, None)  # half a second
    assert max(beyond(0.5 * pi / (2.0 * delay))[late]) < 0.001
    assert max(beyond(1.2 * pi / (2.0 * delay))[late]) > 0.05


def test_the_boundary_is_between_the_promise_and_no_latency_at_all():
    for height in laws.SAMPLES:
        promised = guaranteed_distance(height, PARAMETERS)
        without = promised + PARAMETERS.max_velocity * GUARANTEED_LATENCY
        assert promised <= laws.farthest_caught(height, PARAMETERS) < without
    latency = sum(time for _, time in laws.STEPS_OF_LATENCY)
    assert latency == pytest.approx(COMMAND_LATENCY + 3 * laws.DT)
    assert latency <= GUARANTEED_LATENCY


def test_no_brick_is_missed_by_a_fast_robot_either():
    fast = replace(PARAMETERS, max_velocity=9.0)
    for height in laws.HEIGHTS[::4]:
        for distance in laws.DISTANCES[::4]:
            assert laws.drop_at(distance, height, fast).outcome != 'missed'


# -------------------------------------------------------------------------------- the program

@pytest.mark.skipif(find_spec('matplotlib') is None, reason='matplotlib is not installed')
def test_each_part_is_drawn(tmp_path, capsys):
    assert lesson.main(['--output', str(tmp_path / 'new')]) == 0
    files = sorted((tmp_path / 'new').iterdir())
    assert [file.name for file in files] == sorted(f'lesson-{part}.png' for part in lesson.PARTS)
    assert all(file.read_bytes().startswith(PNG) for file in files)
    said = capsys.readouterr().out
    assert all(f'{part}:\n' in said for part in lesson.PARTS)


def test_without_matplotlib_the_numbers_are_told(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(lesson, 'find_spec', lambda name: None)
    assert lesson.main(['rolling', '--output', str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert 'one turn is 1.257 m' in said and 'needs matplotlib' in said
    assert not list(tmp_path.iterdir())


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
