# SPDX-License-Identifier: Apache-2.0
"""The command `ros2 launch`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
import sys

from ros2cli.command import CommandExtension, Status
from ros2cli.helpers import complete_with, Unsupported
from ros2launch.api import (
    complete_launch_file_name, find_launch_file, print_arguments_of_launch_file)
from ros2pkg.api import complete_package_name


class LaunchCommand(CommandExtension):
    """Runs a launch file, or prints the arguments that it declares."""

    def add_arguments(self, parser: argparse.ArgumentParser, cli_name: str,
                      typed: Sequence[str]) -> None:
        parser.add_argument(
            '-n', '--noninteractive', action='store_true',
            help='Run the launch system non-interactively, with no terminal associated')
        parser.add_argument(
            '-d', '--debug', action='store_true',
            help='Put the launch system in debug mode, provides more verbose output.')
        group = parser.add_mutually_exclusive_group()
        group.add_argument(
            '-p', '--print', '--print-description', action=Unsupported, nargs=0,
            help='Print the launch description to the console without launching it.')
        group.add_argument(
            '-s', '--show-args', '--show-arguments', action='store_true',
            help='Show arguments that may be given to the launch file.')
        parser.add_argument(
            '-a', '--show-all-subprocesses-output', action='store_true',
            help="Show all launched subprocesses' output by overriding their output configuration "
            'using the OVERRIDE_LAUNCH_PROCESS_OUTPUT envvar.')
        parser.add_argument(
            '--launch-prefix',
            help='Prefix command, which should go before all executables. Command must be wrapped '
            "in quotes if it contains spaces (e.g. --launch-prefix 'xterm -e gdb -ex run "
            "--args').")
        parser.add_argument(
            '--launch-prefix-filter',
            help='Regex pattern for filtering which executables the --launch-prefix is applied to '
            'by matching the executable name.')
        package_name = parser.add_argument(
            'package_name',
            help='Name of the ROS package which contains the launch file')
        complete_with(package_name, complete_package_name)
        launch_file_name = parser.add_argument(
            'launch_file_name', nargs='?', help='Name of the launch file')
        complete_with(launch_file_name, complete_launch_file_name)
        parser.add_argument(
            'launch_arguments', nargs='*',
            help="Arguments to the launch file; '<name>:=<value>' (for duplicates, last one wins)")

    def main(self, *, args: argparse.Namespace) -> Status:
        # The modules of launch are slow to import.
        from launch import LaunchDescription, LaunchService
        from launch.actions import IncludeLaunchDescription
        from launch.launch_description_sources import AnyLaunchDescriptionSource

        path, arguments = args.package_name, args.launch_arguments
        if not os.path.isfile(path):
            path = find_launch_file(path, args.launch_file_name)
        elif args.launch_file_name is not None:
            arguments = [args.launch_file_name, *arguments]
        if args.show_args:
            return print_arguments_of_launch_file(path)
        if args.show_all_subprocesses_output:
            os.environ['OVERRIDE_LAUNCH_PROCESS_OUTPUT'] = 'both'
        values = {}
        if args.launch_prefix:
            values['launch-prefix'] = args.launch_prefix
        if args.launch_prefix_filter:
            values['launch-prefix-filter'] = args.launch_prefix_filter
        for text in arguments:
            name, _, value = text.partition(':=')
            if not name or not value:
                return f"malformed launch argument '{text}', expected format '<name>:=<value>'"
            values[name] = value
        service = LaunchService(argv=arguments, debug=args.debug,
                                noninteractive=args.noninteractive or not sys.stdin.isatty())
        service.include_launch_description(LaunchDescription([IncludeLaunchDescription(
            AnyLaunchDescriptionSource(path), launch_arguments=values.items())]))
        return service.run()
