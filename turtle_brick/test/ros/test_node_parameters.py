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

"""Test the parameter declarations of each node."""

from dataclasses import asdict, replace

import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter
from turtle_brick.arena import Arena
from turtle_brick.catcher import CatcherNode
from turtle_brick.core.parameters import load, MissingParameterError, PARAMETER_RULES
from turtle_brick.ros.node_parameters import declare_parameters
from turtle_brick.turtle_robot import TurtleRobot

DEFAULTS = {name: list(value) if isinstance(value, tuple) else value
            for name, value in asdict(load()).items()}


def overrides(values):
    return [Parameter(name, value=value) for name, value in values.items()]


def probe(live, values):
    """Return a node with parameter overrides but without declared parameters."""
    return live.add(Node, parameters=False, node_name='probe', start_parameter_services=False,
                    parameter_overrides=overrides(values))


@pytest.mark.parametrize('node_type', [TurtleRobot, Arena, CatcherNode])
def test_each_node_declares_the_parameters(live, node_type):
    node = live.add(node_type, parameters=False, parameter_overrides=overrides(DEFAULTS))
    assert all(map(node.has_parameter, PARAMETER_RULES))


def test_missing_parameters_are_reported_with_the_file_and_the_node(live):
    node = probe(live, {'max_velocity': 3.0})
    with pytest.raises(MissingParameterError, match=(
            '^missing parameters: brick_size, .*. Add --ros-args --params-file .*, or if a '
            'parameter file was given, add a section for the node /.*probe or for /')):
        declare_parameters(node)


def test_parameters_have_values_descriptions_and_are_read_only(live):
    node = probe(live, {**DEFAULTS, 'max_velocity': 3, 'brick_start': [7, 6, 5]})
    assert declare_parameters(node) == replace(
        load(), max_velocity=3.0, brick_start=(7.0, 6.0, 5.0))
    for name, rule in PARAMETER_RULES.items():
        descriptor, held = node.describe_parameter(name), node.get_parameter(name)
        assert descriptor.description == rule.description
        assert descriptor.additional_constraints == f'{name} must be {rule.allowed_values()}'
        (result,) = node.set_parameters([held])
        assert not result.successful and 'read-only' in result.reason
