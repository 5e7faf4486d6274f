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

"""The parameters of a node: those of config/turtle.yaml that it uses, declared and read-only."""

from array import array
from dataclasses import fields
from itertools import pairwise
import sys

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from turtle_brick.core.parameters import (AnyParameterSet, default_path, MissingParameterError,
                                          PARAMETER_RULES, ParameterError, read)


def declare_parameters(node: Node, used: type[AnyParameterSet]) -> AnyParameterSet:
    """
    Declare the parameters that a node uses, read-only, and return their values.

    The values come from the node's parameter overrides (a parameter file, `-p name:=value`); there
    are no defaults.

    :param node: the node, on which none of them is declared yet
    :param used: the parameters
    :raises ParameterError: A value is missing or inadmissible.
    """
    given = {}
    for entry in fields(used):
        rule = PARAMETER_RULES[entry.name]
        # Of any type: 3 is as good as 3.0, and our rules refuse the rest, in their own words.
        value = node.declare_parameter(entry.name, None, ParameterDescriptor(
            description=rule.description,
            additional_constraints=f'{entry.name} must be {rule.expectation()}',
            dynamic_typing=True, read_only=True)).value
        if value is not None:
            given[entry.name] = value.tolist() if isinstance(value, array) else value
    try:
        return used.from_mapping(given)
    except ParameterError as error:
        raise _located(error, used) from None


def _located(error: ParameterError, used: type[AnyParameterSet]) -> ParameterError:
    """Return the error as the parameter file of this process has it, if it is in there."""
    missing = isinstance(error, MissingParameterError)
    for option, path in pairwise(sys.argv):
        if option == '--params-file':
            try:
                read(path, used)
            except ParameterError as found:
                if missing or str(found).endswith(str(error)):
                    return found
    hint = f'; add --ros-args --params-file {default_path()}' if missing else ''
    return type(error)(f'{error}{hint}')
