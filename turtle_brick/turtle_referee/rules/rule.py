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

from collections.abc import Callable, Iterable, Mapping, Sequence
import re
from typing import NamedTuple, TypeVar

import numpy
from turtle_referee.graph_client import constants
from turtle_referee.graph_client.record import Request, Record

Thing = TypeVar('Thing')

KEPT, BROKEN, OPEN = '✔', '✗', '–'

ORDER = (BROKEN, OPEN, KEPT)  # in which they are told

ONE = re.compile(r'(?<![\d.])1 ([a-z]+)s\b')  # as in '1 rides', which is '1 ride'


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
    follows: Sequence[str] = ()  # the broken requirements that may be why this one is broken


Judge = Callable[[Record], Finding]


class Rule(NamedTuple):
    """A requirement, and how it is judged."""

    name: str
    words: str
    expected: str
    judge: Judge
    rests_on: Sequence[str]  # the requirements that break this one, too, if they are broken

    def __call__(self, record: Record) -> Judgement:
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
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            # Whatever an implementation says, this is no reason to fall silent about the rest.
            mark = BROKEN
            measured = f'what was heard makes no sense ({type(error).__name__}: {error})'
        return Judgement(self.name, self.words, self.expected, mark, measured, plot)


class Rules(list[Rule]):
    """Rules, in their order."""

    def rule(self, name: str, words: str, rests_on: Sequence[str] = (),
             expected: str = '') -> Callable[[Judge], Judge]:
        """
        Make a rule of a function.

        :param words: the requirement, in the words of the assignment
        :param rests_on: the rules that break this one, too, if they are broken
        :param expected: what is demanded, with constants in braces; else the docstring says it
        """
        def add(judge: Judge) -> Judge:
            law = expected or (judge.__doc__ or '').removeprefix('Expect ').rstrip('.')
            self.append(Rule(name, words, law.format(**vars(constants)), judge, rests_on))
            return judge
        return add

    def judge(self, record: Record) -> list[Judgement]:
        """Judge what was heard: what is broken comes first, and before what may follow from it."""
        found, stall_summary = [rule(record) for rule in self], record.stall_summary()
        if stall_summary:
            # What is broken also while the machine had time is broken.
            calm = record.without_stalls()
            found = [one._replace(mark=OPEN, measured=f'{one.measured}; not judged: {stall_summary}')
                     if one.mark == BROKEN and rule(calm).mark != BROKEN else one
                     for rule, one in zip(self, found)]
        causes = self.causes({one.name: one.measured for one in found if one.mark == BROKEN})
        found = [one._replace(measured=ONE.sub(r'1 \1', one.measured),
                              follows=causes.get(one.name, ())) for one in found]
        return sorted(found, key=lambda one: (ORDER.index(one.mark), bool(one.follows)))

    def causes(self, broken: Mapping[str, str]) -> dict[str, list[str]]:
        """Return from which others each broken requirement may follow, by what was measured."""
        above = {name: self.above(name) for name in broken}
        roots = [name for name in broken if not above[name] & broken.keys()]
        # What is not there is missed by several in the same words: one of them tells.
        first = {broken[root]: root for root in reversed(roots)}
        return {name: sorted({first[broken[root]] for root in roots
                              if root == name or root in above[name]} - {name})
                for name in broken}

    def above(self, name: str) -> set[str]:
        """Return the rules that one rests on, and those that they rest on."""
        rests_on = {rule.name: rule.rests_on for rule in self}.get(name, ())
        return {*rests_on}.union(*map(self.above, rests_on))


def number(record: Record, name: str) -> float:
    """Return a number of the robot; Open if it is not known."""
    if name not in record.profile.numbers:
        raise Open(f'{name} is not known: no node has it as a parameter; say it in a profile')
    return record.profile.numbers[name]


def require_data(things: list[Thing], words: str) -> list[Thing]:
    """Return things; Open, with words, if there are none."""
    if not things:
        raise Open(words)
    return things


def require(thing: Thing | None, words: str) -> Thing:
    """Return what there is; Broken, with words, if it is not there."""
    if thing is None:
        raise Broken(words)
    return thing


def require_accepted(ask: Request | None) -> Request:
    """Return how something was answered that was asked for; Broken if it was not, or refused."""
    if ask is None or not ask.accepted:
        raise Broken(ask and ask.words or 'refused')
    return ask


def worst(values: Iterable[float]) -> float:
    """Return the greatest of some values, NaN if one is: nothing is above what is no number."""
    values = list(values)
    return next((value for value in values if value != value), max(values, default=0.0))


def within(limit: float, values: list[float], none: str,
           words: str = 'at most {:.3f} m off, {} times') -> Finding:
    """Find that none of some values is above a limit; Open, with words, if there are none."""
    most = worst(require_data(values, none))
    return Finding(most <= limit, words.format(most, len(values)))


def from_faults(faults: Sequence[str], count: int, things: str = '',
            plot: Plot | None = None) -> Finding:
    """Find that all of so many things are as they should, but those with a fault."""
    words = f'{count - len(faults)} of {count} {things}'.strip()
    return Finding(not faults, ': '.join([words, *filter(None, ['; '.join(faults[:5])])]), plot)
