# SPDX-License-Identifier: Apache-2.0
"""Functions that find packages and their files."""

from __future__ import annotations

import argparse
import os

import ament_index_python as index


def get_absence(package: str) -> str | None:
    """Return why this environment lacks a package of ROS 2, or None for any other package."""
    if package in index.get_resources('absent_packages'):
        return index.get_resource('absent_packages', package)[0]
    return None


def get_executable_paths(package: str) -> list[str]:
    """
    Return the sorted paths of the executables in a package.

    :raises RuntimeError: if there is no such package
    """
    try:
        folder = os.path.join(index.get_package_prefix(package), 'lib', package)
    except (index.PackageNotFoundError, ValueError):
        raise RuntimeError(
            get_absence(package) or f"Package '{package}' not found") from None
    paths = (os.path.join(root, name) for root, _, names in os.walk(folder) for name in names)
    return sorted(path for path in paths
                  if os.access(path, os.X_OK) and '/.' not in os.path.dirname(path)[len(folder):])


def complete_package_name(prefix: str, parsed_args: argparse.Namespace,
                          **kwargs: object) -> list[str]:
    """Return the names of all packages."""
    return list(index.get_packages_with_prefixes())


def complete_executable_name(prefix: str, parsed_args: argparse.Namespace,
                             **kwargs: object) -> list[str]:
    """Return the names of the executables in the package on the command line."""
    return [os.path.basename(path) for path in get_executable_paths(parsed_args.package_name)]
