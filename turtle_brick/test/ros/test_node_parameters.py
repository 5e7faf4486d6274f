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

"""Declaration of the parameters of each node."""

from collections.abc import Iterator
from dataclasses import asdict, fields, replace

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from turtle_brick.arena import Arena
from turtle_brick.catcher import CatcherNode
from turtle_brick.core.parameters import (AnyParameterSet, ArenaParameters, CatcherParameters,
                                          load, MissingParameterError, PARAMETER_RULES,
                                          ParameterError, Parameters, RobotParameters)
from turtle_brick.ros.node_parameters import declare_parameters
from turtle_brick.turtle_robot import TurtleRobot
from turtle_referee.graph_client.domains import reserved_domain

DEFAULTS = {name: list(value) if isinstance(value, tuple) else value
            for name, value in asdict(load()).items()}


@pytest.fixture(scope='module')
def context() -> Iterator[Context]:
    """Return a ROS context in an unused domain."""
    context = Context()
    with reserved_domain() as domain:
        rclpy.init(args=[], context=context, domain_id=domain)
        yield context
        rclpy.try_shutdown(context=context)


def overrides(values: dict) -> list[Parameter]:
    """Return values as parameter overrides of a node."""
    return [Parameter(name, value=value) for name, value in values.items()]


def declare(context: Context, parameter_set: type[AnyParameterSet],
            **values: object) -> AnyParameterSet:
    """Create a node with parameter overrides, and declare a parameter set."""
    node = Node('probe', context=context, parameter_overrides=overrides(values),
                start_parameter_services=False, enable_rosout=False)
    try:
        return declare_parameters(node, parameter_set)
    finally:
        node.destroy_node()


@pytest.mark.parametrize('node_type, parameter_set', [
    (TurtleRobot, RobotParameters), (Arena, ArenaParameters), (CatcherNode, CatcherParameters)])
def test_each_node_requires_only_its_own_parameters(context, node_type, parameter_set):
    own = {entry.name: DEFAULTS[entry.name] for entry in fields(parameter_set)}
    node = node_type(context=context, parameter_overrides=overrides(own))
    declared = {name for name in PARAMETER_RULES if node.has_parameter(name)}
    assert declared == set(own)
    node.destroy_node()
    for name in own:
        given = {other: value for other, value in own.items() if other != name}
        with pytest.raises(MissingParameterError, match=f'^missing parameters: {name}; add --ros'):
            declare(context, parameter_set, **given)


def test_parameters_have_values_descriptions_and_are_read_only(context):
    given = {**DEFAULTS, 'max_velocity': 3, 'brick_start': [7, 6, 5]}
    node = Node('probe', context=context, parameter_overrides=overrides(given))
    assert declare_parameters(node, Parameters) == replace(
        load(), max_velocity=3.0, brick_start=(7.0, 6.0, 5.0))
    for name, rule in PARAMETER_RULES.items():
        descriptor, held = node.describe_parameter(name), node.get_parameter(name)
        assert descriptor.description == rule.description
        assert descriptor.additional_constraints == f'{name} must be {rule.allowed_values()}'
        (result,) = node.set_parameters([held])
        assert not result.successful and 'read-only' in result.reason
    node.destroy_node()


def test_invalid_value_is_reported_with_the_valid_range(context):
    with pytest.raises(ParameterError) as caught:
        declare(context, RobotParameters, max_velocity=3.0, wheel_radius=-1)
    assert str(caught.value) == 'wheel_radius is -1, but must be a number from 0.01 to 10 m'
