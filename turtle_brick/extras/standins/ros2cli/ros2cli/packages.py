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
"""Commands for installed packages: run, launch, pkg and interface."""

import os
from pathlib import Path
import shlex
import signal
import subprocess
import sys
from xml.etree import ElementTree

import ament_index_python as index
from rosidl_adapter.parser import parse_message_string
from turtle_graph.client.children import end_with_parent


def absence(package):
    """Return why this environment lacks a package of ROS 2, or None for any other package."""
    if package in index.get_resources('absent_packages'):
        return index.get_resource('absent_packages', package)[0]
    return None


def executables(package):
    """Return the sorted paths of the executables in a package."""
    try:
        folder = os.path.join(index.get_package_prefix(package), 'lib', package)
    except (index.PackageNotFoundError, ValueError):
        raise RuntimeError(absence(package) or f"Package '{package}' not found") from None
    paths = (os.path.join(root, name) for root, _, names in os.walk(folder) for name in names)
    return sorted(path for path in paths
                  if os.access(path, os.X_OK) and '/.' not in os.path.dirname(path)[len(folder):])


def pkg_executables(args):
    given = args.package_name is not None
    for package in sorted([args.package_name] if given else index.get_packages_with_prefixes()):
        for path in executables(package):
            print(path if args.full_path else f'{package} {os.path.basename(path)}')


def pkg_launch_files(args):
    for _, _, names in os.walk(index.get_package_share_directory(args.package_name)):
        for name in names:
            if name.endswith(('launch.py', 'launch.xml')):
                print(name)


def pkg_list(args):
    print(*sorted(index.get_packages_with_prefixes()), sep='\n')


def pkg_prefix(args):
    find = index.get_package_share_directory if args.share else index.get_package_prefix
    try:
        print(find(args.package_name))
    except (index.PackageNotFoundError, ValueError):
        return 'Package not found'


def pkg_xml(args):
    try:
        path = Path(index.get_package_share_directory(args.package_name), 'package.xml')
    except (index.PackageNotFoundError, ValueError):
        return 'Package not found'
    tree = ElementTree.parse(path)
    if args.tag is None:
        return ElementTree.dump(tree)
    elements = tree.getroot().findall(args.tag)
    for element in elements:
        print(element.text)
    return None if elements else 'XML tag not found'


def requested_kinds(args):
    """Return the requested interface kinds (default: all), for example {'Messages': 'msg'}."""
    kinds = {'Messages': 'msg', 'Services': 'srv', 'Actions': 'action'}
    return {heading: kind for heading, kind in kinds.items()
            if getattr(args, f'only_{kind}s')} or kinds


def interface_names(package, kind):
    """Return the sorted names of all interfaces of a given kind in a package."""
    if not index.has_resource('rosidl_interfaces', package):
        return []
    files = index.get_resource('rosidl_interfaces', package)[0].split()
    return [f'{package}/{name}' for name in sorted({os.path.splitext(file)[0] for file in files})
            if name.startswith(f'{kind}/') and '_' not in name]


def daemon_status(args):
    """Report that no daemon runs. Commands discover the ROS graph without a daemon."""
    print('The daemon is not running')


daemon_stop = daemon_status


def interface_list(args):
    for heading, kind in requested_kinds(args).items():
        print(f'{heading}:')
        for package in sorted(index.get_resources('rosidl_interfaces')):
            for name in interface_names(package, kind):
                print(f'    {name}')


def interface_package(args):
    if not index.has_resource('packages', args.package_name):
        return f"Unknown package '{args.package_name}'"
    for kind in requested_kinds(args).values():
        for name in interface_names(args.package_name, kind):
            print(name)


def interface_packages(args):
    for package in sorted(index.get_resources('rosidl_interfaces')):
        if any(interface_names(package, kind) for kind in requested_kinds(args).values()):
            print(package)


def interface_show(args):
    show(sys.stdin.readline().strip() if args.type == '-' else args.type, not args.no_comments,
         args.all_comments)


def show(name, comments, nested_comments, indent=''):
    """Print the definition of an interface and of the types that it contains."""
    parts = name.split('/')
    if len(parts) != 3:
        raise RuntimeError(f"Invalid name '{name}'. Expected three parts separated by '/'")
    prefix = index.has_resource('packages', parts[0] or ' ')
    if not prefix:
        raise RuntimeError(f"Unknown package '{parts[0]}'")
    path = Path(prefix, 'share', f'{name}.{parts[1]}')
    if not path.is_file():
        raise RuntimeError(f"Could not find the interface '{path.with_suffix('.idl')}'")
    for line in path.read_text(encoding='utf-8').splitlines():
        line = text = line.rstrip()
        spec = parse_message_string(parts[0], parts[2], '' if line == '---' else line)
        for entry in (*spec.fields, *spec.constants):
            if not comments and entry.annotations['comment']:
                text = line[:line.find(entry.annotations['comment'][0]) - 1].strip()
        if comments or line and not spec.annotations['comment']:
            print(f'{indent}{text}' if text else '')
        if spec.fields and spec.fields[0].type.pkg_name:
            nested = spec.fields[0].type
            show(f'{nested.pkg_name}/msg/{nested.type}', nested_comments, nested_comments,
                 indent + '\t')


def run(args):
    """Run an executable, forward signals to it, and return its exit status."""
    paths = [path for path in executables(args.package_name)
             if os.path.basename(path) == args.executable_name]
    if not paths:
        return 'No executable found'
    if len(paths) > 1:
        return '\n- '.join(['Multiple executables found:', *paths])
    child, received = None, []

    def forward(number, _):
        received.append(number)
        if child is not None:
            child.send_signal(number)

    signal.signal(signal.SIGINT, lambda *_: None)  # Ctrl-C also reaches the child.
    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, forward)
    child = subprocess.Popen([*shlex.split(args.prefix or ''), paths[0], *args.argv],
                             preexec_fn=end_with_parent)
    for number in received:  # These signals arrived before the child existed.
        child.send_signal(number)
    status = child.wait()
    if status < 0:
        print(f'[ros2run]: {signal.strsignal(-status)}')
    elif status > 0:
        print(f'[ros2run]: Process exited with failure {status}')
    return status


def launch(args):
    """Run a launch file, or print the arguments that it declares."""
    # The launch modules are slow to import and are used only here.
    from launch import LaunchDescription, LaunchService
    from launch.actions import IncludeLaunchDescription
    from launch.launch_description_sources import AnyLaunchDescriptionSource

    path, arguments = args.package_name, args.launch_arguments
    if not os.path.isfile(path):
        path = launch_file(path, args.launch_file_name)
    elif args.launch_file_name is not None:
        arguments = [args.launch_file_name, *arguments]
    if args.show_args:
        return show_arguments(path)
    if args.show_all_subprocesses_output:
        os.environ['OVERRIDE_LAUNCH_PROCESS_OUTPUT'] = 'both'
    values = {name: value for name, value in (
        ('launch-prefix', args.launch_prefix),
        ('launch-prefix-filter', args.launch_prefix_filter)) if value}
    for text in arguments:
        name, _, value = text.partition(':=')
        values[name] = value
        if not name or not value:
            return f"malformed launch argument '{text}', expected format '<name>:=<value>'"
    service = LaunchService(argv=arguments, debug=args.debug,
                            noninteractive=args.noninteractive or not sys.stdin.isatty())
    service.include_launch_description(LaunchDescription([IncludeLaunchDescription(
        AnyLaunchDescriptionSource(path), launch_arguments=values.items())]))
    return service.run()


def show_arguments(path):
    from launch.launch_description_sources import get_launch_description_from_any_launch_file

    try:
        description = get_launch_description_from_any_launch_file(path)
    except Exception as error:  # noqa: B902 -- a launch file can raise any exception
        return f'{type(error).__name__}: {error}'
    arguments = description.get_launch_arguments()
    print("Arguments (pass arguments as '<name>:=<value>'):")
    for each in arguments:
        print(f"\n    '{each.name}':\n        {each.description}")
        if each.default_value is not None:
            default = ' + '.join(part.describe() for part in each.default_value)
            print(f'        (default: {default})')
    if not arguments:
        print('\n  No arguments.')


def launch_file(package, name):
    """Return the path of a launch file in or below the share directory of a package."""
    try:
        share = index.get_package_share_directory(package)
    except index.PackageNotFoundError as error:
        raise RuntimeError(
            absence(package) or f"Package '{package}' not found: {error}") from None
    paths = [os.path.join(root, name) for root, _, names in os.walk(share) if name in names]
    where = f"in the share directory of package '{package}'"
    if not paths:
        raise RuntimeError(f"file '{name}' was not found {where} which is at '{share}'")
    if len(paths) > 1:
        raise RuntimeError(f"file '{name}' was found more than once {where}: {paths}")
    return paths[0]
