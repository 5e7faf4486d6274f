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

"""Lesson 4: turtlesim's queue of commands, and why a simple controller overshoots."""

from collections.abc import Callable, Iterator
from math import copysign, e, pi
from pathlib import Path
from statistics import median
from typing import NamedTuple

from turtle_brick.core.driving import COMMAND_PERIOD, Driver, TRANSPORT_DELAY
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, ARENA_SIZE, TICK, Turtle
from turtle_brick.tools.plots import CAUGHT, drawn, INK, MISSED
from turtle_brick.tools.simulation import Simulation


class Sent(NamedTuple):
    """A command, and what became of it; times in s."""

    published: float
    latency: float
    """Until the arrival of the first pose that shows it, or a newer one if it was never taken."""
    taken: bool


def commands(phase: float) -> list[Sent]:
    """
    Send commands at 100 Hz to turtlesim for half a second, and find each again in its poses.

    :param phase: of turtlesim's ticks (s)
    :return: The commands that were sent when its queue was full already.
    """
    turtle = Turtle(holonomic=True)
    first, count = 32, round(0.5 / COMMAND_PERIOD)
    arrivals: list[tuple[int, float]] = []
    sent = 0
    for tick in range(round((first + count + 10) * COMMAND_PERIOD / TICK)):
        now = phase + tick * TICK
        while sent * COMMAND_PERIOD + TRANSPORT_DELAY <= now:
            sent += 1
            # The speed tells which command it is, the first one at 1 m/s.
            turtle.command(float(sent), 0.0, 0.0)
        arrivals.append((round(turtle.tick(now).linear_velocity) - 1, now + TRANSPORT_DELAY))
    shown = {number for number, _ in arrivals}
    return [Sent((number - first) * COMMAND_PERIOD,
                 next(time for taken, time in arrivals if taken >= number) - number * COMMAND_PERIOD,
                 number in shown)
            for number in range(first, first + count)]


class Naive(Driver):
    """A controller as one first writes it: it steers by the pose that it has seen last."""

    def __init__(self, law: Callable[[float], float]) -> None:
        """Stand still until there is a goal; law: the speed (m/s) at a distance (m) from it."""
        super().__init__(law(ARENA_SIZE))
        self.law = law

    def command(self, now: float) -> tuple[float, float]:
        """Return the velocity (m/s) that leads from there to the goal, along x alone."""
        gap = self.goal[0] - self.pose.x if self.goal is not None and self.pose is not None else 0
        return (copysign(self.law(abs(gap)), gap), 0.0)


WAY = 3.0
"""How far (m) the robots drive."""

NEAR = 0.01
"""Distance (m) from the goal within which a robot counts as there."""


def controllers(parameters: Parameters) -> dict[str, Driver]:
    """Return three naive controllers and ours, by name."""
    speed = parameters.max_velocity
    return {
        'full speed until within 5 cm': Naive(lambda gap: speed if gap > 0.05 else 0.0),
        'proportional, 10 per second': Naive(lambda gap: min(speed, 10.0 * gap)),
        'proportional, 4 per second': Naive(lambda gap: min(speed, 4.0 * gap)),
        'ours: from the predicted pose': Driver(speed),
    }


def approach(driver: Driver, parameters: Parameters) -> list[tuple[float, float]]:
    """
    Let a driver drive WAY along x and stay there for a while.

    :return: (time in s since the order, m beyond the goal), 250 times per second
    """
    simulation = Simulation(parameters, seed=2)
    simulation.driver = driver
    simulation.rest(0.3)
    ordered, goal = simulation.now, ARENA_CENTER + WAY
    seen: list[tuple[float, float]] = []
    simulation.on_physics = lambda: seen.append(
        ((simulation.now - ordered) * SECONDS_PER_NS, simulation.turtle.pose.x - goal))
    simulation.drive_to(goal, ARENA_CENTER)
    simulation.rest(WAY / parameters.max_velocity + 2.0)
    return seen


def tell(parameters: Parameters) -> Iterator[str]:
    """Yield the numbers of this part."""
    every = [sent for phase in range(16) for sent in commands(1e-3 * phase + 1e-4)]
    latencies = [1e3 * sent.latency for sent in every]
    usual = median(latencies)
    taken = sum(sent.taken for sent in every) / len(every)
    yield f'  of the commands turtlesim takes {100.0 * taken:.1f} %'
    yield (f'  from publishing one to the pose that shows it, or a newer one: '
           f'{min(latencies):.0f} to {max(latencies):.0f} ms, median {usual:.0f} ms')
    yield (f'  at {parameters.max_velocity:g} m/s that is '
           f'{0.1 * parameters.max_velocity * usual:.0f} cm of motion')
    yield (f'  a delay of {usual:.0f} ms has a proportional controller overshoot above '
           f'{1e3 / (e * usual):.1f} per second,')
    yield f'  and swing for ever above {1e3 * pi / (2.0 * usual):.1f} per second'
    yield (f'  {WAY:g} m to drive:                overshoot   '
           f'within {100.0 * NEAR:g} cm for good')
    for name, driver in controllers(parameters).items():
        seen = approach(driver, parameters)
        settled = max(time for time, beyond in seen if abs(beyond) > NEAR)
        yield (f'    {name:31}{100.0 * max(max(beyond for _, beyond in seen), 0.0):6.1f} cm'
               + (f'{settled:13.2f} s' if settled < seen[-1][0] - 0.1 else '        never'))


def draw(parameters: Parameters, path: Path) -> None:
    """Draw what becomes of commands, and naive controllers beside ours."""
    with drawn(path, 7.6, 6.4) as figure:
        sawtooth, whole, near = figure.subplot_mosaic(
            'AA\nBC', height_ratios=(0.8, 1.5), width_ratios=(1.0, 1.6)).values()

        for taken, mark, color, words in (
                (True, 'o', CAUGHT, 'taken by a tick'),
                (False, 'x', MISSED, 'pushed out: the next one is taken')):
            those = [sent for sent in commands(0.0001) if sent.taken is taken]
            sawtooth.plot([1e3 * sent.published for sent in those],
                          [1e3 * sent.latency for sent in those], mark, color=color,
                          markersize=5.0, label=words)
        sawtooth.set(xlim=(-5.0, 495.0), ylim=(0.0, 90.0), xlabel='command published at / ms',
                     ylabel='shows in a pose\nafter / ms',
                     title='What becomes of commands at 100 Hz in turtlesim')
        sawtooth.legend(loc='lower left', ncols=2)

        for (name, driver), color in zip(controllers(parameters).items(),
                                         (MISSED, '#d9822b', '#8a63b8', CAUGHT)):
            time, beyond = zip(*approach(driver, parameters))
            whole.plot(time, [WAY + place for place in beyond], color=color, linewidth=1.6)
            near.plot(time, [100.0 * place for place in beyond], color=color, linewidth=1.8,
                      label=name)
        for axes, goal in ((whole, WAY), (near, 0.0)):
            axes.axhline(goal, color=INK, linewidth=0.9, linestyle='--', zorder=1)
            axes.set_xlabel('time since the order / s')
        last = WAY / parameters.max_velocity
        whole.set(xlim=(0.0, last + 1.5), ylim=(0.0, 1.12 * WAY), ylabel='distance / m',
                  title=f'{WAY:g} m to drive')
        near.set(xlim=(last - 0.1, last + 1.0), ylim=(-30.0, 20.0), ylabel='beyond the goal / cm',
                 title='... and the end of it')
        near.legend(loc='lower right')
