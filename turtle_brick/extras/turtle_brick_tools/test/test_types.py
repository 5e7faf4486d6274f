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
