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

"""Declare the node parameters defined in config/turtle.yaml."""

from array import array
from dataclasses import fields

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from turtle_brick.core.parameters import (AnyParameterSet, default_path, MissingParameterError,
                                          PARAMETER_RULES)


def declare_parameters(node: Node, parameter_set: type[AnyParameterSet]) -> AnyParameterSet:
    """
    Declare all parameters in a parameter set as read-only, and return their values.

    There are no defaults. The values come from a parameter file or from `-p name:=value`.

    :raises ParameterError: if a value is missing or invalid
    """
    values = {}
    for field in fields(parameter_set):
        rule = PARAMETER_RULES[field.name]
        # Dynamic typing accepts 3 instead of 3.0. PARAMETER_RULES rejects all other types.
        value = node.declare_parameter(field.name, None, ParameterDescriptor(
            description=rule.description,
            additional_constraints=f'{field.name} must be {rule.allowed_values()}',
            dynamic_typing=True, read_only=True)).value
        if value is not None:
            values[field.name] = value.tolist() if isinstance(value, array) else value
    try:
        return parameter_set.from_mapping(values)
    except MissingParameterError as error:
        raise MissingParameterError(
            f'{error}; add --ros-args --params-file {default_path()}') from None
