# SPDX-License-Identifier: Apache-2.0
"""Test the stand-in for turtlesim through its ROS interface and against recordings."""

from itertools import pairwise
import json
from math import ceil, inf, nan, pi
import os
from pathlib import Path
import signal
from statistics import median
import subprocess
import termios
from typing import NamedTuple

from action_msgs.msg import GoalStatus
from geometry_msgs.msg import Twist, Vector3
from live_graph import LiveGraph, process, TIMEOUT
import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.action import ActionClient
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from recordings import assert_reproduced
from std_srvs.srv import Empty
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, ARENA_SIZE, TICK
from turtle_brick_tools.graph import executable
from turtle_graph.client.domains import reserved_domain
from turtle_graph.client.record import message_rate
from turtlesim.action import RotateAbsolute
from turtlesim.msg import Pose
from turtlesim.srv import Kill, SetPen, Spawn, TeleportAbsolute, TeleportRelative
from turtlesim_standin.simulator import HEADING_TOLERANCE, SimulatedTurtle, TurtleSim

RECORDINGS = sorted((Path(__file__).parent / 'data' / 'turtlesim').glob('*.json'))
assert len(RECORDINGS) == 14, '7 scenarios with services, each with the turtle holonomic and not'

COMMAND = [executable('turtlesim', 'turtlesim_node')]


@pytest.fixture(scope='module')
def live():
    with reserved_domain() as domain_id, LiveGraph(domain_id) as live:
        yield live


@pytest.fixture(scope='module', autouse=True)
def turtlesim(live):
    with process(COMMAND, live.domain_id, stop=None) as turtlesim:
        yield turtlesim
        before = turtlesim.output
        assert turtlesim.stop(signal.SIGTERM) == 0
        assert turtlesim.output == before


@pytest.fixture
def poses(live):
    live.call('reset', Empty)
    poses = poses_of(live, 'turtle1')
    wait_for_pose(live, poses, lambda pose: pose.x == pose.y == ARENA_CENTER, 'the start')
    return poses


def poses_of(live, turtle):
    poses = live.record(f'{turtle}/pose', Pose)
    live.wait_for(lambda: poses.messages, TIMEOUT, f'a pose of {turtle}')
    return poses


def wait_for_pose(live, poses, condition, name):
    return live.wait_for(lambda: condition(poses.last) and poses.last, TIMEOUT, name)


def test_the_interfaces_also_have_the_name_of_later_releases():
    with pytest.warns(UserWarning, match='turtlesim_msgs came after ROS 2 Jazzy'):
        from turtlesim_msgs.msg import Pose as LaterPose
        from turtlesim_msgs.srv import Spawn as LaterSpawn
    assert (LaterPose, LaterSpawn) == (Pose, Spawn)


def test_poses_are_published_at_62_5_hz(live, poses):
    """turtlesim_node skips late ticks."""
    first = poses.messages[0]
    live.wait_for(lambda: len(poses.messages) > 100 and median(
        later - earlier for earlier, later in pairwise(poses.times)) == pytest.approx(
            TICK, rel=0.15), TIMEOUT, '62.5 Hz')
    assert message_rate(poses.times) < 63.5
    assert (first.x, first.y, first.theta) == (ARENA_CENTER, ARENA_CENTER, 0.0)
    for find in (lambda: live.listener.get_publishers_info_by_topic('turtle1/pose'),
                 lambda: live.listener.get_subscriptions_info_by_topic('turtle1/cmd_vel')):
        qos = live.wait_for(find, TIMEOUT, 'the topic')[0].qos_profile
        assert qos.reliability == ReliabilityPolicy.RELIABLE
        assert qos.durability == DurabilityPolicy.VOLATILE


def test_command_moves_turtle_for_one_second(live, poses):
    commands = live.publisher('turtle1/cmd_vel', Twist)
    commands.publish(Twist(linear=Vector3(x=1.0, y=1.0)))
    wait_for_pose(live, poses, lambda pose: pose.linear_velocity > 0.0, 'motion')
    end = wait_for_pose(live, poses, lambda pose: pose.linear_velocity == 0.0, 'the end')
    # Ticks that a busy machine skips do not extend the timeout of a command.
    ticks = (end.x - ARENA_CENTER) / TICK
    assert ticks == pytest.approx(round(ticks), abs=1e-3)
    assert 0 < ticks < 64.5
    assert end.y == ARENA_CENTER
    answer = live.call('turtlesim/set_parameters', SetParameters, SetParameters.Request(
        parameters=[Parameter(name, value=value).to_parameter_msg() for name, value in (
            ('holonomic', True), ('background_r', 150), ('background_g', 300))]))
    assert [result.successful for result in answer.results] == [True, True, False]
    commands.publish(Twist(linear=Vector3(y=1.0)))
    pose = wait_for_pose(live, poses, lambda pose: pose.y > ARENA_CENTER, 'sideways motion')
    assert pose.linear_velocity == 1.0


def test_teleport_services_move_turtle_at_once(live, turtlesim, poses):
    def jump(x, y):
        live.call('turtle1/teleport_absolute', TeleportAbsolute,
                  TeleportAbsolute.Request(x=x, y=y, theta=0.0))

    jump(2.0, 3.0)
    wait_for_pose(live, poses, lambda pose: (pose.x, pose.y) == (2.0, 3.0), 'the jump')
    live.call('turtle1/teleport_relative', TeleportRelative,
              TeleportRelative.Request(linear=1.0, angular=pi / 2))
    pose = wait_for_pose(live, poses, lambda pose: pose.theta != 0.0, 'the relative jump')
    assert (pose.x, pose.y, pose.theta) == pytest.approx((2.0, 4.0, pi / 2), abs=1e-6)
    jump(20.0, 3.0)
    wait_for_pose(live, poses, lambda pose: pose.x == ARENA_SIZE, 'the wall')
    turtlesim.wait_for_output(r'\[WARN\].*Oh no! I hit the wall! \(Clamping from \['
                              r'x=20\.000000, y=8\.088889\]\)', TIMEOUT)


@pytest.fixture
def rotate(live, poses):
    """Return a function that sends a rotation goal, and a function that returns its outcome."""
    client = ActionClient(live.listener, RotateAbsolute, 'turtle1/rotate_absolute')
    live.wait_for(client.server_is_ready, TIMEOUT, 'the action')

    def get(future):
        live.wait_for(future.done, TIMEOUT, 'the response')
        return future.result()

    def outcome(goal):
        response = get(goal.get_result_async())
        return response.status, response.result.delta

    yield lambda theta, feedback=None: get(client.send_goal_async(
        RotateAbsolute.Goal(theta=theta), feedback)), outcome, get
    client.destroy()


def test_rotation_reports_its_progress_and_ends_at_the_goal(poses, rotate):
    send, outcome, _ = rotate
    remaining = []
    status, delta = outcome(send(-0.5, lambda message: remaining.append(
        message.feedback.remaining)))
    assert status == GoalStatus.STATUS_SUCCEEDED
    assert delta == pytest.approx(0.5, abs=0.021)
    assert remaining == sorted(remaining)
    assert remaining[0] == pytest.approx(-0.5, abs=0.1)
    assert remaining[-1] == pytest.approx(0.0, abs=0.02)
    assert poses.last.theta == pytest.approx(-0.5, abs=0.021)


def test_rotation_ends_when_canceled_replaced_or_overridden(live, turtlesim, poses, rotate):
    send, outcome, get = rotate
    commands = live.publisher('turtle1/cmd_vel', Twist)
    goal = send(3.0)
    wait_for_pose(live, poses, lambda pose: pose.theta > 0.1, 'the rotation')
    get(goal.cancel_goal_async())
    status, delta = outcome(goal)
    assert status == GoalStatus.STATUS_CANCELED
    assert -3.0 < delta < -0.08
    wait_for_pose(live, poses, lambda pose: pose.angular_velocity == 0.0, 'the end')
    live.call('turtle1/teleport_absolute', TeleportAbsolute, TeleportAbsolute.Request())
    first, second = send(3.0), send(-3.0)
    turtlesim.wait_for_output('Rotation goal received before a previous goal', TIMEOUT)
    result = second.get_result_async()
    live.wait_for(lambda: commands.publish(Twist()) or result.done(), TIMEOUT, 'the end')
    assert outcome(first)[0] == outcome(second)[0] == GoalStatus.STATUS_ABORTED
    for message in ('Rotation goal canceled',
                    'Velocity command received during rotation goal. Aborting goal'):
        turtlesim.wait_for_output(message, TIMEOUT)


def test_turtles_are_spawned_and_killed(live, turtlesim, poses):
    def spawn(name):
        return live.call('spawn', Spawn, Spawn.Request(x=2.0, y=3.0, theta=0.5, name=name)).name

    def wait_for_removal(turtle):
        live.wait_for(lambda: live.listener.count_publishers(f'{turtle}/pose') == 0, TIMEOUT,
                      turtle)

    assert [spawn(name) for name in ('bob', 'bob', 'no such name', '')] == [
        'bob', '', '', 'turtle2']
    pose = poses_of(live, 'bob').last
    assert (pose.x, pose.y, pose.theta) == (2.0, 3.0, 0.5)
    for _ in range(2):
        live.call('kill', Kill, Kill.Request(name='bob'))
        wait_for_removal('bob')
    for message in (r'Spawning turtle \[turtle1\] at x=\[5\.544445\], y=\[5\.544445\], theta=\[0',
                    r'\[ERROR\].*A turtle named \[bob\] already exists\n',
                    r'A turtle cannot be named \[no such name\]',
                    r'\[ERROR\].*Tried to kill turtle \[bob\], which does not exist\n'):
        turtlesim.wait_for_output(message, TIMEOUT)
    live.call('reset', Empty)
    wait_for_removal('turtle2')


def test_drawing_services_only_log_a_warning(live, turtlesim):
    live.call('clear', Empty)
    live.call('turtle1/set_pen', SetPen)
    turtlesim.wait_for_output(r'\[WARN\].*this stand-in for turtlesim has no pen\n', TIMEOUT)


def test_mimic_copies_the_velocities_of_draw_square(live, poses):
    copy = live.record('copy', Twist)
    with process([executable('turtlesim', 'mimic'), '--ros-args', '-r', 'output/cmd_vel:=copy',
                  '-r', 'input/pose:=turtle1/pose'], live.domain_id):
        with process([executable('turtlesim', 'draw_square')], live.domain_id):
            live.wait_for(lambda: copy.last and copy.last.linear.x == 1.0, TIMEOUT, 'the side')
            live.wait_for(lambda: copy.last.angular.z > 0.39, TIMEOUT, 'the turn')
            assert poses.last.x > ARENA_CENTER + 1.8


def test_keys_drive_and_turn_the_turtle_until_q_is_pressed(live, poses):
    keyboard, terminal = os.openpty()
    before = termios.tcgetattr(terminal)
    with subprocess.Popen(
            [executable('turtlesim', 'turtle_teleop_key')], stdin=terminal,
            env={**os.environ, 'ROS_DOMAIN_ID': str(live.domain_id)}) as program:
        try:
            for key, velocity in ((b'\x1b[A', (2.0, 0.0)), (b'x\x1b[D', (0.0, 2.0))):
                live.wait_for(lambda: os.write(keyboard, key) and velocity == (
                    poses.last.linear_velocity, poses.last.angular_velocity), TIMEOUT, 'motion')
            # The motion ends 1 s after the last key that was written in the loop.
            wait_for_pose(live, poses, lambda pose: pose.angular_velocity == 0.0, 'the end')
            os.write(keyboard, b'r')
            wait_for_pose(live, poses, lambda pose: abs(pose.theta - pi / 2) < 0.021, 'the turn')
            os.write(keyboard, b'b')  # A half turn, with the key v, could be in either direction.
            wait_for_pose(live, poses, lambda pose: pose.theta < 1.0, 'the turn to the right')
            live.wait_for(lambda: os.write(keyboard, b'f') and poses.last.angular_velocity == 0.0,
                          TIMEOUT, 'the end of the rotation')
            assert poses.last.theta > -pi / 4 + 0.1
            os.write(keyboard, b'q')
            assert program.wait(TIMEOUT) == 0
        finally:
            program.kill()
    assert termios.tcgetattr(terminal) == before


def test_invalid_parameter_ends_node_with_one_line(domain_id):
    with process([*COMMAND, '--ros-args', '-p', 'holonomic:=abc'], domain_id,
                 stop=None) as running:
        assert running.wait(TIMEOUT) == 1
        assert "'holonomic' to 'abc'" in running.output
        assert len(running.output.splitlines()) == 1


@pytest.mark.parametrize('value', (nan, inf, -inf, 1e300))
def test_teleports_end_inside_the_arena_or_with_invalid_numbers(value):
    sim = TurtleSim()
    sim.tick(0.0)
    turtle = sim.turtles['turtle1']
    for x, y in ((0.0, 0.0), (ARENA_SIZE, ARENA_SIZE), (5.0, 20.0), (5.0, -2.0)):
        turtle.teleport_absolute(x, y, 0.0)
        assert turtle.tick(TICK)[:2] == (x, min(max(y, 0.0), ARENA_SIZE))
        assert turtle.clamped == (None if y >= 0.0 else (5.0, ARENA_SIZE + 2.0))
    for act in (turtle.teleport_absolute, turtle.teleport_relative):
        act(*[value] * (3 if act == turtle.teleport_absolute else 2))
        assert len(sim.tick(2 * TICK)['turtle1']) == 5
    sim.reset()
    assert sim.tick(3 * TICK)['turtle1'][:2] == (ARENA_CENTER, ARENA_CENTER)


@pytest.mark.parametrize('start, goal, rotation', [
    (0.0, 1.5, 1.5), (0.5, -1.0, -1.5), (3.0, -3.0, 2 * pi - 6.0), (1.0, 1.0 + 4 * pi, 0.0)])
def test_turtle_turns_to_its_goal_heading_the_shorter_way(start, goal, rotation) -> None:
    """The turtle turns at 1 rad/s, also at a wall, and stops within 0.02 rad of the goal."""
    turtle = SimulatedTurtle(0.0, ARENA_CENTER, start, holonomic=False, now=0.0)
    turtle.command(-1.0, 0.0, 0.0)
    turtle.tick(0.0)
    turtle.rotate_to(goal)
    poses = [turtle.tick(0.0) for _ in range(100)]
    turning = [pose for pose in poses if pose.angular_velocity]
    assert turtle.reached and turtle.goal is None
    assert len(turning) == max(0, ceil((abs(rotation) - HEADING_TOLERANCE) / TICK))
    assert {(pose.linear_velocity, pose.angular_velocity * rotation > 0.0)
            for pose in turning} <= {(0.0, True)}
    assert poses[-1][3:] == (0.0, 0.0)
    assert turtle.delta == pytest.approx(-rotation, abs=HEADING_TOLERANCE)
    assert turtle.remaining == pytest.approx(rotation + turtle.delta, abs=1e-5)


def test_velocity_command_removes_the_goal_heading() -> None:
    turtle = SimulatedTurtle(holonomic=False, now=0.0)
    turtle.rotate_to(1.0)
    turtle.tick(0.0)
    turtle.command(2.0, 0.0, 0.0)
    assert turtle.tick(TICK)[3:] == (2.0, 0.0)
    assert turtle.goal is None and not turtle.reached


class Call(NamedTuple):
    """A recorded service call, or the recorded poses of two turtles at a given time (s)."""

    begin: float
    end: float
    service: str
    request: dict
    reply: dict


def calls_of(events: list[list]) -> list[Call]:
    calls = []
    for index, (begin, kind, name, content) in enumerate(events):
        if kind == 'call':
            end = next(row[0] for row in events[index:] if row[1] == 'done')
            replies = [row[3] for row in events[index + 1:index + 3] if row[1] == 'reply']
            calls.append(Call(begin, end, name.split('/')[-1], content, *replies or [{}]))
        elif kind == 'poses':
            calls.append(Call(begin, begin, 'poses', {}, {'poses': content['rows']}))
    return calls


def perform(call: Call, sim: TurtleSim, now: float) -> bool:
    """Repeat a recorded call, and return whether the result is the same."""
    if call.service == 'poses':
        poses = {sim.turtles[name].pose[:3] for name in ('far', 'turtle2')}
        return poses == {tuple(row) for row in call.reply['poses']}
    if call.service == 'spawn':
        return sim.spawn(**call.request, now=now) == call.reply['name']
    if call.service == 'kill':
        assert sim.kill(**call.request) == (call.request['name'] != 'nosuch')
    elif call.service == 'reset':
        sim.reset(now)
    else:
        getattr(sim.turtles['turtle1'], call.service)(**call.request)
    return True


@pytest.mark.parametrize('path', RECORDINGS, ids=lambda path: path.stem)
def test_every_recorded_tick_is_reproduced(path: Path) -> None:
    recording = json.loads(path.read_text())
    sim = TurtleSim(recording['holonomic'])
    assert sim.tick(0.0) == {}
    assert_reproduced(recording, sim, lambda sim: sim.turtles['turtle1'],
                      lambda sim, time: sim.tick(time)['turtle1'],
                      calls_of(recording['events']), perform)
