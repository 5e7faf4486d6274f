# SPDX-License-Identifier: Apache-2.0
"""The command `ros2 param`."""

from __future__ import annotations

from ros2cli.command import CommandWithVerbs


class ParamCommand(CommandWithVerbs):
    """The command `ros2 param`."""

    verb_package = 'ros2param.verb'
    verbs = {
        'delete': 'Delete parameter',
        'describe': 'Show descriptive information about declared parameters',
        'dump': 'Show all of the parameters of a node in a YAML file format',
        'get': 'Get parameter',
        'list': 'Output a list of available parameters',
        'load': 'Load parameter file for a node',
        'set': 'Set parameter'}
