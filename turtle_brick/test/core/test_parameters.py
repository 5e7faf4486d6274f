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
from dataclasses import asdict, fields, FrozenInstanceError, replace
from email.message import Message
import math
import pickle
import subprocess
import sys

from hypothesis import assume, given
from hypothesis import strategies as st
import pytest
from turtle_brick.core import parameters
from turtle_brick.core.dimensions import Chassis, least_room
from turtle_brick.core.parameters import (default_path, from_mapping, load, meaning,
                                          MissingParameterError, ParameterError, Parameters)
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
        admitted = from_mapping(mapping)
        for name, value in mapping.items():
            kept = getattr(admitted, name)
            assert kept == (tuple(value) if RULES[name].length == 3 else value)
            assert all(type(v) is float for v in (kept if RULES[name].length == 3 else [kept]))


@pytest.mark.parametrize('name, value', [
    (name, value) for name, rule in RULES.items() if rule.length == 1 for value in (
        0, -1, -0.0, 1e9, 10 ** 400, math.nan, math.inf, -math.inf, True, '3', '', None, [1.0],
        (), {}, b'3', 1j) if not (value in (0, -1) and rule.lower <= value)])
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
    assert [record.getMessage().partition('.yaml:')[2].partition(': ')[2]
            for record in caplog.records] == [
                'unknown max_velocty, did you mean max_velocity?', 'unknown port']


@pytest.mark.parametrize('wrong, right', [
    ('platfrom_height', 'platform_height'), ('wheel_raduis', 'wheel_radius'),
    ('gravity_acel', 'gravity_accel'), ('brick_starts', 'brick_start')])
def test_a_misspelt_name_is_told_with_the_right_one(wrong, right):
    mapping = {wrong if name == right else name: value for name, value in DEFAULTS.items()}
    assert refused(mapping) == f'unknown {wrong}, did you mean {right}?'


@pytest.mark.parametrize('before, after, line, words', [
    ('wheel_radius: 0.2', 'wheel_radius: -1', 3, 'wheel_radius is -1, but must be'),
    ('wheel_radius: 0.2', '"wheel_radius" : -1', 3, 'wheel_radius is -1, but must be'),
    ('wheel_radius', 'whell_radius', 3, 'unknown whell_radius, did you mean wheel_radius?'),
    ('tilt_angle: 0.7', 'tilt_angle: steep', 4, "tilt_angle is 'steep', but must be"),
])
def test_an_error_names_the_file_and_the_line(tmp_path, before, after, line, words):
    rest = {name: value for name, value in listed().items()
            if name not in ('wheel_radius', 'tilt_angle')}
    text = f"""/**:
  ros__parameters:  # not wheel_radius: 0.1
    wheel_radius: 0.2
    tilt_angle: 0.7
    {str(rest)[1:-1].replace(", '", chr(10) + "    '")}
"""
    path = tmp_path / 'turtle.yaml'
    path.write_text(text)
    assert load(path) == from_mapping(DEFAULTS)
    path.write_text(text.replace(before, after))
    with pytest.raises(ParameterError) as caught:
        load(path)
    assert str(caught.value).startswith(f'{path}:{line}: {words}')


def test_what_is_not_yaml_is_shown_with_its_place(tmp_path):
    path = tmp_path / 'turtle.yaml'
    path.write_text('/**:\n  ros__parameters:\n    brick_size: [0.4, 0.2\n    wheel: 1\n')
    with pytest.raises(ParameterError) as caught:
        load(path)
    first, *rest = str(caught.value).splitlines()
    assert first.startswith(f'{path}: this is not YAML: ')
    assert 'in line 3, column 17:' in rest[0]
    assert rest[1].index('[') == rest[2].index('^')


@pytest.mark.parametrize('how', ['copied', 'linked', 'outdated'])
def test_an_error_about_the_installed_file_names_the_one_to_change(tmp_path, monkeypatch, how):
    """An install copies the package's own file, or links to it."""
    source = tmp_path / 'source of it' / 'config' / 'turtle.yaml'
    installed = tmp_path / 'share' / 'config' / 'turtle.yaml'
    for path in (source, installed):
        path.parent.mkdir(parents=True)
    write(source.parent, listed(max_velocity=-1))
    if how == 'linked':
        installed.symlink_to(source)
    else:
        installed.write_bytes(source.read_bytes())
        urls = Message()
        urls['Project-URL'] = f'Source, {source.parents[1].as_uri()}'
        monkeypatch.setattr(parameters, 'metadata', lambda name: urls)
    if how == 'outdated':
        write(source.parent, listed())
    monkeypatch.setattr(parameters, 'default_path', lambda: installed)
    with pytest.raises(ParameterError) as caught:
        load()
    line = 1 + yaml.safe_dump({'/**': {'ros__parameters': listed()}}).split(
        'max_velocity')[0].count('\n')
    assert str(caught.value).startswith(
        f'{installed}:{line} (older than {source}: build again): max_velocity is'
        if how == 'outdated' else f'{source}:{line}: max_velocity is')


def test_values_cannot_be_changed_unchecked():
    loaded = load()
    with pytest.raises(FrozenInstanceError):
        loaded.max_velocity = 1.0
    assert replace(loaded, max_velocity=1).max_velocity == 1.0
    with pytest.raises(ParameterError):
        replace(loaded, max_velocity=-1.0)
    assert pickle.loads(pickle.dumps(loaded)) == loaded
    assert len({loaded, load()}) == 1


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
    ('/**:\n  ros__parameters: {wheel_radius: 0.2}', 'missing parameters: '),
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
    code = ('import sys, turtle_brick.core.parameters as p; p.load(); '
            'print([m for m in sys.modules if m.split(".")[0] in ("rclpy", "rcl_interfaces")])')
    shown = subprocess.run(
        [sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == '[]'


def test_the_file_is_checked_where_the_home_is_sourced(tmp_path, monkeypatch, capsys):
    assert parameters.main() == 0
    monkeypatch.setattr(parameters, 'default_path', lambda: tmp_path / 'config' / 'turtle.yaml')
    (tmp_path / 'config').mkdir()
    (tmp_path / 'config' / 'turtle.yaml').write_text('/**: {ros__parameters: [')
    assert parameters.main() == 1
    said, errors = capsys.readouterr()
    assert said == '' and errors.startswith(f'turtle_brick: {tmp_path}')
    assert 'this is not YAML' in errors
