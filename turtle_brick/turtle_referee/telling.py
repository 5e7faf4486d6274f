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
from collections.abc import Sequence
from html import escape
from importlib.util import find_spec
from io import StringIO
import json
from math import isfinite
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from turtle_referee.rules import BROKEN, Judgement, KEPT, OPEN, Plot

COLORS = {KEPT: 'green', BROKEN: 'red', OPEN: 'yellow'}

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #1c2430; background: #f6f7f9; margin: 0; }
main { max-width: 1100px; margin: 0 auto; padding: 24px; }
h1 { font-size: 24px; margin: 0 0 4px; }
.sum { font-size: 18px; margin: 0 0 20px; }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(320px, 1fr)); gap: 12px; }
.plots figure { margin: 0; background: #fff; border: 1px solid #dde1e7; border-radius: 6px; }
.plots svg { width: 100%; height: auto; display: block; }
table { border-collapse: collapse; width: 100%; margin-top: 24px; background: #fff; }
td, th { text-align: left; vertical-align: top; padding: 6px 10px; border: 1px solid #dde1e7;
         overflow-wrap: break-word; }
td.mark { font-size: 18px; font-weight: bold; text-align: center; }
.words { color: #5b6675; font-style: italic; }
.green { color: #1a7f37; } .red { color: #c62828; } .yellow { color: #9a6700; }
@media (max-width: 700px) {
  main { padding: 8px; }
  td, th { padding: 4px 5px; font-size: 13px; }
}
"""


def summary(judgements: Sequence[Judgement]) -> str:
    """Return how many requirements are kept, broken and open, in words."""
    marks = Counter(judgement.mark for judgement in judgements)
    return f'{marks[KEPT]} {KEPT} kept, {marks[BROKEN]} {BROKEN} broken, {marks[OPEN]} {OPEN} open'


def not_kept(judgements: Sequence[Judgement]) -> list[str]:
    """Return a line for each requirement that is broken or open: a table is long."""
    return [f'{one.mark} {one.name}: {one.measured}' + f'; expected: {one.expected}' * (
        one.mark == BROKEN) for one in judgements if one.mark != KEPT]


def print_table(judgements: Sequence[Judgement], console: Console | None = None) -> None:
    """Print a table, and the notes behind it."""
    table = Table(show_lines=False, pad_edge=False, box=None, header_style='bold')
    for title in ('', 'requirement', 'measured', 'expected'):
        table.add_column(title, overflow='fold')
    for one in judgements:
        table.add_row(f'[{COLORS[one.mark]}]{one.mark}[/]', *(
            words.replace('[', r'\[') for words in (one.name, one.measured, one.expected)))
    (console or Console()).print(table)


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


def page(judgements: Sequence[Judgement], about: dict[str, Any]) -> str:
    """Return a page that shows it all, in one file."""
    plots = [one.plot for one in judgements if one.plot is not None]
    figures = ''.join(f'<figure>{draw(plot)}</figure>' for plot in plots) if find_spec(
        'matplotlib') else '<p>The plots need matplotlib.</p>'
    rows = ''.join(
        f'<tr><td class="mark {COLORS[one.mark]}">{one.mark}</td>'
        f'<td>{escape(one.name)}<br><span class="words">{escape(one.words)}</span></td>'
        f'<td>{escape(one.measured)}</td><td>{escape(one.expected)}</td></tr>'
        for one in judgements)
    told = ', '.join(f'{escape(str(value))} {escape(str(key))}' for key, value in about.items()
                     if not isinstance(value, (dict, list)))
    return (f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
            f'<meta name="viewport" content="width=device-width"><title>turtle_brick: referee'
            f'</title><style>{STYLE}</style></head><body><main><h1>turtle_brick: what was asked '
            f'for, and what was measured</h1><p class="sum">{summary(judgements)}</p>'
            f'<p>{told}</p><div class="plots">{figures}</div><table><tr><th></th>'
            f'<th>requirement</th><th>measured</th><th>expected</th></tr>{rows}</table>'
            '</main></body></html>\n')


def write(judgements: Sequence[Judgement], about: dict[str, Any], json_path: Path | None,
          page_path: Path | None) -> None:
    """Write the files that are asked for."""
    if json_path is not None:
        json_path.write_text(as_json(judgements, about), encoding='utf-8')
    if page_path is not None:
        page_path.write_text(page(judgements, about), encoding='utf-8')
