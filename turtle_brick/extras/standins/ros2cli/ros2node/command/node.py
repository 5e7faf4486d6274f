# SPDX-License-Identifier: Apache-2.0
"""The command `ros2 node`."""

from __future__ import annotations

from ros2cli.command import CommandWithVerbs


class NodeCommand(CommandWithVerbs):
    """The command `ros2 node`."""

    verb_package = 'ros2node.verb'
    verbs = {
        'info': 'Output information about a node',
        'list': 'Output a list of available nodes'}
