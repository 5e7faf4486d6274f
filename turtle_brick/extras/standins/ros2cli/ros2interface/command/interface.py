# SPDX-License-Identifier: Apache-2.0
"""The command `ros2 interface`."""

from __future__ import annotations

from ros2cli.command import CommandWithVerbs


class InterfaceCommand(CommandWithVerbs):
    """The command `ros2 interface`."""

    verb_package = 'ros2interface.verb'
    verbs = {
        'list': 'List all interface types available',
        'package': 'Output a list of available interface types within one package',
        'packages': 'Output a list of packages that provide interfaces',
        'proto': 'Output an interface prototype',
        'show': 'Output the interface definition'}
