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
"""Check the style of the stand-ins and of the web page, and the types of the stand-ins."""

import os
from pathlib import Path

from ament_copyright.main import main as check_copyright
from ament_flake8.main import main_with_errors
from ament_pep257.main import main as check_docstrings
import pytest

EXTRAS = Path(__file__).parents[2]
TYPED = [str(path.parent) for path in sorted(EXTRAS.glob('standins/*/package.xml'))
         if any(path.parent.rglob('*.py'))]
ENVIRONMENT = os.environ.get('TURTLE_BRICK_ENVIRONMENT')
CACHE = os.path.join(ENVIRONMENT, 'mypy') if ENVIRONMENT else os.devnull
"""Cache directory of mypy."""

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


@pytest.mark.copyright
@pytest.mark.linter
def test_copyright():
    assert check_copyright(argv=FOLDERS) == 0


@pytest.mark.linter
@pytest.mark.mypy
def test_mypy():
    api = pytest.importorskip('mypy.api', reason='mypy is not installed')
    report, errors, status = api.run(
        ['--config-file', os.devnull, '--cache-dir', CACHE, '--ignore-missing-imports',
         '--warn-unused-ignores', '--disallow-untyped-defs', *TYPED])
    assert status == 0, report + errors
