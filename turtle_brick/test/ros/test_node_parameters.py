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

"""The parameters of every node, as they arrive and as they are declared."""

from collections.abc import Iterator
from dataclasses import asdict, fields
import math

import pytest
from rcl_interfaces.msg import ParameterType
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from turtle_brick.core.parameters import (default_path, from_mapping, load, meaning,
                                          MissingParameterError, ParameterError, Parameters)
from turtle_brick.ros.node_parameters import declare_parameters

DEFAULTS = {name: list(value) if isinstance(value, tuple) else value
            for name, value in asdict(load()).items()}


@pytest.fixture
def context(domain_id) -> Iterator[Context]:
    """Return a ROS context of the test's own."""
    context = Context()
    rclpy.init(args=[], context=context, domain_id=domain_id)
    yield context
    rclpy.try_shutdown(context=context)


def node_with(context: Context, values: dict) -> Node:
    """Make a node to which these parameters are given."""
    return Node('probe', context=context, parameter_overrides=[
        Parameter(name, value=value) for name, value in values.items()])


def test_values_arrive(context):
    node = node_with(context, DEFAULTS)
    assert declare_parameters(node) == load()
    for name, value in DEFAULTS.items():
        held = node.get_parameter(name).value
        assert (list(held) if isinstance(value, list) else held) == value
    node.destroy_node()


def test_values_are_declared_in_full_and_read_only(context):
    node = node_with(context, DEFAULTS)
    declare_parameters(node)
    for entry in fields(Parameters):
        rule, descriptor = meaning(entry), node.describe_parameter(entry.name)
        assert descriptor.description == rule.description
        assert rule.unit in descriptor.additional_constraints
        assert descriptor.read_only and not descriptor.dynamic_typing
        if rule.length == 1:
            assert descriptor.type == ParameterType.PARAMETER_DOUBLE
            (limits,) = descriptor.floating_point_range
            assert (limits.from_value, limits.to_value) == (rule.lower, rule.upper)
        else:
            assert descriptor.type == ParameterType.PARAMETER_DOUBLE_ARRAY
        held = node.get_parameter(entry.name).value
        (result,) = node.set_parameters([Parameter(entry.name, value=held)])
        assert not result.successful
        assert 'read-only' in result.reason
    node.destroy_node()


def test_integers_are_as_good_as_floats(context):
    node = node_with(context, {**DEFAULTS, 'max_velocity': 3, 'brick_start': [7, 6, 5]})
    parameters = declare_parameters(node)
    assert parameters == from_mapping(
        {**DEFAULTS, 'max_velocity': 3.0, 'brick_start': (7.0, 6.0, 5.0)})
    assert node.get_parameter('max_velocity').type_ == Parameter.Type.DOUBLE
    node.destroy_node()


@pytest.mark.parametrize('change', [
    {'max_velocity': 'fast'}, {'max_velocity': True}, {'max_velocity': -3},
    {'max_velocity': math.nan}, {'max_velocity': [3.0]}, {'wheel_radius': 0.0},
    {'brick_size': [0.4, 0.2]}, {'brick_size': 0.4}, {'brick_size': ['a', 'b', 'c']},
    {'brick_start': [7.5, 7.0, -8.0]}, {'platform_height': 0.5}, {'platform_height': 200.0}])
def test_node_refuses_in_the_same_words_as_the_file(context, change):
    node = node_with(context, {**DEFAULTS, **change})
    with pytest.raises(ParameterError) as from_node:
        declare_parameters(node)
    with pytest.raises(ParameterError) as from_values:
        from_mapping({**DEFAULTS, **change})
    assert str(from_node.value) == str(from_values.value)
    node.destroy_node()


def test_missing_parameter_names_itself_and_the_file(context):
    some = {name: value for name, value in DEFAULTS.items() if name != 'wheel_radius'}
    node = node_with(context, some)
    with pytest.raises(MissingParameterError) as caught:
        declare_parameters(node)
    assert str(caught.value) == (
        f'missing parameters: wheel_radius; add --ros-args --params-file {default_path()}')
    assert default_path().is_file()
    node.destroy_node()


def test_a_missing_parameter_is_one_of_the_file_that_is_given(context, tmp_path, monkeypatch):
    path = tmp_path / 'turtle.yaml'
    path.write_text(default_path().read_text().replace('    wheel_radius: 0.2', '    # none: 0.2'))
    monkeypatch.setattr('sys.argv', ['arena', '--ros-args', '--params-file', str(path)])
    node = node_with(context, {
        name: value for name, value in DEFAULTS.items() if name != 'wheel_radius'})
    with pytest.raises(MissingParameterError) as caught:
        declare_parameters(node)
    assert str(caught.value) == f'{path}: missing parameters: wheel_radius'
    node.destroy_node()


def test_a_refusal_names_the_parameter_file_that_has_the_value(context, tmp_path, monkeypatch):
    path = tmp_path / 'turtle.yaml'
    path.write_text(default_path().read_text().replace('wheel_radius: 0.2', 'wheel_radius: -1'))
    for name, value, prefix in (
            ('wheel_radius', -1, f'{path}:10: '), ('wheel_radius', -2, ''), ('tilt_angle', 9, '')):
        monkeypatch.setattr('sys.argv', [
            'arena', '--ros-args', '--params-file', str(default_path()),
            '--params-file', str(path), '-p', 'x:=1'])
        node = node_with(context, {**DEFAULTS, name: value})
        with pytest.raises(ParameterError) as caught:
            declare_parameters(node)
        assert str(caught.value).startswith(f'{prefix}{name} is {value}, but must be')
        node.destroy_node()


def test_what_the_node_does_not_know_is_warned_of_and_nothing_else(context, capfd):
    node = node_with(context, {**DEFAULTS, 'max_velocty': 3.0, 'port.a': 1, 'use_sim_time': True,
                               'qos_overrides./tf.publisher.depth': 3})
    assert declare_parameters(node) == load()
    warnings = capfd.readouterr().err.splitlines()
    assert all('[WARN]' in warning for warning in warnings)
    assert [warning.rpartition(']: ')[2] for warning in warnings] == [
        'unknown max_velocty, did you mean max_velocity?', 'unknown port']
    node.destroy_node()
