# SPDX-License-Identifier: Apache-2.0
"""Summarize the results of a class of students in a table (as text, HTML and CSV)."""

from collections import Counter
from collections.abc import Sequence
import csv
from html import escape
import json
import os
from pathlib import Path
import sys
from textwrap import shorten
from typing import Any
from urllib.parse import quote

from turtle_graph.client.processes import printable
from turtle_graph.referee.report import (COLORS, fold, Html, html_page, html_table, INCOMPLETE,
                                         UNJUDGED, write)
from turtle_graph.referee.rules.rule import FAILED, Judgment, MET, OPEN

MAX_LENGTH, MAX_LINES = 400, 5
"""Maximum number of characters per line and of faults per student in the terminal."""
TITLES = ('student', MET, FAILED, OPEN, 'failed', 'open', 'date')
"""Titles of the columns."""
EXPLANATION = (
    f'The columns {MET}, {FAILED} and {OPEN} contain the numbers of met, failed and open '
    'requirements. The “failed” column omits requirements that may have failed only because '
    'another requirement failed. In the “open” column, each reason is in parentheses. The '
    'second table shows the number of students for each entry in the “failed” column.')
"""Text above the table."""


def read(path: Path, student: str) -> dict[str, Any]:
    """Return the row for a student's JSON file, or raise ValueError if the file is invalid."""
    try:
        data = json.loads(path.read_text(encoding='utf-8'))
        judgments = [Judgment(**requirement) for requirement in data['requirements']]
        return make_row(student, judgments, data.get('crashes', []), data['notes'], data['date'])
    except (LookupError, OSError, TypeError, ValueError) as error:
        raise ValueError(f'{path} is not a JSON file from the referee: {error!r}') from None


def make_row(student: str, judgments: Sequence[Judgment], crashes: Sequence[str],
             notes: Sequence[str], date: str) -> dict[str, Any]:
    """Return the row for a student, with an entry for each title and for each requirement."""
    marks = {judgment.name: judgment.mark for judgment in judgments}
    count = Counter(marks.values())
    is_judged = bool(marks) and not marks.keys() & UNJUDGED.keys()
    causes = [judgment.name for judgment in judgments
              if judgment.mark == FAILED and not judgment.follows]
    faults = [*crashes, *([] if is_judged or count[OPEN] else notes)]
    still_open = [judgment._replace(measured='judge again on a less busy machine')
                  if judgment.loaded else judgment
                  for judgment in judgments if judgment.mark == OPEN]
    reasons = [INCOMPLETE] if INCOMPLETE in notes else []
    reasons += [f'{judgment.name} ({judgment.measured})' for judgment in fold(still_open)]
    return {
        'student': student, **{mark: count[mark] for mark in COLORS}, 'date': date,
        'failed': '; '.join([*faults, *(causes if is_judged else [])]),
        'open': '; '.join(reasons),
        **marks, 'faults': faults, 'causes': causes, 'is_judged': is_judged}


def link(text: str, address: str) -> Html:
    """Return an HTML link, or only the text if the address is empty."""
    return Html(f'<a href="{escape(address)}">{escape(text)}</a>' if address else escape(text))


def class_cells(row: dict[str, Any], address: str) -> list[object]:
    """Return the table cells for one student, with links to the student's page if it exists."""
    causes = [link(f'{FAILED} {name}', address and f'{address}#{quote(name)}')
              for name in row['causes']]
    return [link(row['student'], address), row[MET], link(str(row[FAILED]), address), row[OPEN],
            Html('<br>'.join([*map(escape, row['faults']), *causes])), row['open'], row['date']]


def class_page(rows: Sequence[dict[str, Any]], faults: Sequence[str], directory: Path,
               page: Path) -> str:
    """Return an HTML page with one row per student, and with the most frequent failures."""
    cells = []
    for row in rows:
        own_page = directory / f'{row["student"]}.html'
        address = quote(os.path.relpath(own_page, page.parent)) if own_page.exists() else ''
        cells.append(class_cells(row, address))
    count = Counter(name for row in rows for name in row['causes'])
    return html_page('turtle_brick: the class', ''.join([
        f'<p>{EXPLANATION}</p>', html_table(TITLES, cells),
        html_table(('failed', 'students'), count.most_common()),
        *(f'<p>{escape(fault)}</p>' for fault in faults)]))


def print_student(row: dict[str, Any]) -> None:
    """Print the results of one student on a few lines."""
    counts = ', '.join(f'{row[mark]} {mark}' for mark in COLORS)
    lines = [f'{row["student"]}: {counts} ({row["date"]})',
             *(f'  {FAILED} {shorten(fault, MAX_LENGTH)}' for fault in row['faults'][:MAX_LINES])]
    for mark, text in ((FAILED, ', '.join(row['causes'])), (OPEN, row['open'])):
        if text:
            lines.append(f'  {mark} {shorten(text, MAX_LENGTH)}')
    print(*map(printable, lines), sep='\n')


def summarize(directory: Path, requirements: Sequence[str], csv_path: Path | None,
              page_path: Path | None, students: Sequence[str] | None = None) -> int:
    """
    Summarize the JSON files below a directory in a table with one row per student.

    :param students: names of the JSON files without the suffix ".json" (default: all files)
    :return: exit status (0 if all files are valid, 1 if only some are valid, 2 if none is valid)
    """
    if students is None:
        students = [str(path.relative_to(directory).with_suffix(''))
                    for path in sorted(directory.rglob('*.json'))]
    rows, faults = [], []
    for student in students:
        try:
            rows.append(read(directory / f'{student}.json', student))
        except ValueError as error:
            faults.append(f'skipped: {error}')
    if not students:
        faults.append(f'there is no JSON file in {directory}')
    rows.sort(key=lambda row: not row['is_judged'])
    for row in rows:
        print_student(row)
    for fault in faults:
        print(printable(f'referee: {fault}'), file=sys.stderr)
    if csv_path is not None:
        with csv_path.open('w', newline='', encoding='utf-8', errors='replace') as file:
            writer = csv.DictWriter(file, (*TITLES, *requirements), '', 'ignore')
            writer.writeheader()
            writer.writerows(rows)
    if page_path is not None:
        write(page_path, class_page(rows, faults, directory, page_path))
    if not rows:
        return 2
    return 1 if faults else 0
