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
"""The verb `pkg create`. The file templates.yaml contains the new files."""

import getpass
import os
from pathlib import Path
import shutil
import string
import subprocess
from xml.sax.saxutils import escape

import yaml

LICENSES = Path(__file__).with_name('licenses')
TEST_DEPENDS = {
    'ament_cmake': ('ament_lint_auto', 'ament_lint_common'),
    'ament_python': ('ament_copyright', 'ament_flake8', 'ament_pep257', 'python3-pytest')}


class Template(string.Template):
    """A text in which @name stands for a value."""

    delimiter = '@'


def git_email():
    """Return the email address of the user from Git, or an empty string."""
    return shutil.which('git') and subprocess.run(
        ['git', 'config', 'user.email'], stdout=subprocess.PIPE, text=True).stdout.strip()


def dependencies(tag, packages):
    """Return a paragraph for package.xml with one line for each package."""
    lines = ''.join(f'  <{tag}>{package}</{tag}>\n' for package in packages)
    return f'{lines}\n' if lines else ''


def template_values(args, executable):
    """Return the values of the names in the templates."""
    values = {
        'package': args.package_name, 'node': args.node_name, 'library': args.library_name,
        'format': args.package_format, 'build_type': args.build_type,
        'depends': dependencies('buildtool_depend', ['ament_cmake'] * (
            args.build_type == 'ament_cmake')) + dependencies('depend', args.dependencies)
        + dependencies('test_depend', TEST_DEPENDS[args.build_type]),
        'find_packages': ''.join(f'find_package({each} REQUIRED)\n' for each in args.dependencies),
        'target_dependencies': f'ament_target_dependencies(\n  {args.node_name}\n' + ''.join(
            f'  "{each}"\n' for each in args.dependencies) + ')\n' if args.dependencies else '',
        'console_scripts': f"            '{args.node_name} = {args.package_name}."
                           f"{args.node_name}:main'\n" if args.node_name else ''}
    for name in ('description', 'maintainer_name', 'maintainer_email', 'license'):
        value = getattr(args, name)
        values[name] = repr(value)
        values[f'xml_{name}'] = escape(value, {'"': '&quot;'})
    values['executable'] = Template(executable).substitute(values) if args.node_name else ''
    return values


def write_files(folder, templates, values):
    """Create the folders and files of the templates, and print their paths."""
    for path, text in templates.items():
        path = os.path.join(folder, Template(path).substitute(values))
        if path.endswith('/'):
            print(f'{text}\ncreating folder' if text else 'creating folder', path.rstrip('/'))
            os.makedirs(path, exist_ok=True)
        else:
            print('creating', path)
            Path(path).write_text(Template(text or '').substitute(values), encoding='utf-8')


def pkg_create(args):
    """Create a package that contains at most one executable."""
    licenses = sorted(path.name for path in LICENSES.iterdir())
    if args.license == '?':
        return print('Supported licenses:', *licenses, sep='\n')
    if args.build_type == 'cmake' or args.library_name and args.build_type == 'ament_cmake':
        return 'this stand-in for ros2cli creates neither libraries in C++ nor pure CMake packages'
    if (args.build_type, args.package_name) == ('ament_python', 'test'):
        return ("Aborted since 'ament_python' packages can't be named 'test'. Please choose a "
                'different package name.')
    folder = os.path.join(args.destination_directory, args.package_name)
    if os.path.exists(folder):
        return (f'\nAborted!\nThe directory already exists: {folder}\nEither remove the directory '
                'or choose a different destination directory or package name')
    args.maintainer_name = args.maintainer_name or getpass.getuser()
    args.maintainer_email = (
        args.maintainer_email or git_email() or f'{args.maintainer_name}@todo.todo')
    print('going to create a new package')
    for name, value in (
            ('package name', args.package_name),
            ('destination directory', os.path.abspath(args.destination_directory)),
            ('package format', args.package_format), ('version', '0.0.0'),
            ('description', args.description),
            ('maintainer', [f'{args.maintainer_name} <{args.maintainer_email}>']),
            ('licenses', [args.license]), ('build type', args.build_type),
            ('dependencies', args.dependencies), ('node_name', args.node_name),
            ('library_name', args.library_name)):
        if value is not None:
            print(f'{name}: {value}')
    templates = yaml.safe_load(
        Path(__file__).with_name('templates.yaml').read_text(encoding='utf-8'))
    values = template_values(args, templates['executable'])
    print('creating folder', folder)
    os.makedirs(folder)
    write_files(folder, templates[args.build_type], values)
    for option, name in (('node', args.node_name), ('library', args.library_name)):
        if name:
            write_files(folder, templates[f'{args.build_type} {option}'], values)
    if args.license in licenses:
        shutil.copy(LICENSES / args.license, os.path.join(folder, 'LICENSE'))
    else:
        print(f"\n[WARNING]: Unknown license '{args.license}'.  This has been set in the "
              'package.xml, but no LICENSE file has been created.\nIt is recommended to use one '
              'of the ament license identifiers:', *licenses, sep='\n')
