# SPDX-License-Identifier: Apache-2.0
"""Check the types in all packages with mypy."""

import os
from pathlib import Path

from mypy import api
import pytest

EXTRAS = Path(__file__).resolve().parents[2]
PACKAGES = [str(EXTRAS.parent / 'turtle_brick'), *(
    str(EXTRAS / name / name) for name in ('turtle_graph', 'turtle_brick_tools'))]
PROGRAMS = [str(EXTRAS.parent / 'scripts' / name)
            for name in ('make_environment.py', 'record_rviz', 'referee', 'website')]

ENVIRONMENT = os.environ.get('TURTLE_BRICK_ENVIRONMENT')
CACHE = os.path.join(ENVIRONMENT, 'mypy') if ENVIRONMENT else os.devnull
"""Cache directory of mypy."""


@pytest.mark.linter
@pytest.mark.mypy
def test_mypy(monkeypatch):
    # The packages import each other.
    monkeypatch.setenv('MYPYPATH', os.pathsep.join(map(str, (
        EXTRAS.parent, EXTRAS / 'turtle_graph', EXTRAS / 'turtle_brick_tools'))))
    report, errors, status = api.run(
        ['--config-file', os.devnull, '--cache-dir', CACHE, '--ignore-missing-imports',
         '--scripts-are-modules', '--warn-unused-ignores', *PACKAGES, *PROGRAMS])
    assert status == 0, report + errors
