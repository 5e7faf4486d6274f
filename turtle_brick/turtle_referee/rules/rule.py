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
Rules that judge the requirements of the assignment by a record, without ROS.

A rule is a function that returns a `Finding`. The function raises `Broken` if required data is
absent, and `Open` if the record is insufficient for a judgement.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
import re
from typing import NamedTuple, TypeVar

import numpy
from turtle_referee.graph_client.record import Record, Request

Value = TypeVar('Value')

MET, BROKEN, OPEN = '✔', '✗', '–'

ORDER = (BROKEN, OPEN, MET)
"""Order of the marks in a report."""

ONE = re.compile(r'(?<![\d.])1 ([a-z]+)s\b')
"""A plural noun after the number 1, such as '1 rides'."""


class Broken(Exception):
    """A requirement is broken by the fault in the text."""


class Open(Exception):
    """A requirement cannot be judged for the reason in the text."""


class Series(NamedTuple):
    """Points of a plot."""

    label: str
    x: Sequence[float]
    y: Sequence[float]


class Plot(NamedTuple):
    """A plot of measured points and of the line on which they should be."""

    title: str
    x_label: str
    y_label: str
    points: Sequence[Series]
    line: Series


class Finding(NamedTuple):
    """The result of a rule, with a plot if there is one."""

    met: bool
    measured: str
    plot: Plot | None = None


class Judgement(NamedTuple):
    """A requirement with its mark, its expected result and its measured result."""

    name: str
    sentence: str
    expected: str
    mark: str
    measured: str
    plot: Plot | None = None
    follows: Sequence[str] = ()  # other broken requirements that may be the cause


Judge = Callable[[Record], Finding]


class Rule(NamedTuple):
    """A requirement and the function that judges it."""

    name: str
    sentence: str
    expected: str
    judge: Judge
    depends_on: Sequence[str]  # requirements without which this one cannot be met

    def __call__(self, record: Record) -> Judgement:
        """Judge a record, and ignore the load of the machine."""
        plot = None
        try:
            with numpy.errstate(all='ignore'):
                met, measured, plot = self.judge(record)
            mark = MET if met else BROKEN
        except Broken as error:
            mark, measured = BROKEN, str(error)
        except Open as error:
            mark, measured = OPEN, str(error)
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            # Unexpected data must not end the referee.
            mark = BROKEN
            measured = f'the received data is inconsistent ({type(error).__name__}: {error})'
        return Judgement(self.name, self.sentence, self.expected, mark, measured, plot)


class Rules(list[Rule]):
    """A list of rules that are judged together."""

    def rule(self, name: str, sentence: str, expected: str,
             depends_on: Sequence[str] = ()) -> Callable[[Judge], Judge]:
        """
        Return a decorator that adds a function to the list as a rule.

        :param name: name of the requirement
        :param sentence: sentence in the assignment
        :param expected: expected result
        :param depends_on: requirements without which this one cannot be met
        """
        def add(judge: Judge) -> Judge:
            self.append(Rule(name, sentence, expected, judge, depends_on))
            return judge
        return add

    def judge(self, record: Record) -> list[Judgement]:
        """Judge a record; sort broken requirements first, and causes before consequences."""
        judgements, overload = [rule(record) for rule in self], record.stall_summary()
        if overload:
            # A requirement counts as broken only if it was broken without a stall, too.
            calm = record.without_stalls()
            judgements = [
                judgement._replace(mark=OPEN,
                                   measured=f'{judgement.measured}; not judged: {overload}')
                if judgement.mark == BROKEN and rule(calm).mark != BROKEN else judgement
                for rule, judgement in zip(self, judgements)]
        causes = self.causes({judgement.name: judgement.measured
                              for judgement in judgements if judgement.mark == BROKEN})
        judgements = [judgement._replace(measured=ONE.sub(r'1 \1', judgement.measured),
                                         follows=causes.get(judgement.name, ()))
                      for judgement in judgements]
        return sorted(judgements, key=lambda one: (ORDER.index(one.mark), bool(one.follows)))

    def causes(self, broken: Mapping[str, str]) -> dict[str, list[str]]:
        """Return the possible causes of broken requirements, which have a name and a result."""
        above = {name: self.all_dependencies(name) for name in broken}
        roots = [name for name in broken if not above[name] & broken.keys()]
        # If several rules report the same absence, the first one counts as the cause.
        first = {broken[root]: root for root in reversed(roots)}
        return {name: sorted({first[broken[root]] for root in roots
                              if root == name or root in above[name]} - {name})
                for name in broken}

    def all_dependencies(self, name: str) -> set[str]:
        """Return the direct and indirect dependencies of a rule."""
        depends_on = {rule.name: rule.depends_on for rule in self}.get(name, ())
        return {*depends_on}.union(*map(self.all_dependencies, depends_on))


def number(record: Record, name: str) -> float:
    """Return a physical number of the robot, or raise Open if it is unknown."""
    if name not in record.profile.numbers:
        raise Open(f'{name} is unknown because no node has this parameter; add it to a profile')
    return record.profile.numbers[name]


def require_data(items: list[Value], reason: str) -> list[Value]:
    """Return the items, or raise Open with a reason if the list is empty."""
    if not items:
        raise Open(reason)
    return items


def require(value: Value | None, fault: str) -> Value:
    """Return the value, or raise Broken with a fault if it is None."""
    if value is None:
        raise Broken(fault)
    return value


def require_accepted(request: Request | None) -> Request:
    """Return the request, or raise Broken with its message if it was refused."""
    if request is None or not request.accepted:
        raise Broken(request and request.message or 'the request was refused')
    return request


def largest(values: Iterable[float]) -> float:
    """Return the largest value, 0 without values, or NaN if one of them is NaN."""
    values = list(values)
    return next((value for value in values if value != value), max(values, default=0.0))


def within(limit: float, values: list[float], reason: str,
           text: str = 'at most {:.3f} m off in {} measurements') -> Finding:
    """Return the finding for values with a limit, or raise Open if there are no values."""
    value = largest(require_data(values, reason))
    return Finding(value <= limit, text.format(value, len(values)))


def from_faults(faults: Sequence[str], count: int, items: str,
                plot: Plot | None = None) -> Finding:
    """Return the finding for a number of items and the faults of some of them."""
    text = f'{count - len(faults)} of {count} {items}'
    if faults:
        text += f': {"; ".join(faults[:5])}'
    return Finding(not faults, text, plot)
