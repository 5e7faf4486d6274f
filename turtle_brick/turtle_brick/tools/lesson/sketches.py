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

"""What the lesson's sketches are drawn with: a picture without axes, arrows with words."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from matplotlib.axes import Axes
from turtle_brick.tools.plots import drawn, INK

Point = tuple[float, float]


@contextmanager
def sketched(path: Path, width: float, height: float, x: Point, y: Point) -> Iterator[Axes]:
    """Draw a picture of a width and a height (inches) to scale, within these limits (m)."""
    with drawn(path, width, height) as figure:
        axes = figure.subplots()
        axes.axis('off')
        axes.set(aspect='equal', xlim=x, ylim=y)
        yield axes


def arrow(axes: Axes, begin: Point, end: Point, words: str = '', offset: Point = (0.0, 0.0),
          color: str = INK, style: str = '-|>', bend: float = 0.0) -> None:
    """
    Draw an arrow, with words at its middle.

    :param offset: of the words from there (points)
    :param style: matplotlib's: '<|-|>' measures a length, '-' is a line
    :param bend: how far it is bent to its right, as a part of its length
    """
    axes.annotate('', end, begin, zorder=5, arrowprops={
        'arrowstyle': style, 'color': color, 'linewidth': 1.8, 'shrinkA': 0.0, 'shrinkB': 0.0,
        'connectionstyle': f'arc3,rad={bend}'})
    axes.annotate(words, ((begin[0] + end[0]) / 2.0, (begin[1] + end[1]) / 2.0), xytext=offset,
                  textcoords='offset points', color=color, ha='center', va='center', zorder=6)
