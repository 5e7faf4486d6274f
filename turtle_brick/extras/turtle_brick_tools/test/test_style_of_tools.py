# SPDX-License-Identifier: Apache-2.0
"""Check the style of this package."""

from pathlib import Path

from ament_flake8.main import main_with_errors
from ament_pep257.main import main as check_docstrings
import pytest

FOLDERS = [str(Path(__file__).parents[1])]


@pytest.mark.flake8
@pytest.mark.linter
def test_flake8():
    rc, errors = main_with_errors(argv=FOLDERS)
    assert rc == 0, '\n'.join(errors)


@pytest.mark.linter
@pytest.mark.pep257
def test_pep257():
    assert check_docstrings(argv=FOLDERS) == 0
