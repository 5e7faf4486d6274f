# SPDX-License-Identifier: Apache-2.0
"""Test that the PyPI environment contains everything that its packages require."""

from importlib.metadata import distributions, version
from pathlib import Path
import sys
import sysconfig

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
import pytest

SCRIPTS = Path(__file__).resolve().parents[3] / 'scripts'
PACKAGES = Path(sysconfig.get_path('purelib'))

EXCEPTIONS = {
    ('ros-rosidl-parser', 'lark-parser'): 'its name before version 0.12; the module lark is there'}
"""Reasons why the environment lacks a requirement (values) of a distribution (keys)."""


def missing_requirements(packages):
    """Return (distribution, requirement) for each requirement that a folder does not meet."""
    found = [*distributions(path=[str(packages)])]
    versions = {canonicalize_name(each.metadata['Name']): each.version for each in found}
    missing = set()
    for each in found:
        for requirement in map(Requirement, each.requires or ()):
            # Without an extra, a requirement of an extra does not apply.
            if requirement.marker is None or requirement.marker.evaluate({'extra': ''}):
                version = versions.get(canonicalize_name(requirement.name))
                if version is None or not requirement.specifier.contains(version, True):
                    missing.add((canonicalize_name(each.metadata['Name']), requirement.name))
    return missing


def distribution(folder, name, version, *requirements):
    metadata = folder / f'{name}-{version}.dist-info/METADATA'
    metadata.parent.mkdir()
    lines = [f'Requires-Dist: {requirement}\n' for requirement in requirements]
    metadata.write_text(
        f'Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n{"".join(lines)}')


def test_missing_and_wrong_versions_are_found(tmp_path):
    distribution(tmp_path, 'viewer', '1.0', 'Images>=2', 'Numbers<2', 'plots; extra == "figures"',
                 'old; python_version < "3"')
    assert missing_requirements(tmp_path) == {('viewer', 'Images'), ('viewer', 'Numbers')}
    distribution(tmp_path, 'images', '2.1')
    distribution(tmp_path, 'numbers', '2.0')
    assert missing_requirements(tmp_path) == {('viewer', 'Numbers')}


in_pypi_environment = pytest.mark.skipif(
    PACKAGES.parents[3] != SCRIPTS.parents[1] / '.ros',
    reason='this is not the PyPI environment of this workspace')


@in_pypi_environment
def test_the_list_of_packages_is_closed():
    """Everything that the installed distributions declare as required is installed."""
    assert missing_requirements(PACKAGES) == set(EXCEPTIONS)


@in_pypi_environment
def test_numpy_has_the_version_in_jazzy():
    """Version 2 lacks names such as infty, and version 1 has no wheels for Python 3.13."""
    assert version('numpy').startswith('1.26.' if sys.version_info < (3, 13) else '2.')
