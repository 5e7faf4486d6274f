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

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from turtle_brick.core.parameters import (default_path, MissingParameterError, PARAMETER_RULES,
                                          Parameters)


def declare_parameters(node: Node) -> Parameters:
    """
    Declare all parameters in PARAMETER_RULES as read-only, and return their values.

    There are no defaults. The values come from a parameter file or from `-p name:=value`.

    :raises ParameterError: if a value is missing or invalid
    """
    values = {}
    for name, rule in PARAMETER_RULES.items():
        # Dynamic typing allows users to write 3 for 3.0. PARAMETER_RULES rejects all other types.
        value = node.declare_parameter(name, None, ParameterDescriptor(
            description=rule.description,
            additional_constraints=f'{name} must be {rule.allowed_values()}',
            dynamic_typing=True, read_only=True)).value
        if value is not None:
            values[name] = value.tolist() if isinstance(value, array) else value
    try:
        return Parameters.from_mapping(values)
    except MissingParameterError as error:
        raise MissingParameterError(
            f'{error}. Add --ros-args --params-file {default_path()}, or if a parameter file was '
            'given, check the spelling of the names in that file, and check that it contains a '
            f'section for the node {node.get_fully_qualified_name()} or for /**.') from None
