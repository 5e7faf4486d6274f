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

"""Test parameter files and their error messages."""

from dataclasses import asdict, fields, replace
import math
from pathlib import Path
import subprocess
import sys

import pytest
from turtle_brick.core.parameters import (default_path, load, MissingParameterError,
                                          PARAMETER_RULES, ParameterError, Parameters)
import yaml

DEFAULTS = asdict(load())


def error_of(mapping):
    with pytest.raises(ParameterError) as caught:
        Parameters.from_mapping(mapping)
    return str(caught.value)


def written(directory, text):
    path = directory / 'turtle.yaml'
    if not isinstance(text, str):
        section = {name: list(value) if isinstance(value, tuple) else value
                   for name, value in text.items()}
        text = yaml.safe_dump({'/**': {'ros__parameters': section}})
    path.write_text(text, encoding='utf-8')
    return path


def test_file_rules_and_parameters_have_the_same_names():
    content = yaml.safe_load(default_path().read_text(encoding='utf-8'))
    assert content == {'/**': {'ros__parameters': content['/**']['ros__parameters']}}
    names = {field.name for field in fields(Parameters)}
    assert set(content['/**']['ros__parameters']) == set(PARAMETER_RULES) == names


@pytest.mark.parametrize('name', PARAMETER_RULES)
def test_invalid_number_is_reported_with_the_valid_range(name):
    rule = PARAMETER_RULES[name]
    for wrong in (math.nextafter(rule.lower, -math.inf), math.nextafter(rule.upper, math.inf),
                  math.nan, math.inf, 10 ** 400, True, '3', '', None, 1j, {}, (), [1.0]):
        values = [wrong] if rule.length == 1 else [
            [wrong, 1.0, 1.0], [1.0, 1.0, wrong], wrong, [1.0, 2.0], [1.0] * 4]
        for value in values:
            message = error_of({**DEFAULTS, name: value})
            assert message.startswith(f'{name} is {value!r:.80}, but must be ')
            assert f'from {rule.lower:g} to {rule.upper:g} {rule.unit}'.rstrip() in message
            assert len(message) < 170


def test_brick_may_start_on_the_ground():
    lying = {**DEFAULTS, 'brick_size': (0.4, 0.2, 0.5), 'brick_start': (1.0, 1.0, 0.25)}
    assert Parameters.from_mapping(lying).brick_start[2] == 0.25
    assert 'is below the ground' in error_of(
        {**lying, 'brick_start': (1.0, 1.0, math.nextafter(0.25, 0.0))})


def test_missing_and_misspelled_parameters_are_reported():
    some = {name: value for name, value in DEFAULTS.items() if 'brick' not in name}
    with pytest.raises(MissingParameterError, match='^missing parameters: brick_size, brick_st'):
        Parameters.from_mapping(some)
    assert error_of({**some, 'brick_size': (1, 1, 1), 'brick_strat': (1, 1, 1)}) == (
        'unknown parameter brick_strat (did you mean brick_start?)')
    # Unknown parameters are ignored if no required parameter is missing.
    assert Parameters.from_mapping({
        **DEFAULTS, 'brick_start': [1, 2, 3], 'max_velocty': 1, 'port': 2, 3: 4}) == replace(
            load(), brick_start=(1.0, 2.0, 3.0))


@pytest.mark.parametrize('before, after, words', [
    ('wheel_radius: 0.2', 'wheel_radius: -1', 'wheel_radius is -1, but must be a number from 0.01 '
     'to 10 m'),
    ('tilt_angle: 0.7', '', 'missing parameters: tilt_angle'),
    ('tilt_angle: 0.7', 'tilt_angle: 1e-1', "tilt_angle is '1e-1', but must be a number from 0.05 "
     'to 1.5 rad'),
    ('/**:', 'arena:', "there are no parameters under '/**: ros__parameters:'"),
])
def test_error_in_a_file_is_reported_with_its_path(tmp_path, before, after, words):
    path = written(tmp_path, default_path().read_text())
    assert load(path) == load(str(path)) == load()
    written(tmp_path, path.read_text().replace(before, after))
    with pytest.raises(ParameterError) as caught:
        load(path)
    assert str(caught.value).startswith(f'{path}: {words}')
    assert '\n' not in str(caught.value)


def test_file_that_is_not_yaml_or_cannot_be_read_is_reported(tmp_path):
    path = written(tmp_path, '/**:\n  ros__parameters:\n    brick_size: [0.4, 0.2\n    wheel: 1\n')
    with pytest.raises(ParameterError, match=r'(?s)invalid YAML: .*\n +in line 3, column 17:'):
        load(path)
    path.write_bytes(b'\xff\xfe\xfa')
    for path, words in ((path, 'invalid YAML'), (tmp_path / 'absent.yaml', 'No such file'),
                        (tmp_path, 'Is a directory')):
        with pytest.raises(ParameterError, match=f'^{path}: {words}'):
            load(path)


def test_pure_modules_import_neither_ros_nor_yaml():
    """The website imports physics, core.catch_logic and core.odometry without ROS or PyYAML."""
    subprocess.run([sys.executable, '-c', """import sys
sys.modules['rclpy'] = sys.modules['yaml'] = None
import turtle_brick.physics, turtle_brick.core.catch_logic, turtle_brick.core.odometry"""],
                   check=True, cwd=Path(__file__).parents[2])


@pytest.mark.parametrize('name', PARAMETER_RULES)
def test_valid_values_are_kept_and_integers_become_floats(name):
    rule = PARAMETER_RULES[name]
    for number in (rule.lower, rule.upper, 1):
        value = number if rule.length == 1 else [1, number, 10]
        kept = getattr(Parameters.from_mapping({**DEFAULTS, name: value}), name)
        assert kept == (value if rule.length == 1 else tuple(value))
        assert {type(part) for part in ([kept] if rule.length == 1 else kept)} == {float}
