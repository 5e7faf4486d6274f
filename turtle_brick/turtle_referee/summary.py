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
"""What the referee has written about many workspaces, in one table. No ROS."""

from collections import Counter
from collections.abc import Iterable, Sequence
import csv
from html import escape
import json
import os
from pathlib import Path
import sys
from typing import NamedTuple

from turtle_referee import telling
from turtle_referee.record import STOOD_STILL
from turtle_referee.rules import BROKEN, KEPT, OPEN

TITLES = ('student', KEPT, BROKEN, OPEN, 'broken', 'open')


class Judged(NamedTuple):
    """What a JSON file of the referee says of a workspace."""

    path: Path
    name: str
    date: str
    marks: dict[str, str]
    """Of each requirement."""
    broken: list[str]
    """What is broken and does not follow from anything else, or why nothing was judged."""
    undecided: dict[str, list[str]]
    """What is open, by what to do about it."""

    def row(self) -> tuple[object, ...]:
        """Return what the table says."""
        count = Counter(self.marks.values())
        return self.name, count[KEPT], count[BROKEN], count[OPEN], ', '.join(self.broken), (
            '; '.join(f'{", ".join(names)} ({why})' for why, names in self.undecided.items()))


def read(path: Path, name: str) -> Judged:
    """
    Return what a file says.

    :param path: of the file
    :param name: whose it is
    :raises ValueError: it is not the referee's; the text says why
    """
    undecided: dict[str, list[str]] = {}
    try:
        told = json.loads(path.read_text(encoding='utf-8'))
        requirements = told['requirements']
        marks = {one['name']: one['mark'] for one in requirements}
        broken = [one['name'] for one in requirements
                  if one['mark'] == BROKEN and not one['follows']]
        for one in requirements:
            if one['mark'] == OPEN:
                undecided.setdefault('judge again on a quieter machine' if STOOD_STILL in (
                    one['measured']) else one['measured'], []).append(one['name'])
        return Judged(path, name, told['date'], marks, broken if marks else [
            'nothing judged', *told['notes']], undecided)
    except (LookupError, OSError, TypeError, ValueError) as error:
        raise ValueError(f'{path}: not what the referee writes: {error!r}') from None


def write_csv(path: Path, judged: Sequence[Judged], requirements: Sequence[str]) -> None:
    """Write a line for each workspace, with the mark of each requirement."""
    with path.open('w', newline='', encoding='utf-8') as file:
        lines = csv.writer(file)
        lines.writerow((*TITLES, 'date', *requirements))
        lines.writerows((*one.row(), one.date, *(one.marks.get(name, '') for name in requirements))
                        for one in judged)


def page(judged: Sequence[Judged], faults: Iterable[str], directory: Path) -> str:
    """Return a page, for a directory: who has kept what, and what most have not."""
    def linked(one: Judged) -> str:
        own = one.path.with_suffix('.html')
        link = f'<a href="{escape(os.path.relpath(own, directory))}">{escape(one.name)}</a>'
        return link if own.exists() else escape(one.name)

    count = Counter(name for one in judged if one.marks for name in one.broken)
    return telling.html_page('turtle_brick: the class', telling.html_table(TITLES, (
        (linked(one), *map(escape, map(str, one.row()[1:]))) for one in judged)) + (
        telling.html_table(('broken', 'students'), (
            (escape(name), str(students)) for name, students in count.most_common()))) + (
        ''.join(f'<p>{escape(fault)}</p>' for fault in faults)))


def summarize(directory: Path, requirements: Sequence[str], csv_path: Path | None,
              page_path: Path | None) -> int:
    """
    Tell of all JSON files below a directory, one row each.

    :param requirements: the names of those that are known, in their order
    :return: 0, or 1 if some file could not be read, or 2 if none could
    """
    judged, faults = [], []
    for path in sorted(directory.rglob('*.json')):
        try:
            judged.append(read(path, str(path.relative_to(directory).with_suffix(''))))
        except ValueError as error:
            faults.append(f'left out: {error}')
    requirements = list(dict.fromkeys((*requirements, *(name for one in judged
                                                        for name in one.marks))))
    telling.print_table(TITLES, map(Judged.row, judged))
    for fault in faults or [f'{directory}: no JSON file is there'] * (not judged):
        print(f'referee: {fault}', file=sys.stderr)
    if csv_path is not None:
        write_csv(csv_path, judged, requirements)
    if page_path is not None:
        page_path.write_text(page(judged, faults, page_path.parent), encoding='utf-8')
    return 2 if not judged else 1 if faults else 0
