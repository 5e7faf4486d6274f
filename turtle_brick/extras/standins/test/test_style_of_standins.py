# SPDX-License-Identifier: Apache-2.0
"""Check style and types of the stand-ins, style of the web page, and licenses of all extras."""

import os
from pathlib import Path

from ament_flake8.main import main_with_errors
from ament_pep257.main import main as check_docstrings
import pytest

EXTRAS = Path(__file__).parents[2]
TYPED = [str(path.parent) for path in sorted(EXTRAS.glob('standins/*/package.xml'))
         if any(path.parent.rglob('*.py'))]
ENVIRONMENT = os.environ.get('TURTLE_BRICK_ENVIRONMENT')
CACHE = os.path.join(ENVIRONMENT, 'mypy') if ENVIRONMENT else os.devnull
"""Cache directory of mypy."""

LICENSE = '# SPDX-License-Identifier: Apache-2.0\n'

FOLDERS = [str(EXTRAS / name) for name in ('standins', 'website')]


@pytest.mark.flake8
@pytest.mark.linter
def test_flake8():
    rc, errors = main_with_errors(argv=FOLDERS)
    assert rc == 0, '\n'.join(errors)


@pytest.mark.linter
@pytest.mark.pep257
def test_pep257():
    assert check_docstrings(argv=FOLDERS) == 0


@pytest.mark.linter
def test_first_line_of_each_file_names_the_license():
    texts = {file: file.read_text() for file in EXTRAS.rglob('*.py')}
    assert any(texts.values())
    assert [file for file, text in texts.items() if text and not text.startswith(LICENSE)] == []


@pytest.mark.linter
@pytest.mark.mypy
def test_mypy():
    api = pytest.importorskip('mypy.api', reason='mypy is not installed')
    report, errors, status = api.run(
        ['--config-file', os.devnull, '--cache-dir', CACHE, '--ignore-missing-imports',
         '--warn-unused-ignores', '--disallow-untyped-defs', *TYPED])
    assert status == 0, report + errors
