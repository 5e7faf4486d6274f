# SPDX-License-Identifier: Apache-2.0
"""
Check, without ROS, whether a recorded graph meets the requirements of the assignment.

Each rule has a function that returns a `Finding`. It raises `Failed` if the graph has a fault that
no load of the machine can cause, and `Open` if the record is insufficient for a judgment.

There are two kinds of rules. A rule for names, types, frames, dimensions, signs, texts or values
at rest is judged by all trials. A rule that `needs_calm`, for example for rates, accelerations and
delays, is judged by the calm trials, in which no other program delayed the graph. If none is calm,
the requirement is open, unless the function raises `Failed` for the other trials.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from traceback import format_exc
from typing import Any, NamedTuple, TypeVar

import numpy
from turtle_graph.client.launch_errors import LACKS
from turtle_graph.client.record import LOADED, Record, Request

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
MET, FAILED, OPEN = '✔', '✗', '–'
NODES = 'turtle_robot', 'arena', 'catcher'
"""The nodes of the assignment. The behavior of a node may depend on the nodes before it."""


class Failed(Exception):
    """Exception that states why a requirement is not met, whatever the load of the machine."""


class Absent(Failed):
    """Exception raised if a requirement is not met because a part of the graph is absent."""


class Open(Exception):
    """Exception that states why a requirement cannot be judged."""


class Loaded(Open):
    """Exception that states why a requirement cannot be judged because of the machine's load."""


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


class Judgment(NamedTuple):
    """A requirement with its mark, expected result and measured result."""

    name: str
    sentence: str
    expected: str
    mark: str
    measured: str
    plot: Plot | None = None
    follows: Sequence[str] = ()  # Crashes and other failures that may have caused this failure.
    fault: bool = False  # Whether the requirement failed whatever the load of the machine.
    absent: bool = False  # Whether the requirement failed because a part of the graph is absent.
    loaded: bool = False  # Whether the requirement is open because of the load of the machine.
    traceback: str = ''  # The traceback of an error in the rule itself.


Judge = Callable[[Record], Finding]


class Rule(NamedTuple):
    """A requirement and the function that judges it."""

    name: str
    sentence: str
    expected: str
    judge: Judge
    depends_on: Sequence[str]  # Requirements that must be met before this one can be met.
    needs_calm: bool = False  # Whether the load of the machine can change the result.
    node: str = NODES[0]  # The node that meets the requirement.

    def __call__(self, record: Record) -> Judgment:
        """Judge a record, or only its calm trials if the load can change the result."""
        whole, load = self.apply(record), record.load_summary()
        if not (self.needs_calm and load) or whole.fault:
            return whole
        calm = self.apply(record.calm())
        if calm.mark != OPEN:
            return calm
        if whole.mark == OPEN:
            return whole
        return calm._replace(measured=f'not judged: {load}', loaded=True)

    def apply(self, record: Record) -> Judgment:
        """Judge all trials of a record."""
        judgment = Judgment(self.name, self.sentence, self.expected, OPEN, '')
        try:
            with numpy.errstate(all='ignore'):
                met, measured, plot = self.judge(record)
            return judgment._replace(mark=MET if met else FAILED, measured=measured, plot=plot)
        except Failed as fault:
            return judgment._replace(mark=FAILED, measured=str(fault), fault=True,
                                     absent=isinstance(fault, Absent))
        except Open as reason:
            return judgment._replace(measured=str(reason), loaded=isinstance(reason, Loaded))
        except Exception as error:  # It is a mistake in the rule, whatever the graph has sent.
            return judgment._replace(
                measured=f'referee error: {type(error).__name__}: {error}', traceback=format_exc())


class Rules(list[Rule]):
    """A list of rules to apply to a record."""

    def __init__(self, rules: Iterable[Rule] = (), node: str = NODES[0]) -> None:
        """Create a list of rules. The rules added later are requirements for the given node."""
        super().__init__(rules)
        self.node = node

    def rule(self, name: str, sentence: str, expected: str,
             depends_on: Sequence[str] = (), needs_calm: bool = False
             ) -> Callable[[Judge], Judge]:
        """Return a decorator that adds a function to this list as a Rule with the given fields."""
        def add(judge: Judge) -> Judge:
            self.append(Rule(name, sentence, expected, judge, depends_on, needs_calm,
                             self.node))
            return judge
        return add

    def judge(self, record: Record) -> list[Judgment]:
        """Judge a record and return the failed, open and met requirements, in that order."""
        judgments = [rule(record) for rule in self]
        causes = self.causes({judgment.name: judgment for judgment in judgments
                              if judgment.mark == FAILED})
        absent = {judgment.name for judgment in judgments if judgment.absent}

        def follows_absence(name: str) -> bool:
            return name in absent or any(map(follows_absence, causes[name]))

        incomplete = {name for name in causes if follows_absence(name)}
        if record.crashes:
            causes.update(dict.fromkeys(incomplete, record.crashes))
        lacks = '; '.join(filter(LACKS.search, record.crashes))
        # The graph may be correct in an environment that contains everything.
        opened = causes.keys() & (incomplete | self.behavior_without(absent)) if lacks else ()
        judgments = [
            judgment._replace(mark=OPEN, measured=lacks) if judgment.name in opened
            else judgment._replace(follows=causes.get(judgment.name, ()))
            for judgment in judgments]
        order = (FAILED, OPEN, MET)
        return sorted(judgments, key=lambda judgment: (
            order.index(judgment.mark), bool(judgment.follows)))

    def behavior_without(self, absent: Collection[str]) -> set[str]:
        """Return the requirements for the behavior of the first node with an absent part."""
        numbers = [NODES.index(rule.node) for rule in self if rule.name in absent]
        first = min(numbers, default=NODES.index('catcher'))  # All its messages come later.
        return {rule.name for rule in self
                if rule.needs_calm and NODES.index(rule.node) >= first}

    def causes(self, failed: Mapping[str, Judgment]) -> dict[str, list[str]]:
        """
        Map each failed requirement to the failed requirements that may have caused the failure.

        If requirements fail because of the same fault, only the first counts as a cause. If a
        part of the graph is absent, this is the cause itself.
        """
        faults: dict[str, list[str]] = {}
        for name, judgment in failed.items():
            faults.setdefault(judgment.measured if judgment.fault else name, []).append(name)
        causes = {rule.name: sorted(failed.keys() & {*rule.depends_on})
                  for rule in self if rule.name in failed}
        for first, *others in faults.values():
            if others or failed[first].absent:
                causes.update({first: [], **{name: [first] for name in others}})
        return causes


def number(record: Record, name: str) -> float:
    """Return a physical parameter of the robot, or raise Open if the value is unknown."""
    if name not in record.profile.numbers:
        raise Open(f'{name} is unknown because neither a node nor turtle.yaml has this parameter')
    return record.profile.numbers[name]


def thin(items: Iterable[Value]) -> list[Value]:
    """Return at most 1999 evenly spaced items from an iterable."""
    items = list(items)
    return items[::max(len(items) // 1000, 1)]


def require_data(items: Iterable[Value | None], reason: str) -> list[Value]:
    """Return all items except None, or raise Open with the given reason if there are none."""
    known = [item for item in items if item is not None]
    if not known:
        raise Open(reason)
    return known


def require(value: Value | None, fault: str) -> Value:
    """Return the value, or raise Absent with the given fault if it is None, false or empty."""
    if not value:
        raise Absent(fault)
    return value


def require_clear(record: Record, *names: str) -> None:
    """Raise Open if the referee could not use one of the given topics, services or frames."""
    for name in names:
        if name in record.unclear:
            raise Open(record.unclear[name])


def require_accepted(record: Record, request: Request | None) -> Request:
    """Return the request if it was accepted, or raise Failed with the response message."""
    if request is None or not request.answered:
        reason = request and request.message or 'there was no response'
        if request is not None and not record.is_calm(request.begin, request.end):
            raise Loaded(f'{reason}; {LOADED}')
        raise Absent(reason)
    if not request.accepted:
        raise Failed(request.message)
    return request


def largest(values: Iterable[float]) -> float:
    """Return the largest value (NaN if any value is NaN, 0 if there are no values)."""
    values = list(values)
    return next((value for value in values if value != value), max(values, default=0.0))


def within(limit: float, values: list[float], reason: str,
           text: str = 'at most {:.3f} m off in {} measurements', wrong: float = 0.0) -> Finding:
    """
    Judge whether every value is at most `limit`, or raise Open if there are no values.

    :param wrong: value up to which the assignment does not forbid larger values than `limit`
    """
    value = largest(require_data(values, reason))
    if limit < value <= wrong:
        raise Open(f'{text.format(value, len(values))}; the assignment requires no accuracy')
    return Finding(value <= limit, text.format(value, len(values)))


def from_faults(faults: Sequence[str], count: int, items: str) -> Finding:
    """Judge `count` items. The requirement is met if the list of faults is empty."""
    text, more = f'{count - len(faults)} of {count} {items}', ['…'] if len(faults) > 5 else []
    return Finding(not faults, f'{text}: {"; ".join([*faults[:5], *more])}' if faults else text)
