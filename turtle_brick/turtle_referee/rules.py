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

"""
How a requirement is judged: a rule takes what was heard and says what it finds. No ROS.

A rule that returns has found the requirement kept or broken. It raises `Broken` where something
is not there that the assignment asks for, and `Open` where nothing can be said.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy
from turtle_referee.record import Record

Thing = TypeVar('Thing')

KEPT, BROKEN, OPEN = '✔', '✗', '–'


class Broken(Exception):
    """The requirement is broken; the text says how."""


class Open(Exception):
    """The requirement can't be judged; the text says why."""


class Series(NamedTuple):
    """Some points of a plot."""

    label: str
    x: Sequence[float]
    y: Sequence[float]


class Plot(NamedTuple):
    """Measured points, and the line that they should be on."""

    title: str
    x_label: str
    y_label: str
    points: Sequence[Series]
    line: Series


class Finding(NamedTuple):
    """What a rule has found."""

    kept: bool
    measured: str
    plot: Plot | None = None


class Judgement(NamedTuple):
    """A requirement, what is expected, and what was found."""

    name: str
    words: str
    expected: str
    mark: str
    measured: str
    plot: Plot | None = None


@dataclass(frozen=True)
class Rule:
    """A requirement, and how it is judged."""

    name: str
    words: str
    expected: str
    judge: Callable[[Record], Finding]
    timely: bool
    """Whether a machine without time can be what breaks it."""

    def __call__(self, record: Record) -> Judgement:
        """Judge what was heard."""
        found = self._look(record)
        if found.mark == BROKEN and self.timely:
            busy = record.stood_still(record.busy_spans())
            # What is broken also while the machine had time is broken.
            if busy and self._look(record.while_calm()).mark != BROKEN:
                return found._replace(mark=OPEN, measured=f'{found.measured}; not judged: {busy}')
        return found

    def _look(self, record: Record) -> Judgement:
        """Judge what was heard, whether the machine had time or not."""
        plot = None
        try:
            with numpy.errstate(all='ignore'):
                kept, measured, plot = self.judge(record)
            mark = KEPT if kept else BROKEN
        except Broken as error:
            mark, measured = BROKEN, str(error)
        except Open as error:
            mark, measured = OPEN, str(error)
        except (ArithmeticError, AssertionError, AttributeError, LookupError, TypeError,
                ValueError) as error:
            # Whatever an implementation says, this is no reason to fall silent about the rest.
            mark = BROKEN
            measured = f'what was heard makes no sense ({type(error).__name__}: {error})'
        return Judgement(self.name, self.words, self.expected, mark, measured, plot)


class Rules(list[Rule]):
    """Rules, in their order."""

    def rule(self, name: str, words: str, expected: str, timely: bool = False,
             ) -> Callable[[Callable[[Record], Finding]], Callable[[Record], Finding]]:
        """
        Make a rule of a function.

        :param name: what to call it
        :param words: the requirement, in the words of the assignment
        :param expected: what is demanded, in numbers
        :param timely: whether a machine without time can be what breaks it
        """
        def add(judge: Callable[[Record], Finding]) -> Callable[[Record], Finding]:
            self.append(Rule(name, words, expected, judge, timely))
            return judge
        return add


def number(record: Record, name: str) -> float:
    """Return a number of the robot; Open if it is not known."""
    try:
        return record.profile.numbers[name]
    except KeyError:
        raise Open(f'{name} is not known: no node has it as a parameter; give a parameter file '
                   'or --set') from None


def some(things: list[Thing], words: str) -> list[Thing]:
    """Return things; Open, with words, if there are none."""
    if not things:
        raise Open(words)
    return things


def needed(thing: Thing | None, words: str) -> Thing:
    """Return what there is; Broken, with words, if it is not there."""
    if thing is None:
        raise Broken(words)
    return thing


def worst(values: Iterable[float]) -> float:
    """Return the greatest of some values, NaN if one is: nothing is above what is no number."""
    values = list(values)
    return next((value for value in values if value != value), max(values, default=0.0))
