# SPDX-License-Identifier: Apache-2.0
"""Report the judgments on one graph or on a class of students (as text, HTML, JSON and CSV)."""

from collections import Counter
from collections.abc import Iterable, Sequence
import csv
from html import escape
from io import StringIO
import json
import os
from pathlib import Path
import sys
from textwrap import shorten
from time import strftime
from typing import Any
from urllib.parse import quote

from rich.console import Console
from rich.table import Table
from rich.text import Text
from turtle_graph.client.processes import printable
from turtle_graph.client.record import LOADED
from turtle_graph.referee.rules.rule import FAILED, Judgment, MET, OPEN, Plot

MAX_LENGTH, MAX_LINES = 400, 5
"""Maximum number of characters per line and of faults per student in the terminal."""
UNJUDGED = {
    'build': ('Your code must pass colcon test', 'colcon builds the workspace'),
    'start': ('all the nodes necessary for the turtle to catch a brick',
              'a launch file starts a graph')}
"""The requirements that a workspace without a judged graph does not meet, with their texts."""
INTERRUPTED = 'interrupted, so some requirements were not tested'
"""Note of an incomplete judgment."""
DATE = '%Y-%m-%d %H:%M %z'
COLORS = {MET: 'green', FAILED: 'red', OPEN: 'yellow'}

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #1c2430; background: #f6f7f9; }
main { max-width: 1400px; margin: 0 auto; overflow-wrap: anywhere; }
table { border-collapse: collapse; margin: 24px 0; background: #fff; }
td, th { text-align: left; vertical-align: top; padding: 6px 10px; border: 1px solid #dde1e7; }
th, td:nth-child(2) { overflow-wrap: normal; }
td[data-title=date], td[data-title="✗"], td[data-title="–"] { white-space: nowrap; }
td[data-title=student] { overflow-wrap: break-word; }
svg { width: 100%; max-width: 400px; height: auto; }
.green { color: #1a7f37; } .red { color: #c62828; } .yellow { color: #9a6700; }
@media (max-width: 700px) {
  th { display: none; }
  tr { display: block; border-top: 3px solid #dde1e7; }
  td { display: block; border: 0; padding: 2px 8px; }
  td::before { content: attr(data-title) " "; color: #5b6675; }
}
"""


class Html(str):
    """Text that is already HTML."""


def tally(marks: Iterable[str]) -> str:
    """Return the numbers of met, failed and open requirements as text."""
    count = Counter(marks)
    return f'{count[MET]} {MET} met, {count[FAILED]} {FAILED} failed, {count[OPEN]} {OPEN} open'


def left_open(judgments: Iterable[Judgment]) -> int:
    """Return the number of requirements that are open because of the load of the machine."""
    return sum(one.mark == OPEN and LOADED in one.measured for one in judgments)


def result(judgment: Judgment) -> str:
    """Return a judgment's measured result and the failed requirements that may have caused it."""
    causes = f'may follow from: {", ".join(judgment.follows)}' if judgment.follows else ''
    return '; '.join(filter(None, (judgment.measured, causes)))


def fold(judgments: Iterable[Judgment]) -> list[Judgment]:
    """Merge all failures with the same causes and all open requirements with the same reason."""
    groups: dict[Any, list[Judgment]] = {}
    for one in judgments:
        reason = one.measured if one.mark == OPEN else one.name
        groups.setdefault((one.mark, tuple(one.follows) or reason), []).append(one)
    return [group[0] if len(group) == 1 else Judgment(
        ', '.join(one.name for one in group), '', '', group[0].mark,
        '' if group[0].follows else group[0].measured, follows=group[0].follows)
        for group in groups.values()]


def print_table(titles: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Print a table in which the marks (✔, ✗ and –) are colored."""
    table = Table(pad_edge=False, box=None, header_style='bold')
    for title in titles:
        table.add_column(title, overflow='fold')
    for row in rows:
        table.add_row(*(Text(printable(str(cell)), COLORS.get(str(cell), '')) for cell in row))
    Console().print(table)


def link(text: str, address: str) -> Html:
    """Return an HTML link, or only the text if the address is empty."""
    return Html(f'<a href="{escape(address)}">{escape(text)}</a>' if address else escape(text))


def html_table(titles: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return an HTML table in which the marks (✔, ✗ and –) are colored."""
    def html(value: object) -> str:
        if isinstance(value, Html):
            return value
        return f'<span class="{COLORS.get(str(value), "")}">{escape(str(value))}</span>'

    head = ''.join(f'<th>{html(title)}</th>' for title in titles)
    lines = (''.join(f'<td data-title="{title}">{html(cell)}</td>'
                     for title, cell in zip(titles, row)) for row in rows)
    return f'<table><tr>{head}</tr>{"".join(f"<tr>{line}</tr>" for line in lines)}</table>'


def html_page(title: str, body: str) -> str:
    """Return a complete HTML page."""
    return (f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"/><title>{title}</title>'
            f'<meta name="viewport" content="width=device-width"/><style>{STYLE}</style></head>'
            f'<body><main><h1>{title}</h1>{body}</main></body></html>\n')


def print_judgments(judgments: Sequence[Judgment], about: dict[str, Any]) -> None:
    """Print the load, the crashes, the notes, all requirements, and the unmet requirements."""
    for line in (about['machine'], *(f'{FAILED} {crash}' for crash in about['crashes']),
                 *(f'note: {note}' for note in about['notes'])):
        print(printable(line))
    rows = fold(judgments)
    print_table(('', 'requirement', 'measured', 'expected'), (
        (one.mark, one.name, result(one), one.expected) for one in rows))
    print('', *(printable(f'{one.mark} {one.name}: {result(one)}')
                for one in rows if one.mark != MET),
          tally(one.mark for one in judgments), sep='\n')
    if count := left_open(judgments):
        print(f'{count} {OPEN} open because {about["load"]}: judge again on an idle machine')
    judged = sum(one.mark != OPEN for one in judgments)
    print(f'ROS domain {about["domain"]}: {judged} of {len(judgments)} requirements were judged')


def write(path: Path, text: str) -> None:
    """Write a file under another name and rename it, so that it is never incomplete."""
    unfinished = path.with_name(f'.{path.name}.unfinished')
    unfinished.write_text(text, encoding='utf-8', errors='replace')
    unfinished.replace(path)


def as_json(judgments: Sequence[Judgment], about: dict[str, Any]) -> str:
    """Return all judgments (without plots) and information about the run as JSON."""
    requirements = [one._replace(plot=None)._asdict() for one in judgments]
    return json.dumps({**about, 'requirements': requirements}, indent=1, ensure_ascii=False) + '\n'


def write_unjudged(path: Path, student: str, requirement: str, mark: str, reason: str) -> None:
    """Write the JSON file and the page of a student whose workspace could not be judged."""
    judgments = [Judgment(requirement, *UNJUDGED[requirement], mark, reason)]
    about = {'student': student, 'date': strftime(DATE), 'crashes': [], 'notes': [reason]}
    write(path, as_json(judgments, about))
    write(path.with_suffix('.html'), page(judgments, about))


def draw(plot: Plot) -> str:
    """Return a plot as SVG."""
    from matplotlib.figure import Figure
    figure = Figure(figsize=(4.6, 3.1), layout='constrained')
    axes = figure.subplots()
    axes.plot(*plot.expected, color='#8a94a3', label='expected')
    axes.plot(*(list(values)[::len(values) // 60 + 1] for values in plot.measured), 'o',
              markersize=3.5, label='measured')
    axes.set(title=plot.title, xlabel=plot.x_label, ylabel=plot.y_label)
    axes.legend(frameon=False, fontsize='small')
    file = StringIO()
    figure.savefig(file, format='svg', metadata={'Date': None})
    return '<svg' + file.getvalue().partition('<svg')[2]


def as_text(value: Any) -> str:
    """Return a number, string, list or dictionary as text."""
    if isinstance(value, dict):
        return ', '.join(f'{name} {one}' for name, one in value.items())
    return '; '.join(value) if isinstance(value, list) else str(value)


def page(judgments: Sequence[Judgment], about: dict[str, Any]) -> str:
    """Return an HTML page with all judgments and plots."""
    facts = ''.join(f'<p>{escape(key)}: {escape(as_text(value))}</p>'
                    for key, value in about.items() if value)
    table = html_table(('', 'requirement', 'assignment', 'measured', 'expected'), (
        (one.mark, Html(f'<span id="{escape(one.name)}">{escape(one.name)}</span>'),
         one.sentence, result(one), one.expected) for one in judgments))
    return html_page(
        f'{escape(about.get("student") or "turtle_brick")}: requirements and measurements',
        f'<p>{tally(one.mark for one in judgments)}</p>{facts}{table}'
        + ''.join(draw(one.plot) for one in judgments if one.plot is not None))


TITLES = ('student', MET, FAILED, OPEN, 'failed', 'open', 'date')

EXPLANATION = (
    f'The columns {MET}, {FAILED} and {OPEN} contain the numbers of met, failed and open '
    'requirements. The “failed” column omits requirements that may have failed only because '
    'another requirement failed. In the “open” column, each reason is in parentheses. The '
    'second table shows the number of students for each entry in the “failed” column.')


def read(path: Path, name: str) -> dict[str, Any]:
    """Return a summary of a student's JSON file, or raise ValueError if the file is invalid."""
    try:
        data = json.loads(path.read_text(encoding='utf-8'))
        judgments = [Judgment(**one) for one in data['requirements']]
        marks = {one.name: one.mark for one in judgments}
        causes = [one.name for one in judgments if one.mark == FAILED and not one.follows]
        is_judged = bool(marks) and not marks.keys() & UNJUDGED.keys()
        is_failed = not is_judged and OPEN not in marks.values()
        faults = data.get('crashes', []) + (data['notes'] if is_failed else [])
        reasons = fold(
            one._replace(measured='judge again on a less busy machine')
            if LOADED in one.measured else one for one in judgments if one.mark == OPEN)
        count = Counter(marks.values())
        return {'student': name, **{mark: count[mark] for mark in COLORS}, 'date': data['date'],
                'failed': '; '.join([*faults, *(causes if is_judged else [])]), **marks,
                'faults': faults, 'is_judged': is_judged,
                'open': '; '.join([*(note for note in data['notes'] if note == INTERRUPTED), *(
                    f'{one.name} ({one.measured})' for one in reasons)]), 'causes': causes}
    except (LookupError, OSError, TypeError, ValueError) as error:
        raise ValueError(f'{path} is not a JSON file from the referee: {error!r}') from None


def class_cells(row: dict[str, Any], address: str) -> list[object]:
    """Return the table cells for one student, with links to the student's page if it exists."""
    causes = [link(f'{FAILED} {name}', address and f'{address}#{quote(name)}')
              for name in row['causes']]
    return [link(row['student'], address), row[MET], link(str(row[FAILED]), address), row[OPEN],
            Html('<br>'.join([*map(escape, row['faults']), *causes])), row['open'], row['date']]


def print_student(row: dict[str, Any]) -> None:
    """Print the results of one student on a few lines."""
    counts = ', '.join(f'{row[mark]} {mark}' for mark in COLORS)
    lines = [f'{row["student"]}: {counts} ({row["date"]})',
             *(f'  {FAILED} {shorten(fault, MAX_LENGTH)}' for fault in row['faults'][:MAX_LINES])]
    for mark, text in ((FAILED, ', '.join(row['causes'])), (OPEN, row['open'])):
        lines += [f'  {mark} {shorten(text, MAX_LENGTH)}'] if text else []
    print(*map(printable, lines), sep='\n')


def summarize(directory: Path, requirements: Sequence[str], csv_path: Path | None,
              page_path: Path | None, students: Sequence[str] | None = None) -> int:
    """
    Summarize the JSON files below a directory in a table with one row per student.

    :param students: names of the JSON files without the suffix ".json" (default: all files)
    :return: exit status (0 if all files are valid, 1 if only some are valid, 2 if none is valid)
    """
    rows, faults, links = [], [], {}
    paths = (sorted(directory.rglob('*.json')) if students is None
             else [directory / f'{name}.json' for name in students])
    for path in paths:
        name, own = str(path.relative_to(directory).with_suffix('')), path.with_suffix('.html')
        try:
            rows.append(read(path, name))
        except ValueError as error:
            faults.append(f'skipped: {error}')
        if page_path is not None and own.exists():
            links[name] = quote(os.path.relpath(own, page_path.parent))
    rows.sort(key=lambda row: not row['is_judged'])
    for row in rows:
        print_student(row)
    if not rows and not faults:
        faults.append(f'there is no JSON file in {directory}')
    for fault in faults:
        print(printable(f'referee: {fault}'), file=sys.stderr)
    if csv_path is not None:
        with csv_path.open('w', newline='', encoding='utf-8', errors='replace') as file:
            lines = csv.DictWriter(file, (*TITLES, *requirements), '', 'ignore')
            lines.writeheader()
            lines.writerows(rows)
    if page_path is not None:
        count = Counter(name for row in rows for name in row['causes'])
        cells = [class_cells(row, links.get(row['student'], '')) for row in rows]
        write(page_path, html_page(
            'turtle_brick: the class', f'<p>{EXPLANATION}</p>' + html_table(TITLES, cells)
            + html_table(('failed', 'students'), count.most_common())
            + ''.join(f'<p>{escape(fault)}</p>' for fault in faults)))
    if not rows:
        return 2
    return 1 if faults else 0
