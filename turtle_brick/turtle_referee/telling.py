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

"""How judgements are told: a table on the terminal, JSON, and a page with plots. No ROS."""

from collections import Counter
from collections.abc import Iterable, Sequence
from html import escape
from io import StringIO
import json
from math import isfinite
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text
from turtle_referee.rules import BROKEN, Judgement, KEPT, OPEN, Plot

COLORS = {KEPT: 'green', BROKEN: 'red', OPEN: 'yellow'}

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #1c2430; background: #f6f7f9; margin: 0; }
main { max-width: 1100px; margin: 0 auto; padding: 24px; }
h1 { font-size: 24px; margin: 0 0 4px; }
.sum { font-size: 18px; margin: 0 0 8px; }
.plots { display: grid; gap: 12px; grid-template-columns:
         repeat(auto-fit, minmax(min(320px, 100%), 1fr)); }
.plots figure { margin: 0; background: #fff; border: 1px solid #dde1e7; border-radius: 6px; }
.plots svg { width: 100%; height: auto; display: block; }
table { border-collapse: collapse; width: 100%; margin: 24px 0; background: #fff; }
td, th { text-align: left; vertical-align: top; padding: 6px 10px; border: 1px solid #dde1e7; }
td:first-child { font-weight: bold; }
p, td:first-child, td:nth-child(n + 5), .tall td { overflow-wrap: anywhere; }
i { color: #5b6675; }
.green { color: #1a7f37; } .red { color: #c62828; } .yellow { color: #9a6700; }
@media (max-width: 700px) {
  main { padding: 8px; }
  td, th { padding: 4px 5px; font-size: 13px; }
  .tall th { display: none; }
  .tall tr { display: block; border-top: 1px solid #dde1e7; }
  .tall td { display: block; border: 0; padding: 2px 8px; }
  .tall td:first-child { float: left; }
  .tall td:last-child::before { content: "expected: "; }
}
"""


def tally(marks: Iterable[str]) -> str:
    """Return how many requirements are kept, broken and open, in words."""
    count = Counter(marks)
    return f'{count[KEPT]} {KEPT} kept, {count[BROKEN]} {BROKEN} broken, {count[OPEN]} {OPEN} open'


def found(one: Judgement) -> str:
    """Return what was measured, and from what else it may follow."""
    return one.measured + f'; may follow from: {", ".join(one.follows)}' * bool(one.follows)


def not_kept(judgements: Sequence[Judgement]) -> list[str]:
    """Return a line for each requirement that is broken or open: a table is long."""
    return [f'{one.mark} {one.name}: {found(one)}' + f'; expected: {one.expected}' * (
        one.mark == BROKEN) for one in judgements if one.mark != KEPT]


def print_table(titles: Sequence[str], rows: Iterable[Sequence[object]],
                console: Console | None = None) -> None:
    """Print a table."""
    table = Table(show_lines=False, pad_edge=False, box=None, header_style='bold')
    for title in titles:
        table.add_column(title, overflow='fold')
    for row in rows:
        table.add_row(*(Text(str(cell), COLORS.get(str(cell), '')) for cell in row))
    (console or Console()).print(table)


def print_judgements(judgements: Sequence[Judgement], console: Console | None = None) -> None:
    """Print what was found about each requirement."""
    print_table(('', 'requirement', 'measured', 'expected'), (
        (one.mark, one.name, found(one), one.expected) for one in judgements), console)


def as_json(judgements: Sequence[Judgement], about: dict[str, Any]) -> str:
    """Return everything as JSON, the points of the plots included."""
    def plain(value: Any) -> Any:
        if isinstance(value, float):
            return float(f'{value:.7g}') if isfinite(value) else None
        if isinstance(value, dict):
            return {key: plain(one) for key, one in value.items()}
        if hasattr(value, '_asdict'):
            return plain(value._asdict())
        return [plain(one) for one in value] if isinstance(value, (list, tuple, range)) else value

    return json.dumps({**plain(about), 'requirements': [plain(one) for one in judgements]},
                      indent=1, ensure_ascii=False) + '\n'


def draw(plot: Plot) -> str:
    """Return a plot as SVG."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure
    figure = Figure(figsize=(4.6, 3.1), layout='constrained')
    FigureCanvasSVG(figure)
    axes = figure.subplots()
    axes.plot(plot.line.x, plot.line.y, color='#8a94a3', linewidth=1.2, label=plot.line.label)
    for order, (series, color) in enumerate(zip(plot.points, ('#1565c0', '#e65100', '#2e7d32'))):
        step = max(len(series.x) // 60, 1)
        axes.plot(list(series.x)[::step], list(series.y)[::step], 'o', markersize=3.5,
                  color=color, label=series.label, zorder=5 - order)
    axes.set(title=plot.title, xlabel=plot.x_label, ylabel=plot.y_label)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(frameon=False, fontsize='small')
    axes.spines[['top', 'right']].set_visible(False)
    file = StringIO()
    figure.savefig(file, format='svg', metadata={'Date': None})
    return file.getvalue().partition('<svg')[2].join(('<svg', ''))


def html_table(titles: Sequence[str], rows: Iterable[Sequence[str]], kind: str = '') -> str:
    """Return a table of cells that are HTML already; a tall one has no columns on a phone."""
    return f'<table class="{kind}">' + ''.join(
        '<tr>' + ''.join(f'<{tag}>{cell}</{tag}>' for cell in row) + '</tr>'
        for tag, row in (('th', titles), *(('td', row) for row in rows))) + '</table>'


def html_mark(mark: str) -> str:
    """Return a mark in its color."""
    return f'<span class="{COLORS[mark]}">{mark}</span>'


def html_page(title: str, body: str) -> str:
    """Return a page in one file."""
    return (f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
            f'<meta name="viewport" content="width=device-width"><title>{title}</title>'
            f'<style>{STYLE}</style></head><body><main><h1>{title}</h1>{body}</main></body></html>'
            '\n')


def page(judgements: Sequence[Judgement], about: dict[str, Any]) -> str:
    """Return a page that shows it all, in one file."""
    plots = [one.plot for one in judgements if one.plot is not None]
    figures = ''.join(f'<figure>{draw(plot)}</figure>' for plot in plots)
    told = ''.join(f'<p>{escape(str(key))}: {escape(words)}</p>' for key, value in about.items()
                   if (words := in_words(value)))
    table = html_table(('', 'requirement', 'measured', 'expected'), (
        (html_mark(one.mark),
         f'<b>{escape(one.name)}</b><br><i>{escape(one.words)}</i>',
         escape(found(one)), escape(one.expected)) for one in judgements), 'tall')
    return html_page(
        'turtle_brick: what was asked for, and what was measured',
        f'<p class="sum">{tally(one.mark for one in judgements)}</p>{told}{table}'
        f'<div class="plots">{figures}</div>')


def in_words(value: Any) -> str:
    """Return a number, a text, or several."""
    if isinstance(value, dict):
        return ', '.join(f'{name} {one}' for name, one in value.items())
    return '; '.join(value) if isinstance(value, list) else str(value)
