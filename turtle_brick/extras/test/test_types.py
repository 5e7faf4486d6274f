# SPDX-License-Identifier: Apache-2.0
"""Check the types in all packages, scripts and stand-ins with mypy."""

import os
from pathlib import Path

from mypy import api
import pytest

EXTRAS = Path(__file__).resolve().parents[1]
PACKAGES = [str(EXTRAS.parent / 'turtle_brick'), *(
    str(EXTRAS / name / name) for name in ('turtle_graph', 'turtle_brick_tools'))]
PROGRAMS = [*(str(EXTRAS.parent / 'scripts' / name)
              for name in ('make_environment', 'record_rviz', 'referee', 'website')),
            str(EXTRAS / 'website/web_arena.py')]
STANDINS = [str(path.parent) for path in sorted(EXTRAS.glob('standins/*/package.xml'))
            if any(path.parent.rglob('*.py'))]

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
         '--warn-unused-ignores', '--disallow-untyped-defs', '--check-untyped-defs',
         '--scripts-are-modules', *PACKAGES, *PROGRAMS, *STANDINS])
    assert status == 0, report + errors
