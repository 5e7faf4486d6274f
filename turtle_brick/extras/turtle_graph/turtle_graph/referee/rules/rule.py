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
Check, without ROS, whether a recorded graph meets the requirements of the assignment.

Each rule has a function that returns a `Finding`. The function raises `Failed` if required data is
absent, and `Open` if the record is insufficient for a judgment.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from traceback import format_exc
from typing import Any, NamedTuple, TypeVar

import numpy
from turtle_graph.client.processes import LACKS
from turtle_graph.client.record import Record, Request

Value = TypeVar('Value')

PHYSICS_RATE = 250.0
"""Required rate (Hz) of the physics simulation and of the brick transform."""
RATE_TOLERANCE = 0.02
"""Relative tolerance for rates and accelerations."""
NEAR = 0.01
"""Tolerance (m) for equal positions."""
SAME_ANGLE = 0.02
"""Tolerance (rad) for equal angles."""
BEFORE_NS = 100_000_000
"""Time (ns) between the last pose evaluated by a rule and the next request of the referee."""
MAX_COUNT = 1000
"""Approximate maximum number of samples in one evaluation."""
MET, FAILED, OPEN = '✔', '✗', '–'


class Failed(Exception):
    """Exception that states why a requirement is not met."""


class Absent(Failed):
    """Exception raised if a requirement is not met because a part of the graph is absent."""


class Certain(Failed):
    """Exception raised if a requirement is not met and no load of the machine can explain it."""


class Open(Exception):
    """Exception that states why a requirement cannot be judged."""


class Plot(NamedTuple):
    """A plot of measured points and of the curve on which the points should lie."""

    title: str
    x_label: str
    y_label: str
    measured: tuple[Any, Any]  # sequences of x and y
    expected: tuple[Any, Any]


class Finding(NamedTuple):
    """The result of a rule, with an optional plot."""

    met: bool
    measured: str
    plot: Plot | None = None
    certain: bool = False  # Whether no load of the machine can explain a failure.


class Judgment(NamedTuple):
    """A requirement with its mark, expected result and measured result."""

    name: str
    sentence: str
    expected: str
    mark: str
    measured: str
    plot: Plot | None = None
    follows: Sequence[str] = ()  # Crashes and other failures that may have caused this failure.
    absent: bool = False  # Whether the requirement failed because a part of the graph is absent.
    certain: bool = False  # Whether no load of the machine can explain a failure.
    traceback: str = ''  # The traceback of an error in the rule itself.


Judge = Callable[[Record], Finding]


class Rule(NamedTuple):
    """A requirement and the function that judges it."""

    name: str
    sentence: str
    expected: str
    judge: Judge
    depends_on: Sequence[str]  # Requirements that must be met before this one can be met.
    firm: bool = True  # Whether the load of the machine can never explain a failure.

    def __call__(self, record: Record) -> Judgment:
        """Judge a record, ignoring whether the machine was overloaded."""
        plot, absent, certain, traceback = None, False, False, ''
        try:
            with numpy.errstate(all='ignore'):
                met, measured, plot, certain = self.judge(record)
            mark = MET if met else FAILED
        except Failed as error:
            mark, measured = FAILED, str(error)
            absent, certain = isinstance(error, Absent), isinstance(error, Certain)
        except Open as error:
            mark, measured = OPEN, str(error)
        except Exception as error:  # It is a mistake in the rule, whatever the graph has sent.
            mark, traceback = OPEN, format_exc()
            measured = f'referee error: {type(error).__name__}: {error}'
        return Judgment(self.name, self.sentence, self.expected, mark, measured, plot,
                        absent=absent, certain=bool(certain), traceback=traceback)

    def judge_under_load(self, record: Record, calm: Record) -> Judgment:
        """Judge a record. A failure that the load from other programs may explain is open."""
        found = self(record)
        if found.mark == FAILED and not found.certain:
            trials = record if self.firm or found.absent or record.hog else calm
            marks = [self(trial).mark for trial in trials.single_trials()]
            # Load that is not noticed may spoil a few trials, but not most of them, and hardly
            # more than twice as many as the load that is noticed.
            if marks.count(FAILED) > min(marks.count(MET), 2 * record.stalled_trials()):
                in_trials = self(trials)
                return in_trials if in_trials.mark == FAILED else found
            found = found._replace(
                mark=OPEN, measured=f'{found.measured}; not judged: {record.stall_summary()}')
        if found.mark == OPEN and (in_calm := self(calm)).mark == MET:
            return in_calm._replace(measured=f'{in_calm.measured}; in calm trials only')
        return found


class Rules(list[Rule]):
    """A list of rules to apply to a record."""

    def rule(self, name: str, sentence: str, expected: str,
             depends_on: Sequence[str] = (), firm: bool = True) -> Callable[[Judge], Judge]:
        """Return a decorator that adds a function to this list as a Rule with the given fields."""
        def add(judge: Judge) -> Judge:
            self.append(Rule(name, sentence, expected, judge, depends_on, firm))
            return judge
        return add

    def judge(self, record: Record) -> list[Judgment]:
        """Judge a record and return the failed, open and met requirements, in that order."""
        overload, calm = record.stall_summary(), record.without_stalls()
        judgments = [rule.judge_under_load(record, calm) if overload else rule(record)
                     for rule in self]
        causes = self.causes({one.name: one.measured if one.absent or one.certain else one.name
                              for one in judgments if one.mark == FAILED},
                             {one.name for one in judgments if one.mark == MET})
        absent = {one.name for one in judgments if one.absent}
        crashed = {name for name, found in causes.items()
                   if record.crashes and absent.intersection([name, *found])}
        causes.update(dict.fromkeys(crashed, record.crashes))
        judgments = [one._replace(follows=causes.get(one.name, ())) for one in judgments]
        judgments = [one._replace(measured=f'{one.measured}; {"; ".join(record.crashes)}')
                     if one.mark == OPEN and crashed & self.all_dependencies(one.name) else one
                     for one in judgments]
        lacks = '; '.join(filter(LACKS.search, record.crashes))
        if lacks:  # The graph may be correct in an environment that contains everything.
            judgments = [one._replace(mark=OPEN, measured=lacks, follows=())
                         if one.name in crashed else one for one in judgments]
        order = (FAILED, OPEN, MET)
        return sorted(judgments, key=lambda one: (order.index(one.mark), bool(one.follows)))

    def causes(self, failed: Mapping[str, str], met: Collection[str]) -> dict[str, list[str]]:
        """
        Map each failed requirement to the other failed requirements that may have caused it.

        :param failed: failed requirements with their faults
        :param met: requirements that are met
        """
        above = {name: self.all_dependencies(name, met) for name in failed}
        roots = [name for name in failed if not above[name] & failed.keys()]
        # If requirements fail because of the same fault, only the first counts as a cause.
        first = {failed[root]: root for root in reversed(roots)}
        return {name: sorted({first[failed[root]] for root in roots
                              if root in {name, *above[name]}} - {name}) for name in failed}

    def all_dependencies(self, name: str, met: Collection[str] = ()) -> set[str]:
        """Return the direct and indirect dependencies of a rule, without those that are met."""
        names = {rule.name: set(rule.depends_on) for rule in self}.get(name, set()).difference(met)
        return names.union(*(self.all_dependencies(one, met) for one in names))


def number(record: Record, name: str) -> float:
    """Return a physical parameter of the robot, or raise Open if the value is unknown."""
    if name not in record.profile.numbers:
        raise Open(f'{name} is unknown because no node has this parameter; add it to a profile')
    return record.profile.numbers[name]


def thin(items: Iterable[Value]) -> list[Value]:
    """Return at most 2 * MAX_COUNT - 1 evenly spaced items from an iterable."""
    items = list(items)
    return items[::max(len(items) // MAX_COUNT, 1)]


def require_data(items: list[Value], reason: str) -> list[Value]:
    """Return the items, or raise Open with the given reason if the list is empty."""
    if not items:
        raise Open(reason)
    return items


def require(value: Value | None, fault: str) -> Value:
    """Return the value, or raise Absent with the given fault if the value is None."""
    if value is None:
        raise Absent(fault)
    return value


def require_clear(record: Record, *names: str) -> None:
    """Raise Open if the referee could not use one of the given topics, services or frames."""
    for name in names:
        if name in record.unclear:
            raise Open(record.unclear[name])


def require_accepted(request: Request | None) -> Request:
    """Return the request if it was accepted, or raise Failed with the response message."""
    if request is None or not request.answered:
        raise Absent(request and request.message or 'there was no response')
    if not request.accepted:
        raise Failed(request.message or 'the request was refused')
    return request


def largest(values: Iterable[float]) -> float:
    """Return the largest value (NaN if any value is NaN, 0 if there are no values)."""
    values = list(values)
    return next((value for value in values if value != value), max(values, default=0.0))


def within(limit: float, values: list[float], reason: str,
           text: str = 'at most {:.3f} m off in {} measurements') -> Finding:
    """Judge whether every value is at most `limit`, or raise Open if there are no values."""
    value = largest(require_data(values, reason))
    return Finding(value <= limit, text.format(value, len(values)))


def from_faults(faults: Sequence[str], count: int, items: str) -> Finding:
    """Judge `count` items. The requirement is met if the list of faults is empty."""
    text, more = f'{count - len(faults)} of {count} {items}', ['…'] if len(faults) > 5 else []
    return Finding(not faults, f'{text}: {"; ".join([*faults[:5], *more])}' if faults else text)
