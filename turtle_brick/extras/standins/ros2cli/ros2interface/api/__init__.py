# SPDX-License-Identifier: Apache-2.0
"""Functions that find interfaces."""

from __future__ import annotations

import argparse
import os

import ament_index_python as index

KINDS = {'Messages': 'msg', 'Services': 'srv', 'Actions': 'action'}
"""Folder of each kind of interfaces, keyed by heading."""


def add_kind_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options that select the kinds of interfaces."""
    parser.add_argument(
        '-m', '--only-msgs', action='store_true',
        help='Print out only the message types')
    parser.add_argument(
        '-s', '--only-srvs', action='store_true',
        help='Print out only the service types')
    parser.add_argument(
        '-a', '--only-actions', action='store_true',
        help='Print out only the action types')


def requested_kinds(args: argparse.Namespace) -> dict[str, str]:
    """Return the requested kinds of interfaces (default: all)."""
    kinds = {heading: kind for heading, kind in KINDS.items() if getattr(args, f'only_{kind}s')}
    return kinds or KINDS


def get_interfaces(package: str, kind: str) -> list[str]:
    """Return the sorted names of all interfaces of a given kind in a package."""
    if not index.has_resource('rosidl_interfaces', package):
        return []
    files = index.get_resource('rosidl_interfaces', package)[0].split()
    names = sorted({os.path.splitext(file)[0] for file in files})
    return [f'{package}/{name}' for name in names
            if name.startswith(f'{kind}/') and '_' not in name]


def complete_interface(prefix: str, parsed_args: argparse.Namespace,
                       **kwargs: object) -> list[str]:
    """Return the names of all interfaces."""
    return [name for package in index.get_resources('rosidl_interfaces')
            for kind in KINDS.values() for name in get_interfaces(package, kind)]
