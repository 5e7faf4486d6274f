# SPDX-License-Identifier: Apache-2.0
"""The files of a new package, which `ros2 pkg create` writes."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
import os
from pathlib import Path
import shutil
import string
import subprocess
from xml.sax.saxutils import escape

import yaml

RESOURCE = Path(__file__).parents[1] / 'resource'
LICENSES = RESOURCE / 'licenses'

TEST_DEPENDS = {
    'ament_cmake': ('ament_lint_auto', 'ament_lint_common'),
    'ament_python': ('ament_copyright', 'ament_flake8', 'ament_pep257', 'python3-pytest')}
"""Packages that the tests of a new package require, keyed by build type."""


class Template(string.Template):
    """A text in which @name stands for a value."""

    delimiter = '@'


def get_licenses() -> list[str]:
    """Return the names of the licenses whose texts are available."""
    return sorted(path.name for path in LICENSES.iterdir())


def copy_license(name: str, folder: str) -> None:
    """Write the text of a license to a folder."""
    shutil.copy(LICENSES / name, os.path.join(folder, 'LICENSE'))


def get_git_email() -> str:
    """Return the email address of the user from Git, or an empty string."""
    if not shutil.which('git'):
        return ''
    done = subprocess.run(['git', 'config', 'user.email'], stdout=subprocess.PIPE, text=True)
    return done.stdout.strip()


def dependency_lines(tag: str, packages: Sequence[str]) -> str:
    """Return a paragraph for package.xml with one line for each package."""
    lines = ''.join(f'  <{tag}>{package}</{tag}>\n' for package in packages)
    return f'{lines}\n' if lines else ''


def template_values(args: argparse.Namespace, executable: str) -> dict[str, str]:
    """
    Return the values of the names in the templates.

    :param executable: template of the lines for an executable in CMakeLists.txt
    """
    buildtools = ['ament_cmake'] if args.build_type == 'ament_cmake' else []
    depends = (dependency_lines('buildtool_depend', buildtools)
               + dependency_lines('depend', args.dependencies)
               + dependency_lines('test_depend', TEST_DEPENDS[args.build_type]))
    quoted = ''.join(f'  "{package}"\n' for package in args.dependencies)
    values = {
        'package': args.package_name, 'node': args.node_name, 'library': args.library_name,
        'format': str(args.package_format), 'build_type': args.build_type, 'depends': depends,
        'find_packages': ''.join(
            f'find_package({package} REQUIRED)\n' for package in args.dependencies),
        'target_dependencies':
            f'ament_target_dependencies(\n  {args.node_name}\n{quoted})\n' if quoted else '',
        'console_scripts': ''}
    if args.node_name:
        values['console_scripts'] = (f"            '{args.node_name} = {args.package_name}."
                                     f"{args.node_name}:main'\n")
    for name in ('description', 'maintainer_name', 'maintainer_email', 'license'):
        value = getattr(args, name)
        values[name] = repr(value)
        values[f'xml_{name}'] = escape(value, {'"': '&quot;'})
    values['executable'] = Template(executable).substitute(values) if args.node_name else ''
    return values


def write_files(folder: str, templates: Mapping[str, str | None],
                values: Mapping[str, str]) -> None:
    """Create the folders and files of the templates, and print their paths."""
    for path, text in templates.items():
        path = os.path.join(folder, Template(path).substitute(values))
        if path.endswith('/'):
            print(f'{text}\ncreating folder' if text else 'creating folder', path.rstrip('/'))
            os.makedirs(path, exist_ok=True)
        else:
            print('creating', path)
            Path(path).write_text(Template(text or '').substitute(values), encoding='utf-8')


def create_files(folder: str, args: argparse.Namespace) -> None:
    """Write the files of a package, its executable and its library."""
    templates = yaml.safe_load((RESOURCE / 'templates.yaml').read_text(encoding='utf-8'))
    values = template_values(args, templates['executable'])
    write_files(folder, templates[args.build_type], values)
    if args.node_name:
        write_files(folder, templates[f'{args.build_type} node'], values)
    if args.library_name:
        write_files(folder, templates[f'{args.build_type} library'], values)
