# SPDX-License-Identifier: Apache-2.0
"""
Test the closed-loop simulation and the two guarantees of the catcher.

The robot catches every brick that the catcher reports as reachable. The catcher never refuses a
brick within the `guaranteed_distance` of a robot at rest.
"""

from dataclasses import replace
from math import cos, dist, exp, inf, log, pi, sin
from random import Random

from defaults import NS_PER_SECOND, PARAMETERS, seconds
from hypothesis import given
from hypothesis import strategies as st
from laws import law
import pytest
from turtle_brick.core.brick_tracking import Fall
from turtle_brick.core.catch_logic import CENTER, State
from turtle_brick.core.reachability import decide_reachability, resting_height, time_needed
from turtle_brick.core.robot_tracking import GOAL_TOLERANCE, RobotState
from turtle_brick.core.turtlesim_arena import ARENA_SIZE
from turtle_brick.physics import BrickState
from turtle_brick_tools.simulation import (Delays, DETECTION_TIME, fall_time, guaranteed_distance,
                                           SimulatedDrop, Simulation)

STEP = 0.004

# Delays as in the live ROS graph but without timer jitter, and longer delays with jitter.
DELAYS = [Delays(), Delays(0.0010, 0.0040, 0.002, 0.0003)]


def random_parameters(random):
    radius = exp(random.uniform(log(0.1), log(1.0)))
    return replace(
        PARAMETERS,
        max_velocity=exp(random.uniform(log(0.4), log(10.0))),
        gravity_accel=random.uniform(1.5, 25.0),
        platform_radius=radius,
        platform_height=random.uniform(0.7, 2.5) + radius,
        tilt_angle=random.uniform(0.2, 1.5),
        brick_size=tuple(random.uniform(0.05, 0.4) for _ in range(3)))


def position_near_the_limit(random, simulation):
    """Return a random brick position (m), usually near the guaranteed distance."""
    parameters = simulation.parameters
    z = resting_height(parameters) + exp(random.uniform(log(0.3), log(12.0)))
    limit = guaranteed_distance(z, parameters)
    pose = simulation.turtle.pose
    for _ in range(100):
        near = random.random() < 0.7
        fraction = random.uniform(0.95, 1.05) if near else random.uniform(0.2, 1.2)
        distance, angle = fraction * max(limit, 0.05), random.uniform(-pi, pi)
        x, y = pose.x + distance * cos(angle), pose.y + distance * sin(angle)
        if 0.0 <= x <= ARENA_SIZE and 0.0 <= y <= ARENA_SIZE:
            return x, y, z
    return random.uniform(0.0, ARENA_SIZE), random.uniform(0.0, ARENA_SIZE), z


@pytest.mark.parametrize('delays', DELAYS)
def test_both_guarantees_hold(delays):
    random = Random(f'{delays}')
    verdicts = []
    for arena in range(10):
        parameters = random_parameters(random)
        simulation = Simulation(parameters, arena, delays, (
            random.uniform(0.0, ARENA_SIZE), random.uniform(0.0, ARENA_SIZE),
            random.uniform(-pi, pi)))
        simulation.rest(0.3)
        for _ in range(3):
            result = simulation.drop(position_near_the_limit(random, simulation))
            decision, case = result.decision, f'{parameters} {result}'
            guaranteed = guaranteed_distance(result.brick[2], parameters)
            assert not SimulatedDrop(0, arena, result, guaranteed).broken_guarantee, case
            # An unreachable brick is missed because the robot does not move.
            assert result.caught is decision.reachable, case
            assert simulation.world.state is (
                BrickState.FLOATING if result.caught else BrickState.GROUNDED), case
            time = fall_time(result.brick[2], parameters)
            assert 0.008 - 1e-9 <= result.decision_time <= 0.012 + 1e-9, case
            assert decision.available == pytest.approx(time - result.decision_time, abs=STEP), case
            if result.caught:
                assert 0.0 <= result.fall_time - time <= STEP + 1e-9, case
                assert dist(result.carried_to, CENTER) <= GOAL_TOLERANCE, case
                assert 0.0 < result.slide_time < 10.0, case
            verdicts.append(decision.reachable)
        assert len(simulation.decisions) == 3, parameters
    assert verdicts.count(True) >= 8
    assert verdicts.count(False) >= 5


def test_reachable_bricks_are_caught_in_every_state_of_the_catcher():
    random = Random(1)
    verdicts, states = [], set()
    for arena in range(14):
        simulation = Simulation(random_parameters(random), arena, DELAYS[1])
        simulation.rest(0.3)
        for _ in range(8):
            simulation.world.brick = position_near_the_limit(random, simulation)
            simulation.rest(random.choice((0.0, 0.004, 0.02, 0.05, 0.2)))
            states.add(simulation.catcher.state)
            earlier = len(simulation.decisions)
            simulation.world.release()
            if random.random() < 0.5:
                simulation.rest(random.uniform(0.0, 0.2))
                continue
            assert simulation.run(lambda: simulation.world.state is not BrickState.FALLING, 60.0)
            (_, decision), = simulation.decisions[earlier:]
            is_caught = simulation.world.state is BrickState.RIDING
            assert is_caught or not decision.reachable, f'{simulation.parameters} {decision}'
            verdicts.append(decision.reachable)
            if is_caught and random.random() < 0.5:
                simulation.run(lambda: simulation.catcher.state is State.TILTING, 20.0)
                simulation.rest(random.uniform(0.0, 1.5))
            else:
                simulation.rest(random.uniform(0.0, 0.5))
    assert verdicts.count(True) >= 10
    assert verdicts.count(False) >= 3
    assert states == set(State)


@pytest.mark.parametrize('delays', DELAYS)
def test_command_latency_is_neither_too_short_nor_too_long(delays):
    """The parameter command_latency exceeds the maximum simulated latency by 0 to 25 ms."""
    random = Random(f'{delays}')
    latencies = []
    for seed in range(50):
        simulation = Simulation(PARAMETERS, seed, delays)
        simulation.rest(0.3)
        distance, angle = random.uniform(0.6, 3.0), random.uniform(-pi, pi)
        start = simulation.turtle.pose[:2]
        goal = start[0] + distance * cos(angle), start[1] + distance * sin(angle)
        simulation.world.brick = (*goal, 20.0)
        simulation.rest(0.1)
        simulation.world.release()
        assert simulation.run(lambda: dist(simulation.world.platform.pose.position[:2], goal)
                              <= PARAMETERS.platform_radius, 5.0)
        drive = time_needed(goal, RobotState(*start), PARAMETERS) - PARAMETERS.command_latency
        (decided, _), = simulation.decisions
        latencies.append((simulation.now - decided) * 1e-9 - drive)
    latency = PARAMETERS.command_latency
    assert latency - 0.025 <= max(latencies) <= latency
    # The third position sample of the fall arrives at most 12 ms after the release.
    assert DETECTION_TIME >= 0.012


def test_fall_time_and_guaranteed_distance():
    rest, gravity = resting_height(PARAMETERS), PARAMETERS.gravity_accel
    assert fall_time(rest + 0.5 * gravity, PARAMETERS) == pytest.approx(1.0)
    assert fall_time(rest - 1.0, PARAMETERS) == 0.0
    blind = DETECTION_TIME + PARAMETERS.command_latency
    assert guaranteed_distance(rest + 0.5 * gravity, PARAMETERS) == pytest.approx(
        PARAMETERS.platform_radius + 3.0 * (1.0 - blind))
    assert guaranteed_distance(rest + 0.499 * gravity * blind ** 2, PARAMETERS) == -inf


@law(60)
@given(speed=st.floats(0.1, 10.0), radius=st.floats(0.05, 2.0), latency=st.floats(0.0, 0.5),
       above=st.floats(0.0, 20.0), distance=st.floats(0.0, 15.0), late=st.floats(0.0, 0.02))
def test_decision_keeps_the_guarantee(speed, radius, latency, above, distance, late):
    parameters = replace(PARAMETERS, max_velocity=speed, platform_radius=radius,
                         command_latency=latency)
    fall = Fall(NS_PER_SECOND, (5.0, 5.0, resting_height(parameters) + above), 0.0)
    decision = decide_reachability(fall, NS_PER_SECOND + seconds(late),
                                   RobotState(5.0 + distance, 5.0), parameters)
    guaranteed = guaranteed_distance(fall.position[2], parameters)
    if distance <= guaranteed and late <= DETECTION_TIME - 1e-6:
        assert decision.reachable
    if decision.reachable and decision.needed:
        assert distance <= max(guaranteed + speed * DETECTION_TIME + 1e-6, radius)
