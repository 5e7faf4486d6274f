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
Run the exercise in a web page.

The page loads this module with Pyodide. Python and JavaScript exchange structured data as JSON.
"""

from dataclasses import asdict
import json
from math import hypot, inf
from pkgutil import get_data
from random import Random

from small_xacro import expand
from turtle_brick.core.catch_logic import State
from turtle_brick.core.odometry import Odometer
from turtle_brick.core.parameters import PARAMETER_RULES, Parameters
from turtle_brick.core.reachability import guaranteed_distance, resting_height
from turtle_brick.core.time_steps import SECONDS_PER_NS
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, ARENA_SIZE, TurtlePose
from turtle_brick.physics import Phase
from turtle_brick.tools.simulation import JITTER, Simulation

ADJUSTABLE = ('max_velocity', 'gravity_accel', 'platform_radius', 'tilt_angle')
"""Parameters with a slider."""

MAX_HEIGHT = 10.0
"""Maximum height (m) of the brick."""

PLOT_TIME = 6.0
"""Duration (s) of the plots."""


class WebArena:
    """One arena with a robot and a brick."""

    def __init__(self) -> None:
        """Start with the values in turtle.yaml and the robot in the center."""
        data = json.loads(get_data('turtle_brick', 'robot.json') or '')
        self.defaults, self.xacro = data['parameters'], data['xacro']
        self.random = Random()
        self.counts = {'caught': 0, 'refused': 0, 'missed': 0}
        self.form: dict[str, str] = {}
        self.placed = tuple(self.defaults['brick_start'])
        self.start(Parameters.from_mapping(self.defaults), (ARENA_CENTER, ARENA_CENTER, 0.0))

    def start(self, parameters: Parameters, turtle: tuple[float, float, float]) -> None:
        """Start a simulation with the turtle at x, y (m) and theta (rad)."""
        self.parameters = parameters
        self.urdf = expand(self.xacro, asdict(parameters))
        self.simulation = Simulation(parameters, self.random.randrange(10 ** 6), JITTER, turtle)
        self.simulation.after_step = self._after_step
        self.odometer = Odometer(parameters.wheel_radius)
        self._last_pose: TurtlePose | None = None
        self._samples: list[tuple[float, float, float, float]] = []
        self._released_at = -PLOT_TIME
        self._target = 0.0
        self.place(*self.placed)

    @property
    def time(self) -> float:
        """Get the simulated time in seconds."""
        return self.simulation.now * SECONDS_PER_NS

    def call(self, name: str, *arguments: str) -> str:
        """Call a method, and return the message of its ValueError or an empty string."""
        try:
            getattr(self, name)(*arguments)
        except ValueError as error:
            return str(error)
        return ''

    def constants(self) -> str:
        """Return the sliders (name, label, limits, value) and the dimensions (m) of the scene."""
        x, y, z = self.placed
        lowest, tilt = resting_height(self.parameters), PARAMETER_RULES['tilt_angle'].upper
        sliders = [('z', 'Height of the brick (m)', lowest, MAX_HEIGHT, z),
                   ('tilt', 'Angle of the platform (rad)', -tilt, tilt, 0.0)]
        for name in ADJUSTABLE:
            rule = PARAMETER_RULES[name]
            sliders.append((name, f'{rule.description} ({rule.unit})', rule.lower, rule.upper,
                            self.defaults[name]))
        return json.dumps({'sliders': sliders, 'start': (x, y), 'size': ARENA_SIZE,
                           'brick': self.parameters.brick_size,
                           'wall': self.parameters.wall_height})

    def update(self, form: str) -> None:
        """Apply the changed values in the form (JSON)."""
        before, self.form = self.form, json.loads(form)
        changed = {name for name, value in self.form.items() if value != before.get(name)}
        if changed.intersection(ADJUSTABLE):
            # The robot and the brick stay in place.
            values = {name: float(self.form[name]) for name in ADJUSTABLE}
            self.start(Parameters.from_mapping({**self.defaults, **values}),
                       self.simulation.turtle.pose[:3])
        if changed & {'x', 'y', 'z'}:
            self.place(*(float(self.form[name] or 'nan') for name in 'xyz'))
        if 'tilt' in changed:
            self.simulation.tilt(float(self.form['tilt']))

    def place(self, x: float, y: float, z: float) -> None:
        """Place the brick at a point (m) in the world frame."""
        self.simulation.world.brick = self.placed = (x, y, z)
        self.simulation.decisions.clear()
        self._release_at = inf
        self._is_undecided = False

    def drop(self, delay: float = 0.1) -> None:
        """Drop the brick after a delay (s). A brick that has already fallen is placed again."""
        world = self.simulation.world
        if world.phase in (Phase.GROUNDED, Phase.FLOATING):
            self.place(*self.placed)
        if world.phase is not Phase.HOVERING:
            world.release()  # This raises a ValueError with the reason.
        self._release_at = self.time + delay

    def advance(self, seconds: float) -> str:
        """Simulate for a duration (s), and return the scene."""
        self._target += seconds
        if self.time < self._target:
            self.simulation.run(lambda: self.time >= self._target)
        simulation, world = self.simulation, self.simulation.world
        decision = simulation.decisions[-1][1] if simulation.decisions else None
        is_refused = decision is not None and not decision.reachable
        counts = ', '.join(f'{count} {outcome}' for outcome, count in self.counts.items())
        return json.dumps({
            'robot': simulation.turtle.pose[:3],
            'joints': {'stem_joint': self.odometer.stem_angle,
                       'wheel_joint': self.odometer.wheel_angle,
                       'platform_joint': simulation.tilt_angle},
            'brick': world.brick, 'orientation': world.orientation,
            'guaranteed': max(guaranteed_distance(self.placed[2], self.parameters), 0.0),
            'texts': {'drops': counts, 'brick_state': world.phase.value,
                      'catcher_state': simulation.catcher.state.value,
                      'catcher_decision': decision.summary if decision else 'none yet',
                      'unreachable': 'Unreachable' if is_refused else ''}})

    def plots(self) -> str:
        """Return an SVG image of the brick's height and the robot's speeds in the last drop."""
        times, *curves = zip(*self._samples or [(0.0, self.placed[2], 0.0, 0.0)])
        tops = (MAX_HEIGHT, self.parameters.max_velocity, self.parameters.max_velocity)
        lines = ''
        for values, top, base, color in zip(curves, tops, (110, 230, 230),
                                            ('red', 'gray', 'blue')):
            points = ' '.join(f'{400.0 * time / PLOT_TIME:.0f},{base - 90.0 * value / top:.1f}'
                              for time, value in zip(times, values))
            lines += f'<polyline points="{points}" fill="none" stroke="{color}"/>'
        for y, text in ((14, f'height of the brick (red), 0 to {MAX_HEIGHT:g} m'),
                        (134, f'commanded (gray) and real (blue) speed, 0 to {tops[1]:g} m/s'),
                        (246, f'time since the release, 0 to {PLOT_TIME:g} s')):
            lines += f'<text x="4" y="{y}" font-size="12">{text}</text>'
        return f'<svg viewBox="0 0 400 250">{lines}</svg>'

    def _after_step(self) -> None:
        """Continue the drop, and update the odometry, the samples and the counts."""
        simulation, world, driver = self.simulation, self.simulation.world, self.simulation.driver
        driver.predicts = 'last_pose' not in self.form
        self.odometer.steer(simulation.commanded)
        if driver.pose is not None and driver.pose is not self._last_pose:
            self._last_pose = driver.pose
            self.odometer.observe(self.time, driver.pose)
            time = self.time - self._released_at
            if time < PLOT_TIME:
                self._samples.append((time, world.brick[2], hypot(*simulation.commanded),
                                      driver.pose.linear_velocity))
        if self.time >= self._release_at:
            world.release()
            self._release_at, self._released_at = inf, self.time
            self._is_undecided, self._samples = True, []
        elif self._is_undecided and world.phase is not Phase.FALLING:
            self._is_undecided = False
            accepted = any(decision.reachable for _, decision in simulation.decisions)
            refused = 'missed' if accepted else 'refused'
            self.counts['caught' if world.phase is Phase.RIDING else refused] += 1
        elif ('random' in self.form and self._release_at == inf
              and world.phase not in (Phase.FALLING, Phase.RIDING)
              and simulation.catcher.state is State.WAITING):
            low = resting_height(self.parameters) + 1.0
            x, y, z = (self.random.random() for _ in range(3))
            self.place(x * ARENA_SIZE, y * ARENA_SIZE, low + z * (MAX_HEIGHT - low))
            self.drop(0.7)
