# SPDX-License-Identifier: Apache-2.0
"""Test Driver in a closed loop with turtlesim's kinematics."""

from dataclasses import replace
from math import cos, dist, hypot, pi, sin

from defaults import PARAMETERS
from hypothesis import assume, given
from hypothesis import strategies as st
from laws import law
from turtle_brick.core.driving import BRAKING_TIME
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE, nearest_in_arena
from turtle_brick_tools.simulation import Delays, JITTER, Simulation

places = st.floats(0.0, ARENA_SIZE)
headings = st.floats(-pi, pi)


@law(24)
@given(speed=st.floats(-1.0, 3.0).map(lambda exponent: 10.0 ** exponent), x=places, y=places,
       theta=headings, time=st.floats(0.0, 1.5) | st.floats(0.0, 0.05), angle=headings,
       seed=st.integers(0, 2 ** 32), delays=st.sampled_from((JITTER, Delays())))
def test_driver_arrives_in_time_without_overshoot(speed, x, y, theta, time, angle, seed, delays):
    """The turtle drives in a straight line, even with timer jitter."""
    goal = nearest_in_arena(x + time * speed * cos(angle), y + time * speed * sin(angle))
    simulation = Simulation(replace(PARAMETERS, max_velocity=speed), seed, delays, (x, y, theta))
    simulation.rest(0.3)
    start, samples = simulation.turtle.pose, []
    distance = dist(start[:2], goal)
    assume(distance > 1e-3)
    simulation.after_step = lambda: samples.append((simulation.turtle.pose, simulation.commanded))
    simulation.driver.drive_to(*goal)
    simulation.rest(distance / speed + 12.0 * BRAKING_TIME + 0.2)
    ex, ey = (goal[0] - start.x) / distance, (goal[1] - start.y) / distance
    for pose, command in samples:
        assert hypot(*command) <= speed * (1.0 + 1e-12)
        dx, dy = pose.x - goal[0], pose.y - goal[1]
        assert dx * ex + dy * ey <= 0.002
        assert abs(dx * ey - dy * ex) <= 0.005
    # Repeating a goal that has been reached does not move the turtle.
    samples.clear()
    simulation.driver.drive_to(*goal)
    simulation.rest(0.3)
    assert simulation.driver.arrived
    assert all(dist(pose[:2], goal) <= 0.005 and command == (0.0, 0.0)
               for pose, command in samples)
