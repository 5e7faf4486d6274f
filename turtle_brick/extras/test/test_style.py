# SPDX-License-Identifier: Apache-2.0
"""Check the style and the licenses of everything beyond the assignment."""

from pathlib import Path

from ament_flake8.main import main_with_errors
from ament_pep257.main import main as check_docstrings
import pytest

EXTRAS = Path(__file__).parents[1]
LICENSE = '# SPDX-License-Identifier: Apache-2.0\n'


@pytest.mark.flake8
@pytest.mark.linter
def test_flake8():
    rc, errors = main_with_errors(argv=[str(EXTRAS)])
    assert rc == 0, '\n'.join(errors)


@pytest.mark.linter
@pytest.mark.pep257
def test_pep257():
    assert check_docstrings(argv=[str(EXTRAS)]) == 0


@pytest.mark.linter
def test_first_line_of_each_file_names_the_license():
    texts = {file: file.read_text() for file in EXTRAS.rglob('*.py')}
    assert any(texts.values())
    assert [file for file, text in texts.items() if text and not text.startswith(LICENSE)] == []


@pytest.mark.linter
def test_names_of_test_files_are_unique():
    """The real launch_testing imports each file at the top level."""
    names = [file.name for folder in (EXTRAS, EXTRAS.parent / 'test')
             for file in folder.rglob('test_*.py')]
    assert sorted(names) == sorted(set(names))
