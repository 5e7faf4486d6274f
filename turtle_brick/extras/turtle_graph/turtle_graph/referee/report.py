# SPDX-License-Identifier: Apache-2.0
"""Report the judgments on one graph (as text, HTML and JSON)."""

from collections import Counter
from collections.abc import Iterable, Sequence
from html import escape
from io import StringIO
import json
from pathlib import Path
from time import strftime
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text
from turtle_graph.client.processes import printable
from turtle_graph.referee.rules.rule import FAILED, Judgment, MET, OPEN, Plot

UNJUDGED = {
    'build': ('Your code must pass colcon test', 'colcon builds the workspace'),
    'start': ('all the nodes necessary for the turtle to catch a brick',
              'a launch file starts a graph')}
"""The requirements that a workspace without a judged graph does not meet, with their texts."""
INCOMPLETE = 'interrupted, so some requirements were not tested'
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
    return sum(judgment.loaded for judgment in judgments)


def result(judgment: Judgment) -> str:
    """Return a judgment's measured result and the failed requirements that may have caused it."""
    causes = f'may follow from: {", ".join(judgment.follows)}' if judgment.follows else ''
    return '; '.join(filter(None, (judgment.measured, causes)))


def fold(judgments: Iterable[Judgment]) -> list[Judgment]:
    """Merge all failures with the same causes and all open requirements with the same reason."""
    groups: dict[Any, list[Judgment]] = {}
    for judgment in judgments:
        reason = judgment.measured if judgment.mark == OPEN else judgment.name
        groups.setdefault((judgment.mark, tuple(judgment.follows) or reason), []).append(judgment)
    return [merge(group) for group in groups.values()]


def merge(group: Sequence[Judgment]) -> Judgment:
    """Merge judgments with the same mark and the same causes or reason."""
    first = group[0]
    if len(group) == 1:
        return first
    names = ', '.join(judgment.name for judgment in group)
    measured = '' if first.follows else first.measured
    return Judgment(names, '', '', first.mark, measured, follows=first.follows)


def print_table(titles: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Print a table in which the marks (✔, ✗ and –) are colored."""
    table = Table(pad_edge=False, box=None, header_style='bold')
    for title in titles:
        table.add_column(title, overflow='fold')
    for row in rows:
        table.add_row(*(Text(printable(str(cell)), COLORS.get(str(cell), '')) for cell in row))
    Console().print(table)


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
    print(printable(about['machine']))
    for crash in about['crashes']:
        print(printable(f'{FAILED} {crash}'))
    for note in about['notes']:
        print(printable(f'note: {note}'))
    rows = fold(judgments)
    print_table(('', 'requirement', 'measured', 'expected'), (
        (row.mark, row.name, result(row), row.expected) for row in rows))
    print()
    for row in rows:
        if row.mark != MET:
            print(printable(f'{row.mark} {row.name}: {result(row)}'))
    print(tally(judgment.mark for judgment in judgments))
    if count := left_open(judgments):
        print(f'{count} {OPEN} open because {about["load"]}: judge again on an idle machine')
    judged = sum(judgment.mark != OPEN for judgment in judgments)
    print(f'ROS domain {about["domain"]}: {judged} of {len(judgments)} requirements were judged')


def write(path: Path, text: str) -> None:
    """Write a file under another name and rename it, so that it is never incomplete."""
    unfinished = path.with_name(f'.{path.name}.unfinished')
    unfinished.write_text(text, encoding='utf-8', errors='replace')
    unfinished.replace(path)


def as_json(judgments: Sequence[Judgment], about: dict[str, Any]) -> str:
    """Return all judgments (without plots) and information about the run as JSON."""
    requirements = [judgment._replace(plot=None)._asdict() for judgment in judgments]
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
        return ', '.join(f'{name} {content}' for name, content in value.items())
    return '; '.join(value) if isinstance(value, list) else str(value)


def page(judgments: Sequence[Judgment], about: dict[str, Any]) -> str:
    """Return an HTML page with all judgments and plots."""
    facts = ''.join(f'<p>{escape(key)}: {escape(as_text(value))}</p>'
                    for key, value in about.items() if value)
    table = html_table(('', 'requirement', 'assignment', 'measured', 'expected'), (
        (judgment.mark, Html(f'<span id="{escape(judgment.name)}">{escape(judgment.name)}</span>'),
         judgment.sentence, result(judgment), judgment.expected) for judgment in judgments))
    counts = tally(judgment.mark for judgment in judgments)
    plots = ''.join(draw(judgment.plot) for judgment in judgments if judgment.plot is not None)
    return html_page(
        f'{escape(about.get("student") or "turtle_brick")}: requirements and measurements',
        f'<p>{counts}</p>{facts}{table}{plots}')
