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

"""The parameters of every node: config/turtle.yaml, declared and read-only."""

from dataclasses import fields
from itertools import pairwise
import sys

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.node import Node
from turtle_brick.core.parameters import (default_path, from_mapping, load, meaning,
                                          MissingParameterError, ParameterError, Parameters)


def declare_parameters(node: Node) -> Parameters:
    """
    Declare the package's parameters on a node, read-only, and return their values.

    The values come from the node's parameter overrides (a parameter file, `-p name:=value`); there
    are no defaults. Integers are as good as floating-point numbers.

    :param node: The node, on which none of them is declared yet.
    :return: The values.
    :raises ParameterError: A value is missing or inadmissible.
    """
    # All overrides, also of names that are not declared; rclpy has no public access to them.
    given = dict(getattr(node, '_parameter_overrides', {}))
    for entry in fields(Parameters):
        # Untyped at first, so that our rules refuse an inadmissible value, not rclpy's.
        untyped = node.declare_parameter(
            entry.name, None, ParameterDescriptor(dynamic_typing=True))
        given.pop(entry.name, None)
        if untyped.value is not None:
            given[entry.name] = untyped.value
        node.undeclare_parameter(entry.name)
    try:
        parameters = from_mapping(given, node.get_logger().warning)
    except ParameterError as error:
        located = _located(error)
        if located is error and isinstance(error, MissingParameterError):
            located = MissingParameterError(
                f'{error}; add --ros-args --params-file {default_path()}')
        raise located from None
    for entry in fields(Parameters):
        rule = meaning(entry)
        descriptor = ParameterDescriptor(
            description=rule.description,
            additional_constraints=f'{entry.name} must be {rule.expectation()}',
            read_only=True)
        if rule.length == 1:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=rule.lower, to_value=rule.upper, step=0.0)]
        node.declare_parameter(
            entry.name, getattr(parameters, entry.name), descriptor, ignore_override=True)
    return parameters


def _located(error: ParameterError) -> ParameterError:
    """
    Find the parameter file of this process that an error is about.

    :param error: The error of a node.
    :return: The same with the file and the line, if there is one that has it.
    """
    for option, path in pairwise(sys.argv):
        if option == '--params-file':
            try:
                load(path)
            except ParameterError as found:
                if str(found).endswith(str(error)):
                    return found
    return error
