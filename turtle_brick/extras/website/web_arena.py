# SPDX-License-Identifier: Apache-2.0

"""Simulate the arena for the web page, which loads this module with Pyodide."""

from dataclasses import asdict, replace
import json
import math
from pathlib import Path
from random import Random
from tempfile import gettempdir

from turtle_brick.core.catch_logic import State
from turtle_brick.core.driving import Driver
from turtle_brick.core.odometry import Odometer
from turtle_brick.core.parameters import (default_path, load, PARAMETER_RULES, ParameterRule,
                                          Parameters)
from turtle_brick.core.reachability import resting_height
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, ARENA_SIZE, TurtlePose
from turtle_brick.physics import BrickState
from turtle_brick_tools.simulation import guaranteed_distance, JITTER, Simulation
import xacro
import yaml

ADJUSTABLE = ('max_velocity', 'gravity_accel', 'platform_radius', 'tilt_angle')
"""Parameters with a slider."""

LIMITS = {'max_velocity': (0.01, 10.0), 'platform_radius': (0.1, 1.0)}
"""Limits of the sliders whose parameters accept more values than are useful on the page."""

MAX_HEIGHT = 10.0
"""Maximum height (m) of the brick."""

HINTS = {
    BrickState.FLOATING: 'The assignment requires that a brick that has left the platform floats.',
    BrickState.GROUNDED: (
        'The assignment requires that the brick is always inclined like the platform.')}
"""Explanations of the states in which the brick's behavior looks like a fault."""

PLOT_TIME = 6.0
"""Duration (s) of the plots."""

XACRO = default_path().parents[1] / 'urdf' / 'turtle.urdf.xacro'
"""Path of the robot description."""

PARAMETERS = Path(gettempdir(), 'web_arena.yaml')
"""Path of the parameter file that the robot description reads."""


class WebDriver(Driver):
    """A driver that can ignore the commands that the latest pose does not show."""

    predicts = True

    def predict(self, pose: TurtlePose) -> tuple[float, float]:
        """Return the predicted position (m), or the latest one if `predicts` is false."""
        return super().predict(pose) if self.predicts else (pose.x, pose.y)


class WebArena:
    """One arena with a robot and a brick."""

    def __init__(self) -> None:
        self.defaults = load()
        self.random = Random()
        self.counts = {'caught': 0, 'refused': 0, 'missed': 0}
        self.form: dict[str, str] = {}
        self.placed = self.defaults.brick_start
        self.start(self.defaults, (ARENA_CENTER, ARENA_CENTER, 0.0))
        # Browsers round slider limits, but `update` rejects values beyond the exact limits.
        width = math.floor(100.0 * ARENA_SIZE) / 100.0
        lowest = math.ceil(100.0 * resting_height(self.parameters)) / 100.0
        tilt = PARAMETER_RULES['tilt_angle'].upper
        self.rules = {
            'x': ParameterRule('x of the brick', 'm', 0.0, width),
            'y': ParameterRule('y of the brick', 'm', 0.0, width),
            'z': ParameterRule('Height of the brick', 'm', lowest, MAX_HEIGHT),
            'tilt': ParameterRule('Angle of the platform', 'rad', -tilt, tilt)}
        for name in ADJUSTABLE:
            rule = PARAMETER_RULES[name]
            lower, upper = LIMITS.get(name, (rule.lower, rule.upper))
            self.rules[name] = rule._replace(lower=lower, upper=upper)

    def start(self, parameters: Parameters, turtle: tuple[float, float, float]) -> None:
        """Start a simulation with the turtle at x, y (m) and theta (rad)."""
        self.urdf = describe_robot(parameters)
        self.parameters = parameters
        self.simulation = Simulation(parameters, self.random.randrange(10 ** 6), JITTER, turtle)
        self.simulation.driver = self.driver = WebDriver(parameters.max_velocity)
        self.simulation.after_step = self._after_step
        self.odometer = Odometer(parameters.wheel_radius)
        self._last_pose: TurtlePose | None = None
        self._samples: list[tuple[float, float, float, float]] = []
        self._released_at = -PLOT_TIME
        self._target = 0.0
        self.place(*self.placed)

    def call(self, name: str, *arguments: str) -> str:
        """Call a method, and return an empty string on success or the text of a ValueError."""
        try:
            getattr(self, name)(*arguments)
        except ValueError as error:
            return str(error)
        return ''

    def constants(self) -> str:
        """Return the sliders (name, label, limits, value) and scene dimensions (m) as JSON."""
        values = {**dict(zip('xyz', self.placed)), 'tilt': 0.0, **asdict(self.defaults)}
        sliders = [
            (name, f'{rule.description} ({rule.unit})', rule.lower, rule.upper, values[name])
            for name, rule in self.rules.items()]
        return json.dumps({'sliders': sliders, 'size': ARENA_SIZE, 'height': MAX_HEIGHT,
                           'brick': self.parameters.brick_size,
                           'wall': self.parameters.wall_height})

    def update(self, form: str) -> None:
        """Apply all changes in an HTML form given as JSON, or none if a value is invalid."""
        new = json.loads(form)
        values = {name: rule.convert(name, _number(new[name]))
                  for name, rule in self.rules.items()}
        changed = {name for name, value in new.items() if value != self.form.get(name)}
        if changed.intersection(ADJUSTABLE):
            # The robot keeps its pose, and the brick returns to its last placed position.
            self.start(replace(self.parameters, **{name: values[name] for name in ADJUSTABLE}),
                       self.simulation.turtle.pose[:3])
            changed.add('tilt')  # The platform of a new simulation is level.
        self.form = new
        if changed & {'x', 'y', 'z'}:
            self.place(*(values[name] for name in 'xyz'))
        if 'tilt' in changed:
            self.simulation.tilt(values['tilt'])

    def settings(self) -> str:
        """Return the last applied values of the HTML form as JSON."""
        return json.dumps(self.form)

    def place(self, x: float, y: float, z: float) -> None:
        """Place the brick at a point (m) in the world frame."""
        self.simulation.world.brick = self.placed = (x, y, z)
        self.simulation.decisions.clear()
        self._release_at = math.inf
        self._is_undecided = False

    def drop(self, delay: float = 0.1) -> None:
        """Drop the brick after a delay (s). If the brick has fallen, place it again first."""
        world = self.simulation.world
        if world.state in (BrickState.GROUNDED, BrickState.FLOATING):
            self.place(*self.placed)
        if world.state is not BrickState.HOVERING:
            world.release()  # Always raises ValueError.
        self._release_at = self.simulation.time + delay

    def advance(self, seconds: float) -> str:
        """Simulate for a given duration (s), and return the scene as JSON."""
        self._target += seconds
        if self.simulation.time < self._target:
            self.simulation.run(lambda: self.simulation.time >= self._target)
        simulation, world = self.simulation, self.simulation.world
        decision = simulation.decisions[-1][1] if simulation.decisions else None
        warning = 'Unreachable' if decision and not decision.reachable else ''
        counts = ', '.join(f'{count} {outcome}' for outcome, count in self.counts.items())
        return json.dumps({
            'robot': simulation.turtle.pose[:3],
            'joints': {'stem_joint': simulation.driver.stem_angle,
                       'wheel_joint': self.odometer.wheel_angle,
                       'platform_joint': simulation.tilt_angle},
            'brick': world.brick, 'orientation': world.orientation,
            'guaranteed': max(guaranteed_distance(self.placed[2], self.parameters), 0.0),
            'texts': {'drops': counts, 'brick_state': world.state.value,
                      'hint': HINTS.get(world.state, ''),
                      'catcher_state': simulation.catcher.state.value,
                      'catcher_decision': decision.summary if decision else 'none yet',
                      'unreachable': warning}})

    def plots(self) -> str:
        """Return an SVG plot of the brick's height and the robot's speeds during the last drop."""
        fastest = self.parameters.max_velocity
        lines = ''
        for column, top, base, color in ((1, MAX_HEIGHT, 110, 'red'), (2, fastest, 230, 'gray'),
                                         (3, fastest, 230, 'blue')):
            points = ' '.join(
                f'{400.0 * sample[0] / PLOT_TIME:.0f},{base - 90.0 * sample[column] / top:.1f}'
                for sample in self._samples)
            lines += f'<polyline points="{points}" fill="none" stroke="{color}"/>'
        return f"""<svg viewBox="0 0 400 250" preserveAspectRatio="xMinYMin" font-size="14">{lines}
            <text y="14">height of the brick (red), 0 to {MAX_HEIGHT:g} m</text>
            <text y="134">commanded (gray) and real (blue) speed, 0 to {fastest:g} m/s</text>
            <text y="246">time since the release, 0 to {PLOT_TIME:g} s</text></svg>"""

    def _after_step(self) -> None:
        """Release or place the brick if due, and update the odometry, plots and drop counts."""
        simulation, world, driver = self.simulation, self.simulation.world, self.driver
        driver.predicts = 'last_pose' not in self.form
        if driver.pose is not None and driver.pose is not self._last_pose:
            self._last_pose = driver.pose
            self.odometer.observe(self.simulation.time, driver.pose, driver.stem_angle)
            if (time := self.simulation.time - self._released_at) < PLOT_TIME:
                self._samples.append((time, world.brick[2], math.hypot(*simulation.commanded),
                                      driver.pose.linear_velocity))
        if self.simulation.time >= self._release_at:
            world.release()
            self._release_at, self._released_at = math.inf, self.simulation.time
            self._is_undecided, self._samples = True, []
        elif self._is_undecided and world.state is not BrickState.FALLING:
            self._is_undecided = False
            accepted = any(decision.reachable for _, decision in simulation.decisions)
            refused = 'missed' if accepted else 'refused'
            self.counts['caught' if world.state is BrickState.RIDING else refused] += 1
        elif ('random' in self.form and self._release_at == math.inf
              and world.state not in (BrickState.FALLING, BrickState.RIDING)
              and simulation.catcher.state is State.WAITING):
            low = resting_height(self.parameters) + 1.0
            x, y = self.random.uniform(0.0, ARENA_SIZE), self.random.uniform(0.0, ARENA_SIZE)
            self.place(x, y, self.random.uniform(low, MAX_HEIGHT))
            self.drop(0.7)


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def describe_robot(parameters: Parameters) -> str:
    """
    Return the URDF of a robot.

    :raises ValueError: if the robot description rejects the parameters
    """
    PARAMETERS.write_text(yaml.safe_dump({'/**': {'ros__parameters': asdict(parameters)}}))
    try:
        return xacro.process_file(str(XACRO), mappings={'params_file': str(PARAMETERS)}).toxml()
    except xacro.XacroException as error:
        raise ValueError(error.args[0]) from error
