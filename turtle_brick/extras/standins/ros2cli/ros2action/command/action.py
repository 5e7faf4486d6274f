# SPDX-License-Identifier: Apache-2.0
"""The command `ros2 action`."""

from __future__ import annotations

from ros2cli.command import CommandWithVerbs


class ActionCommand(CommandWithVerbs):
    """The command `ros2 action`."""

    verb_package = 'ros2action.verb'
    verbs = {
        'info': 'Print information about an action',
        'list': 'Output a list of action names',
        'send_goal': 'Send an action goal',
        'type': "Print a action's type"}
