# SPDX-License-Identifier: Apache-2.0
"""The command `ros2 daemon`."""

from __future__ import annotations

from ros2cli.command import CommandWithVerbs


class DaemonCommand(CommandWithVerbs):
    """The command `ros2 daemon`."""

    verb_package = 'ros2cli.verb.daemon'
    verbs = {
        'status': 'Output the status of the daemon',
        'stop': 'Stop the daemon if it is running'}
