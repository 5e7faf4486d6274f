# SPDX-License-Identifier: Apache-2.0

"""Lesson 4: turtlesim's command queue and the overshoot of simple controllers."""

from collections.abc import Callable, Iterator
from math import copysign, e, pi
from pathlib import Path
from statistics import median
from typing import NamedTuple

from turtle_brick.core.driving import COMMAND_PERIOD, Driver
from turtle_brick.core.parameters import Parameters
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, ARENA_SIZE, TICK, Turtle
from turtle_brick_tools.plots import CAUGHT, INK, MISSED, new_figure
from turtle_brick_tools.simulation import Simulation, TRANSPORT_DELAY


class SentCommand(NamedTuple):
    """A command sent to turtlesim. All times are in s."""

    published: float
    latency: float  # Time from `published` until a pose reflects this command or a newer one.
    applied: bool


def commands(phase: float) -> list[SentCommand]:
    """Simulate commands sent at 100 Hz to a turtlesim started at a given time (s)."""
    turtle = Turtle(holonomic=True)
    first, count = 32, round(0.5 / COMMAND_PERIOD)
    arrivals: list[tuple[int, float]] = []
    sent = 0
    for tick in range(round((first + count + 10) * COMMAND_PERIOD / TICK)):
        now = phase + tick * TICK
        while sent * COMMAND_PERIOD + TRANSPORT_DELAY <= now:
            sent += 1
            # The speed identifies the command, because command number n has the speed n + 1.
            turtle.command(float(sent), 0.0, 0.0)
        arrivals.append((round(turtle.tick(now).linear_velocity) - 1, now + TRANSPORT_DELAY))
    applied = {number for number, _ in arrivals}
    results = []
    for number in range(first, first + count):
        published = number * COMMAND_PERIOD
        arrival = next(time for shown, time in arrivals if shown >= number)
        results.append(SentCommand(published - first * COMMAND_PERIOD, arrival - published,
                                   number in applied))
    return results


def commands_for_all_phases() -> list[SentCommand]:
    """Return the results of `commands` for 16 start times of turtlesim, 1 ms apart."""
    return [sent for phase in range(16) for sent in commands(1e-3 * phase + 1e-4)]


class NaiveDriver(Driver):
    """A simple controller that uses the latest received pose instead of a prediction."""

    def __init__(self, law: Callable[[float], float]) -> None:
        """Create a controller whose `law` maps the distance to the goal (m) to a speed (m/s)."""
        super().__init__(law(ARENA_SIZE))
        self.law = law

    def command(self, now: float) -> tuple[float, float]:
        """Return a velocity (m/s) along x toward the goal, computed from the latest pose."""
        if self.goal is None or self.pose is None:
            return (0.0, 0.0)
        distance = self.goal[0] - self.pose.x
        return (copysign(self.law(abs(distance)), distance), 0.0)


DISTANCE = 3.0
"""Distance (m) from the start of a drive to its goal."""

NEAR = 0.01
"""Distance (m) from the goal within which a robot counts as settled."""


def controllers(parameters: Parameters) -> dict[str, Driver]:
    """Return three simple controllers and the controller of turtle_robot, keyed by name."""
    speed = parameters.max_velocity
    return {
        'full speed until within 5 cm': NaiveDriver(lambda x: speed if x > 0.05 else 0.0),
        'proportional, 10 per second': NaiveDriver(lambda x: min(speed, 10.0 * x)),
        'proportional, 4 per second': NaiveDriver(lambda x: min(speed, 4.0 * x)),
        'turtle_robot: predicted pose': Driver(speed),
    }


def approach(driver: Driver, parameters: Parameters) -> list[tuple[float, float]]:
    """Return times (s) and the robot's positions (m, relative to the goal) during a drive."""
    simulation = Simulation(parameters, seed=2)
    simulation.driver = driver
    simulation.rest(0.3)
    begin, goal = simulation.now, ARENA_CENTER + DISTANCE
    samples: list[tuple[float, float]] = []
    simulation.after_step = lambda: samples.append(
        ((simulation.now - begin) * SECONDS_PER_NS, simulation.turtle.pose.x - goal))
    simulation.drive_to(goal, ARENA_CENTER)
    simulation.rest(DISTANCE / parameters.max_velocity + 2.0)
    return samples


def report(parameters: Parameters) -> Iterator[str]:
    """Yield the results for this lesson, one line at a time."""
    every = commands_for_all_phases()
    latencies = [1e3 * sent.latency for sent in every]
    typical = median(latencies)
    applied = sum(sent.applied for sent in every) / len(every)
    yield f'  commands applied by turtlesim: {100.0 * applied:.1f} %'
    yield ('  delay from publishing a command to its effect in a pose: '
           f'{min(latencies):.0f} to {max(latencies):.0f} ms, median {typical:.0f} ms')
    yield (f'  motion during this delay at {parameters.max_velocity:g} m/s: '
           f'{0.1 * parameters.max_velocity * typical:.0f} cm')
    yield (f'  with a delay of {typical:.0f} ms, a proportional controller overshoots above '
           f'{1e3 / (e * typical):.1f} per second')
    yield f'  and oscillates forever above {1e3 * pi / (2.0 * typical):.1f} per second'
    yield (f'  a drive of {DISTANCE:g} m:                  overshoot   '
           f'settled within {100.0 * NEAR:g} cm')
    for name, driver in controllers(parameters).items():
        samples = approach(driver, parameters)
        settled = max(time for time, beyond in samples if abs(beyond) > NEAR)
        yield (f'    {name:31}{100.0 * max(max(beyond for _, beyond in samples), 0.0):6.1f} cm'
               + (f'{settled:13.2f} s' if settled < samples[-1][0] - 0.1 else '        never'))


def draw(parameters: Parameters, path: Path) -> None:
    """Plot the latency of turtlesim commands, and one drive for each of the controllers."""
    with new_figure(path, 7.6, 6.4) as figure:
        sawtooth, whole, near = figure.subplot_mosaic(
            'AA\nBC', height_ratios=(0.8, 1.5), width_ratios=(1.0, 1.6)).values()
        latencies = [1e3 * sent.latency for sent in commands_for_all_phases()]
        sawtooth.axhspan(min(latencies), max(latencies), color='#dfe7ef',
                         label='range for all offsets')
        for applied, mark, color, label in (
                (True, 'o', CAUGHT, 'applied'),
                (False, 'x', MISSED, 'dropped (a newer command is applied)')):
            selected = [sent for sent in commands(1e-4) if sent.applied is applied]
            sawtooth.plot([1e3 * sent.published for sent in selected],
                          [1e3 * sent.latency for sent in selected], mark, color=color,
                          markersize=5.0, label=label)
        sawtooth.set(xlim=(-5.0, 495.0), ylim=(0.0, 90.0), xlabel='command published at / ms',
                     ylabel='latency / ms',
                     title='Latency of commands sent to turtlesim at 100 Hz')
        sawtooth.legend(loc='lower left', ncols=3)

        for (name, driver), color in zip(controllers(parameters).items(),
                                         (MISSED, '#d9822b', '#8a63b8', CAUGHT)):
            time, beyond = zip(*approach(driver, parameters))
            whole.plot(time, [DISTANCE + place for place in beyond], color=color, linewidth=1.6)
            near.plot(time, [100.0 * place for place in beyond], color=color, linewidth=1.8,
                      label=name)
        for axes, goal in ((whole, DISTANCE), (near, 0.0)):
            axes.axhline(goal, color=INK, linewidth=0.9, linestyle='--', zorder=1)
            axes.set_xlabel('time since the goal message / s')
        last = DISTANCE / parameters.max_velocity
        whole.set(xlim=(0.0, last + 1.5), ylim=(0.0, 1.12 * DISTANCE), ylabel='distance / m',
                  title=f'A drive of {DISTANCE:g} m')
        near.set(xlim=(last - 0.1, last + 1.0), ylim=(-30.0, 20.0), ylabel='beyond the goal / cm',
                 title='The end of the drive')
        near.legend(loc='lower right')
