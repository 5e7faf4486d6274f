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
"""Summarize the result files of a test run: `report_tests.py BUILD_FOLDER...`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path
import re
import sys
from typing import NamedTuple
from xml.etree import ElementTree


class Summary(NamedTuple):
    """The results of the tests."""

    passed: int
    """How many passed."""

    failed: int
    """How many failed; errors count as failures."""

    skipped: tuple[tuple[str, str], ...]
    """The name of each one that was skipped, and the reason."""


def reason_of(skip: ElementTree.Element) -> str:
    """
    Find out why a test was skipped.

    :param skip: Its element `skipped`.
    :return: The reason. For a file that was skipped as a whole, pytest has it in the text alone,
        as the last of ('file', line, 'Skipped: reason').
    """
    whole_file = re.search(r"""Skipped: (.*)['"]\)\s*$""", skip.text or '', re.DOTALL)
    if skip.get('message') == 'collection skipped' and whole_file:
        return whole_file.group(1)
    return skip.get('message') or (skip.text or '').strip() or 'no reason given'


def summarize(folders: Iterable[Path]) -> Summary:
    """
    Read the JUnit files that pytest and ctest leave in the build folders of packages.

    :param folders: The build folders.
    :return: The results. A file that cannot be read counts as one failed test.
    """
    passed = failed = 0
    skipped = []
    for path in sorted(path for folder in folders for path in folder.rglob('*.xml')):
        try:
            root = ElementTree.parse(path).getroot()
        except ElementTree.ParseError:
            failed += 1
            continue
        if root.tag not in ('testsuite', 'testsuites'):
            continue
        for case in root.iter('testcase'):
            if case.find('failure') is not None or case.find('error') is not None:
                failed += 1
            elif (skip := case.find('skipped')) is not None:
                name = '.'.join(filter(None, (case.get('classname'), case.get('name'))))
                skipped.append((name, reason_of(skip)))
            else:
                passed += 1
    return Summary(passed, failed, tuple(skipped))


def main() -> int:
    """
    Print the skipped tests with the reason, one line for all cases of a test, then the counts.

    :return: The status of the process: 0 if nothing failed and something passed.
    """
    passed, failed, skipped = summarize(map(Path, sys.argv[1:]))
    cases = Counter((name.partition('[')[0], reason) for name, reason in skipped)
    for (name, reason), count in cases.items():
        print(f'skipped: {name}{f" ({count} cases)" if count > 1 else ""}: {reason}')
    print(f'{passed} passed, {failed} failed, {len(skipped)} skipped')
    return 0 if passed and not failed else 1


if __name__ == '__main__':
    sys.exit(main())
