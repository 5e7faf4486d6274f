# SPDX-License-Identifier: Apache-2.0
"""The command `ros2 run`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
import shlex
import signal
import subprocess

from ros2cli.command import CommandExtension, Status
from ros2cli.helpers import complete_with
from ros2pkg.api import complete_executable_name, complete_package_name, get_executable_paths
from turtle_graph.client.children import end_with_parent, with_this_python


class RunCommand(CommandExtension):
    """Runs an executable in a package."""

    def add_arguments(self, parser: argparse.ArgumentParser, cli_name: str,
                      typed: Sequence[str]) -> None:
        parser.add_argument(
            '--prefix',
            help='Prefix command, which should go before the executable. Command must be wrapped '
            "in quotes if it contains spaces (e.g. --prefix 'gdb -ex run --args').")
        package_name = parser.add_argument('package_name', help='Name of the ROS package')
        complete_with(package_name, complete_package_name)
        executable_name = parser.add_argument('executable_name', help='Name of the executable')
        complete_with(executable_name, complete_executable_name)
        parser.add_argument('argv', nargs='...', help='Pass arbitrary arguments to the executable')

    def main(self, *, args: argparse.Namespace) -> Status:
        """Run the executable, forward signals to it, and return its exit status."""
        paths = [path for path in get_executable_paths(args.package_name)
                 if os.path.basename(path) == args.executable_name]
        if not paths:
            return 'No executable found'
        if len(paths) > 1:
            return '\n- '.join(['Multiple executables found:', *paths])
        child: subprocess.Popen[bytes] | None = None
        received: list[int] = []

        def forward(number: int, frame: object) -> None:
            received.append(number)
            if child is not None:
                child.send_signal(number)

        signal.signal(signal.SIGINT, lambda number, frame: None)  # Ctrl-C also reaches the child.
        for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
            signal.signal(number, forward)
        child = subprocess.Popen(
            [*shlex.split(args.prefix or ''), *with_this_python(paths[0]), *args.argv],
            preexec_fn=end_with_parent)
        for received_number in received:  # These signals arrived before the child existed.
            child.send_signal(received_number)
        status = child.wait()
        if status < 0:
            print(f'[ros2run]: {signal.strsignal(-status)}')
        elif status > 0:
            print(f'[ros2run]: Process exited with failure {status}')
        return status
