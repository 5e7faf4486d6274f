# SPDX-License-Identifier: Apache-2.0
"""The command `ros2 pkg`."""

from __future__ import annotations

from ros2cli.command import CommandWithVerbs


class PkgCommand(CommandWithVerbs):
    """The command `ros2 pkg`."""

    verb_package = 'ros2pkg.verb'
    verbs = {
        'create': 'Create a new ROS 2 package',
        'executables': 'Output a list of package specific executables',
        'list': 'Output a list of available packages',
        'prefix': 'Output the prefix path of a package',
        'xml': 'Output the XML of the package manifest or a specific tag'}
