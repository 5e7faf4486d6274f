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
"""The parameters: one file, one set of rules, and a sentence for whatever breaks one."""

from array import array
from dataclasses import asdict
from dataclasses import fields
from dataclasses import FrozenInstanceError
from dataclasses import replace
import math
import pickle
import subprocess
import sys

from hypothesis import assume
from hypothesis import given
from hypothesis import strategies as st
import pytest
from turtle_brick.chassis import Chassis
from turtle_brick.chassis import least_room
from turtle_brick.parameters import default_path
from turtle_brick.parameters import from_mapping
from turtle_brick.parameters import load
from turtle_brick.parameters import meaning
from turtle_brick.parameters import MissingParameterError
from turtle_brick.parameters import ParameterError
from turtle_brick.parameters import Parameters
import yaml

DEFAULTS = asdict(load())
RULES = {entry.name: meaning(entry) for entry in fields(Parameters)}


def refused(mapping: dict) -> str:
    """Return the sentence with which a mapping is refused."""
    with pytest.raises(ParameterError) as caught:
        from_mapping(mapping)
    return str(caught.value)


def within(name: str) -> st.SearchStrategy:
    """Return a strategy for the values of one parameter that its own range admits."""
    rule = RULES[name]
    number = st.floats(rule.lower, rule.upper) | st.integers(
        math.ceil(rule.lower), math.floor(rule.upper))
    return number if rule.length == 1 else st.lists(number, min_size=3, max_size=3)


def test_file_has_exactly_the_parameters():
    content = yaml.safe_load(default_path().read_text(encoding='utf-8'))
    assert set(content) == {'/**'}
    assert set(content['/**']) == {'ros__parameters'}
    assert set(content['/**']['ros__parameters']) == set(RULES)


def test_every_parameter_has_a_meaning():
    for name, rule in RULES.items():
        assert rule.description and rule.unit, name
        assert rule.lower < rule.upper, name
        assert rule.length in (1, 3), name


@given(st.fixed_dictionaries({name: within(name) for name in RULES}))
def test_values_in_range_are_kept_unless_the_geometry_forbids(mapping):
    height, radius = mapping['platform_height'], mapping['platform_radius']
    thickness, wheel = mapping['platform_thickness'], mapping['wheel_radius']
    needed = 2 * wheel + math.hypot(radius, thickness) + thickness + least_room(radius, wheel)
    half_height = mapping['brick_size'][2] / 2
    assume(abs(height - needed) > 1e-9)
    if mapping['brick_start'][2] < half_height:
        assert f'at least {half_height:g} m' in refused(mapping)
    elif not wheel / 3 <= radius <= 20 * wheel:
        sentence = refused(mapping)
        for words in (f'{radius:g} m', f'{wheel:g} m', f'{wheel / 3:g} to {20 * wheel:g} m'):
            assert words in sentence
    elif height < needed:
        sentence = refused(mapping)
        for number in (height, radius, thickness, wheel, needed):
            assert f'{number:g} m' in sentence
    else:
        parameters = from_mapping(mapping)
        for name, value in mapping.items():
            kept = getattr(parameters, name)
            assert kept == (tuple(value) if RULES[name].length == 3 else value)
            assert all(type(v) is float for v in (kept if RULES[name].length == 3 else [kept]))


@pytest.mark.parametrize('name', [name for name in RULES if RULES[name].length == 1])
@pytest.mark.parametrize('value', [
    0, -1, -0.0, 1e9, 10 ** 400, math.nan, math.inf, -math.inf, True, '3', '', None, [1.0],
    (), {}, b'3', 1j])
def test_a_number_that_cannot_be_is_refused(name, value):
    sentence = refused({**DEFAULTS, name: value})
    assert sentence.startswith(f'{name} is ')
    assert repr([] if value == () else value)[:80] in sentence
    assert len(sentence) < 160
    assert f'from {RULES[name].lower:g} to {RULES[name].upper:g}' in sentence
    assert '\n' not in sentence


@pytest.mark.parametrize('name', ['brick_size', 'brick_start'])
@pytest.mark.parametrize('value', [
    1.0, 'abc', b'abc', None, True, [], [1.0], [1.0, 2.0], [1.0, 2.0, 3.0, 4.0],
    [1.0, math.nan, 1.0], [1.0, 1.0, math.inf], [True, 1.0, 1.0], ['1', '1', '1'],
    {1: 1, 2: 2, 3: 3}, [1.0, 1.0, -1e5], [[1.0], [1.0], [1.0]], iter([1.0, 1.0, 1.0])])
def test_a_vector_that_cannot_be_is_refused(name, value):
    sentence = refused({**DEFAULTS, name: value})
    assert sentence.startswith(f'{name} is ')
    assert '3 numbers from' in sentence


@pytest.mark.parametrize('name', list(RULES))
def test_range_is_closed(name):
    rule = RULES[name]
    for edge, outward in ((rule.lower, -math.inf), (rule.upper, math.inf)):
        beyond = math.nextafter(edge, outward)
        values = [beyond if rule.length == 1 else [edge, beyond, edge]]
        for value in values:
            assert f'{name} is' in refused({**DEFAULTS, name: value})


def test_any_sequence_of_three_makes_a_vector():
    for value in ([1, 2, 3], (1.0, 2.0, 3.0), array('d', [1, 2, 3]), array('q', [1, 2, 3])):
        assert from_mapping({**DEFAULTS, 'brick_start': value}).brick_start == (1.0, 2.0, 3.0)


@pytest.mark.parametrize('half_height', [0.06, 0.5])
def test_brick_starts_at_or_above_the_ground(half_height):
    size = (0.4, 0.2, 2 * half_height)
    lying = {**DEFAULTS, 'brick_size': size, 'brick_start': (1.0, 1.0, half_height)}
    assert from_mapping(lying).brick_start[2] == half_height
    sunk = (1.0, 1.0, math.nextafter(half_height, 0.0))
    assert 'below the ground' in refused({**lying, 'brick_start': sunk})


def test_platform_that_would_hit_the_base_is_refused():
    sentence = refused({**DEFAULTS, 'platform_height': 0.9})
    for value in ('0.9 m', '0.5 m', '0.04 m', '0.2 m', 'at least 1.1416 m'):
        assert value in sentence


@pytest.mark.parametrize('wheel, words', [
    (0.5, 'platform_height 1.6 m is too low'),  # it would leave a cube of 3 cm
    (0.02, 'platform_radius 0.5 m is out of proportion'),
    (3.0, 'platform_radius 0.5 m is out of proportion'),
])
def test_a_wheel_that_leaves_no_body_is_refused(wheel, words):
    assert words in refused({**DEFAULTS, 'platform_height': 1.6, 'wheel_radius': wheel})
    assert from_mapping({**DEFAULTS, 'platform_height': 3.0, 'wheel_radius': 0.5})


@given(st.floats(0.01, 10), st.floats(0.001, 10), st.floats(1 / 3, 20), st.floats(1e-6, 50))
def test_dimensions_fit_together(wheel, thickness, proportion, spare):
    radius = min(max(proportion * wheel, wheel / 3), 20 * wheel)
    height = (2 * wheel + math.hypot(radius, thickness) + thickness + least_room(radius, wheel)
              + spare)
    chassis = Chassis.from_dimensions(height, radius, thickness, wheel)
    # From the ground up, nothing overlaps and everything has a size.
    assert 0 < chassis.wheel_top < chassis.cube_bottom < chassis.cube_top
    assert 0 < chassis.stem_length < chassis.neck
    assert chassis.cube_top < chassis.hinge_height - chassis.reach
    assert chassis.cube_top + chassis.post_length == pytest.approx(chassis.hinge_height)
    assert chassis.hinge_height + thickness == pytest.approx(height)
    assert min(chassis.wheel_width, chassis.stem_radius, chassis.post_radius) > 0
    # And nothing vanishes beside the rest.
    assert chassis.cube_side >= 0.499 * wheel
    assert chassis.cube_side >= radius / 12


def test_missing_are_named():
    some = {name: value for name, value in DEFAULTS.items() if 'brick' not in name}
    with pytest.raises(MissingParameterError) as caught:
        from_mapping(some)
    assert str(caught.value) == 'missing parameters: brick_size, brick_start'


def test_what_it_does_not_know_is_warned_of_and_nothing_else(tmp_path, caplog):
    path = write(tmp_path, listed(max_velocty=1.0, port=8080, use_sim_time=True, **{
        'qos_overrides./tf.publisher.depth': 3, 'start_type_description_service': False}))
    assert load(path) == from_mapping(DEFAULTS)
    (record,) = caplog.records
    assert record.getMessage() == f'{path}: unknown parameters: max_velocty, port'


def test_values_cannot_be_changed_unchecked():
    parameters = load()
    with pytest.raises(FrozenInstanceError):
        parameters.max_velocity = 1.0
    assert replace(parameters, max_velocity=1).max_velocity == 1.0
    with pytest.raises(ParameterError):
        replace(parameters, max_velocity=-1.0)
    assert pickle.loads(pickle.dumps(parameters)) == parameters
    assert len({parameters, load()}) == 1


def write(path, section) -> str:
    """Write a parameter file and return its path."""
    file = path / 'turtle.yaml'
    file.write_text(yaml.safe_dump({'/**': {'ros__parameters': section}}), encoding='utf-8')
    return str(file)


def listed(**changes) -> dict:
    """Return the default values with changes, as YAML has them."""
    return {name: list(value) if isinstance(value, tuple) else value
            for name, value in {**DEFAULTS, **changes}.items()}


def test_file_of_ones_own(tmp_path):
    path = write(tmp_path, listed(max_velocity=2, use_sim_time=True))
    assert load(path) == from_mapping({**DEFAULTS, 'max_velocity': 2.0})


@pytest.mark.parametrize('text, reason', [
    ('', "no parameters under '/**: ros__parameters:'"),
    ('3', "no parameters under '/**: ros__parameters:'"),
    ('/**: 3', "no parameters under '/**: ros__parameters:'"),
    ('arena:\n  ros__parameters: {wheel_radius: 0.2}', 'no parameters under'),
    ('/**:\n  ros__parameters:', 'no parameters under'),
    ('/**: [1', 'not YAML'),
    ('/**:\n  ros__parameters: {wheel_radius: 0.2}', 'missing parameters: brick_size'),
])
def test_file_that_says_nothing_is_refused(tmp_path, text, reason):
    path = tmp_path / 'wrong.yaml'
    path.write_text(text, encoding='utf-8')
    with pytest.raises(ParameterError) as caught:
        load(path)
    assert str(caught.value).startswith(f'{path}: ')
    assert reason in str(caught.value)
    assert '\n' not in str(caught.value)


def test_file_that_is_absent_or_unreadable_is_refused(tmp_path):
    for path in (tmp_path / 'absent.yaml', tmp_path):
        with pytest.raises(ParameterError, match=str(path)):
            load(path)
    binary = tmp_path / 'binary.yaml'
    binary.write_bytes(b'\xff\xfe\xfa')
    with pytest.raises(ParameterError, match='not YAML'):
        load(binary)


def test_reading_the_file_takes_no_ros():
    code = ('import sys, turtle_brick.parameters as p; p.load(); '
            'print([m for m in sys.modules if m.split(".")[0] in ("rclpy", "rcl_interfaces")])')
    shown = subprocess.run(
        [sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == '[]'
