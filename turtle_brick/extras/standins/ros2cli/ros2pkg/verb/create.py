# SPDX-License-Identifier: Apache-2.0
"""The verb `ros2 pkg create`."""

from __future__ import annotations

import argparse
import getpass
import os

from ros2cli.command import Status
from ros2cli.verb import VerbExtension
from ros2pkg.api.create import copy_license, create_files, get_git_email, get_licenses


class CreateVerb(VerbExtension):
    """Creates a package that contains at most one executable."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        parser.add_argument('package_name', help='The package name')
        parser.add_argument(
            '--package-format', '--package_format', type=int, default=3, choices=[2, 3],
            help='The package.xml format.')
        parser.add_argument(
            '--description', default='TODO: Package description',
            help='The description given in the package.xml')
        parser.add_argument(
            '--license', default='TODO: License declaration',
            help='The license attached to this package; this can be an arbitrary string, but a '
            'LICENSE file will only be generated if it is one of the supported licenses '
            "(pass '?' to get a list)")
        parser.add_argument(
            '--destination-directory', default='.',
            help='Directory where to create the package directory')
        parser.add_argument(
            '--build-type', default='ament_cmake',
            choices=['cmake', 'ament_cmake', 'ament_python'],
            help='The build type to process the package with')
        parser.add_argument('--dependencies', nargs='+', default=[], help='list of dependencies')
        parser.add_argument(
            '--maintainer-email',
            help='email address of the maintainer of this package')
        parser.add_argument('--maintainer-name', help='name of the maintainer of this package')
        parser.add_argument('--node-name', help='name of the empty executable')
        parser.add_argument('--library-name', help='name of the empty library')

    def main(self, *, args: argparse.Namespace) -> Status:
        licenses = get_licenses()
        if args.license == '?':
            print('Supported licenses:', *licenses, sep='\n')
            return None
        if args.build_type == 'cmake' or args.library_name and args.build_type == 'ament_cmake':
            return ('this stand-in for ros2cli creates neither libraries in C++ nor pure CMake '
                    'packages')
        if args.build_type == 'ament_python' and args.package_name == 'test':
            return ("Aborted since 'ament_python' packages can't be named 'test'. Please choose a "
                    'different package name.')
        folder = os.path.join(args.destination_directory, args.package_name)
        if os.path.exists(folder):
            return (f'\nAborted!\nThe directory already exists: {folder}\nEither remove the '
                    'directory or choose a different destination directory or package name')
        args.maintainer_name = args.maintainer_name or getpass.getuser()
        args.maintainer_email = (
            args.maintainer_email or get_git_email() or f'{args.maintainer_name}@todo.todo')
        self._print_summary(args)
        print('creating folder', folder)
        os.makedirs(folder)
        create_files(folder, args)
        if args.license in licenses:
            copy_license(args.license, folder)
        else:
            print(f"\n[WARNING]: Unknown license '{args.license}'.  This has been set in the "
                  'package.xml, but no LICENSE file has been created.\nIt is recommended to use '
                  'one of the ament license identifiers:', *licenses, sep='\n')
        return None

    def _print_summary(self, args: argparse.Namespace) -> None:
        print('going to create a new package')
        print(f'package name: {args.package_name}')
        print(f'destination directory: {os.path.abspath(args.destination_directory)}')
        print(f'package format: {args.package_format}')
        print('version: 0.0.0')
        print(f'description: {args.description}')
        print(f"maintainer: ['{args.maintainer_name} <{args.maintainer_email}>']")
        print(f'licenses: {[args.license]}')
        print(f'build type: {args.build_type}')
        print(f'dependencies: {args.dependencies}')
        if args.node_name is not None:
            print(f'node_name: {args.node_name}')
        if args.library_name is not None:
            print(f'library_name: {args.library_name}')
