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
"""The summary of a test run counts every test once, and no empty or broken run is a success."""

import importlib.util
import os
from pathlib import Path
import subprocess
import sys

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / 'scripts' / 'report_tests.py'
_spec = importlib.util.spec_from_file_location('report_tests', SCRIPT)
report_tests = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(report_tests)

PASSED = '<testcase classname="a" name="passed"/>'
FAILED = '<testcase classname="a" name="failed"><failure message="no"/></testcase>'
ERROR = '<testcase classname="a" name="error"><error message="oh"/></testcase>'
SKIPPED = '<testcase classname="a.b" name="skipped[x]"><skipped message="no rviz2"/></testcase>'
CTEST = '<Site BuildName="x"><Testing/></Site>'


def suite(*cases):
    """Return a result file as pytest writes it."""
    return '<testsuites><testsuite name="s">' + ''.join(cases) + '</testsuite></testsuites>'


def run(folder):
    """Return the status and the lines of the program for a build folder."""
    done = subprocess.run([sys.executable, str(SCRIPT), str(folder)], stdout=subprocess.PIPE,
                          text=True)
    return done.returncode, done.stdout.splitlines()


@pytest.mark.parametrize('files, passed, failed, skipped', [
    ([], 0, 0, 0),
    ([suite()], 0, 0, 0),
    ([suite(PASSED)], 1, 0, 0),
    ([suite(PASSED, PASSED), suite(PASSED)], 3, 0, 0),
    ([suite(PASSED, FAILED)], 1, 1, 0),
    ([suite(PASSED, ERROR)], 1, 1, 0),
    ([suite(PASSED, SKIPPED, SKIPPED), suite(SKIPPED)], 1, 0, 3),
    ([suite(SKIPPED)], 0, 0, 1),
    ([suite(PASSED), '<testsuite><testca'], 1, 1, 0),
    ([suite(PASSED), CTEST], 1, 0, 0),
])
def test_counts_and_status(tmp_path, files, passed, failed, skipped):
    for number, text in enumerate(files):
        folder = tmp_path / f'package_{number}'
        folder.mkdir()
        (folder / 'pytest.xml').write_text(text)
    status, lines = run(tmp_path)
    assert lines[-1] == f'{passed} passed, {failed} failed, {skipped} skipped'
    cases = f' ({skipped} cases)' if skipped > 1 else ''
    assert lines[:-1] == [f'skipped: a.b.skipped{cases}: no rviz2'] * (skipped > 0)
    assert (status == 0) == (passed > 0 and failed == 0)


def test_the_reason_of_a_skipped_file_is_named(tmp_path):
    tests = tmp_path / 'source'
    tests.mkdir()
    (tests / 'test_one.py').write_text("""
import pytest
pytest.importorskip('no_such_module', reason="it's not here")
""")
    (tests / 'test_two.py').write_text("""
import pytest
pytest.skip('not now (really)', allow_module_level=True)
""")
    (tests / 'test_three.py').write_text('def test(): pass')
    results = tmp_path / 'results'
    subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', '--rootdir', str(tests),
         '-c', os.devnull, '--junit-xml', str(results / 'pytest.xml'), str(tests)],
        cwd=tests, env={'PYTEST_DISABLE_PLUGIN_AUTOLOAD': '1', **{
            name: value for name, value in os.environ.items() if name != 'PYTEST_ADDOPTS'}},
        stdout=subprocess.DEVNULL, check=True)
    status, lines = run(results)
    assert status == 0
    assert sorted(lines) == ['1 passed, 0 failed, 2 skipped', "skipped: test_one: it's not here",
                             'skipped: test_two: not now (really)']


def test_every_reason_is_named(tmp_path):
    (tmp_path / 'pytest.xml').write_text(suite(
        PASSED, SKIPPED, SKIPPED.replace('no rviz2', 'no launch'),
        SKIPPED.replace('a.b', 'c'), SKIPPED.replace(' message="no rviz2"', '')))
    assert run(tmp_path)[1][:-1] == [
        'skipped: a.b.skipped: no rviz2', 'skipped: a.b.skipped: no launch',
        'skipped: c.skipped: no rviz2', 'skipped: a.b.skipped: no reason given']
