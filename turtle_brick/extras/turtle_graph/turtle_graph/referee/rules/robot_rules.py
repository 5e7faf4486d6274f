# SPDX-License-Identifier: Apache-2.0
"""Rules for frames, names, rates, the robot_description and the robot node."""

from bisect import bisect_left
from collections.abc import Iterator, Mapping
from functools import partial
from itertools import pairwise
from math import asin, atan2, copysign, degrees, dist, hypot, isfinite, pi, remainder
from operator import itemgetter
from statistics import median
from typing import Any

import numpy
from turtle_graph.client.geometry import angle_between, Array, CENTER, inclination, Pose
from turtle_graph.client.messages import (nanoseconds_of, NS_PER_SECOND, read_pose,
                                          SECONDS_PER_NS)
from turtle_graph.client.record import (Drive, Frame, message_rate, POSE_PERIOD_NS, Received,
                                        Record, Sample, stamp_of)
from turtle_graph.referee.rules.robot_model import model
from turtle_graph.referee.rules.rule import (BEFORE_NS, Failed, Finding, from_faults, largest,
                                             NEAR, number, Open, Plot, RATE_TOLERANCE,
                                             require, require_accepted, require_clear,
                                             require_data, Rules, SAME_ANGLE, thin, within)

RULES = Rules()
rule = RULES.rule

RATE = 100.0
"""Required rate (Hz) of the robot's topics and of the base_link transform."""
PERIOD_NS = round(NS_PER_SECOND / RATE)
"""Period (ns) that corresponds to RATE."""
EXACT = 1e-3
"""Tolerance for equal numbers."""
PRECISION, IMPRECISION = 0.05, 0.2
"""Tolerance (m) for the final distance to a goal, the lateral deviation and the overshoot, and
the distance (m) up to which the assignment does not forbid larger values of these and others."""
MAX_SLIP = 0.02
"""Maximum slip of the wheel, as a fraction of the driven distance."""
MAX_MISALIGNMENT = 5.0
"""Maximum angle (degrees) between the robot's motion and the wheel's rolling direction."""
START_DISTANCE = 0.02
"""Minimum travel distance (m) for computing the direction of a drive."""
STRIDE = 5
"""Number of transform intervals over which a direction of motion is computed."""
COMMAND_AGE_NS = 50_000_000
"""Maximum interval (ns) between an odometry message and the command with the same twist."""
ODOM_DELAY_NS = 100_000_000
"""Maximum difference (ns) between the timestamps of equal poses on odom and in TF."""
MIN_STEADY, STEADY = 5, 0.01
"""Minimum number of equal rates that no load explains, and their maximum relative difference."""
ODOM_LOAD_DELAY = 0.5
"""Delay (s) of the pose on odom that the load of a machine can explain."""
CONFIGURED = ('platform_height', 'wheel_radius', 'max_velocity', 'gravity_accel')
"""Parameters that the assignment requires in config/turtle.yaml."""
GLOBAL_TOPICS = ('/tf', '/tf_static', '/rosout', '/parameter_events', '/clock')
"""Topics that ROS itself publishes outside any namespace."""


def frame(record: Record, name: str, parent: str = '') -> Frame:
    """Return a frame, or raise Failed if the frame is absent or has the wrong parent."""
    require_clear(record, name, f'frame {record.actual(name)}')
    broadcast = require(record.frames.get(record.actual(name)), f'no node broadcasts {name}')
    parents = {sample.parent for sample in broadcast.samples}
    if parent and parents != {record.actual(parent)}:
        raise Failed(f'the parent of {name} is {", ".join(sorted(parents))}')
    return broadcast


def messages(record: Record, name: str) -> list[Received]:
    """Return all messages received on a topic, or raise Failed if there are none."""
    require_clear(record, name)
    return require(record.topics[name], f'no messages on {record.profile.topics[name]}')


def turtle_track(record: Record, begin: int, end: int) -> list[tuple[float, float]]:
    """Return the positions (m) of the turtle in turtlesim between two times (ns)."""
    return [(pose.message.x, pose.message.y) for pose in record.messages('pose', begin, end)]


def wheel_radius(record: Record) -> float:
    """Return the configured radius (m) of the wheel, or that in the URDF if none is configured."""
    return record.profile.numbers.get('wheel_radius', model(record).wheel().size[0])


def drives(record: Record) -> list[Drive]:
    """Return all drives of more than 0.1 m, or raise Open if there are none."""
    require_clear(record, 'goal_pose', 'pose')
    return require_data([drive for drive in record.drives if drive.length > 0.1],
                        'the robot was not driven')


@rule('frames: world', 'All other frames are descendants of world',
      'every frame is a descendant of world', ['frames: odom', 'frames: brick', 'frames: robot'])
def all_below_world(record: Record) -> Finding:
    require(record.frames, 'no node broadcasts any frame')
    lost = [name for name in record.frames if record.ancestors(name)[-1] != record.actual('world')]
    finding = from_faults([f'{name} is not below world' for name in lost],
                          len(record.frames), 'frames')
    require(finding.met, finding.measured)  # No node broadcasts the missing connection.
    return finding


@rule('frames: odom', 'odom … a fixed offset from world … the initial location of the turtle',
      'odom is a fixed child of world at the initial position of the turtle')
def odom_is_fixed(record: Record) -> Finding:
    places = [sample.pose.position[:2] for sample in frame(record, 'odom', 'world').samples]
    moved = largest(dist(place, places[0]) for place in places)
    # The turtle may have been moved before odom was defined.
    starts = [CENTER, *((pose.message.x, pose.message.y) for pose in record.topics['pose'][:1])]
    offset = min(dist(places[0], start) for start in starts)
    return Finding(moved <= EXACT and offset <= NEAR, 'at ({:.3f}, {:.3f})'.format(*places[0])
                   + f', {offset:.3f} m from the start, moved by {moved:.3f} m')


@rule('frames: base_link', "The turtle's location relative to odom is … its wheel odometry",
      f'base_link is a child of odom and, at rest, within {NEAR} m of the turtle in turtlesim',
      ['frames: odom'], needs_calm=True)
def base_link_is_the_turtle(record: Record) -> Finding:
    frame(record, 'base_link', 'odom')
    require_clear(record, 'pose')
    off = []
    for end in [*(end for _, end in record.idle), *(drive.end for drive in record.drives)]:
        turtle = turtle_track(record, end - 150_000_000, end)
        base = record.pose('base_link', end - 20_000_000)
        if turtle and base and dist(turtle[0], turtle[-1]) <= EXACT:
            off.append(dist(base.position[:2], turtle[-1]))
    return within(NEAR, off, 'the turtle was not observed at rest', wrong=IMPRECISION)


@rule('frames: robot', "base_link has other child frames, as defined by the robot's urdf file",
      'every link of the URDF is a frame below base_link, and the wheel is on the ground')
def links_are_frames(record: Record) -> Finding:
    robot = model(record)
    absent = [link for link in robot.links if link != 'base_link'
              and record.actual('base_link') not in record.ancestors(link)]
    finding = from_faults([f'{link} is not in TF' for link in absent], len(robot.links), 'links')
    require(finding.met, finding.measured)
    poses = [record.pose('wheel', end) for _, end in record.trial_spans()]
    wheel, *_ = require_data(poses, 'the pose of the wheel in the world frame is unknown')
    center = wheel.transform(robot.pose('wheel').locate(robot.wheel().pose.position))
    height = center[2] - wheel_radius(record)
    side = 'above' if height >= 0.0 else 'below'
    return Finding(abs(height) <= NEAR,
                   f'{finding.measured}, the wheel is {abs(height):.3f} m {side} the ground')


@rule('frames: broadcasters', 'Broadcasting the … base_link frame …, the brick frame …',
      'every frame has one broadcaster')
def one_broadcaster(record: Record) -> Finding:
    require(record.frames, 'no node broadcasts any frame')
    require_clear(record, *(f'frame {name}' for name in record.frames))
    return from_faults([f'{name} has several broadcasters'
                        for name, frame in record.frames.items() if frame.broadcasters > 1],
                       len(record.frames), 'frames')


@rule('frames: timestamps', 'integrated into various standard ROS systems (e.g., tf, joint_states',
      'the timestamps of transforms, odom and joint_states are the current time')
def timestamps_are_current(record: Record) -> Finding:
    require(record.frames, 'no node broadcasts any frame')
    wrong = [name for name, frame in record.frames.items() if frame.wrong_stamps]
    for name in ('odom', 'joint_states'):
        if any(stamp_of(received) != nanoseconds_of(received.message.header.stamp)
               for received in record.topics[name]):
            wrong.append(f'messages on {record.profile.topics[name]}')
    return Finding(not wrong, f'0 or far from the current time: {", ".join(wrong)}' if wrong else
                   f'current in {len(record.frames)} frames')


@rule('names: relative', 'refer to ROS entities using relative names from within your nodes',
      'every topic and service except those of ROS itself is inside the namespace')
def names_are_relative(record: Record) -> Finding:
    if record.namespace == '/':
        raise Open('start the graph in a namespace, and pass the namespace with --namespace')
    own = f'{record.namespace}/'

    def inside(users: Mapping[str, set[str]]) -> list[str]:
        # The tools in a configuration file for rviz2 may publish absolute names.
        return [name for name, nodes in users.items() if name not in GLOBAL_TOPICS
                and any(node.startswith(own) and 'rviz' not in node for node in nodes)]

    require(inside(record.publishers), f'no node in {record.namespace} publishes anything')
    names = sorted({*inside(record.publishers), *inside(record.users)})
    return from_faults([f'{name} is outside the namespace' for name in names
                        if not name.startswith(own)], len(names), 'topics and services')


def pooled_rate(spans: list[list[float]]) -> float:
    """Return the message rate (Hz) in several time spans together, from the timestamps (s)."""
    count, elapsed = 0, 0.0
    for times in spans:
        rate = message_rate(times)
        if rate:
            count += len(times) - 1
            elapsed += (len(times) - 1) / rate
    return count / elapsed if elapsed else 0.0


def timestamps(record: Record, name: str, begin: int, end: int) -> list[float]:
    """Return the timestamps of a topic or frame in seconds, or raise Failed if it is absent."""
    if name in record.topics:
        messages(record, name)
        stamps = [stamp_of(received) for received in record.messages(name, begin, end)]
    else:
        stamps = [sample.stamp for sample in frame(record, name).between(begin, end)]
    return [stamp * SECONDS_PER_NS for stamp in stamps]


def judge_rate(record: Record, name: str, nominal: float) -> Finding:
    """Compare the rate of a topic or frame with a nominal rate (Hz) at rest and in all drives."""
    require_data(record.idle, 'the graph was not observed')
    at_rest = [timestamps(record, name, begin, end) for begin, end in record.idle]
    driving = [timestamps(record, name, drive.begin, drive.end) for drive in record.drives]
    if name == 'cmd_vel':  # The requirement "cmd_vel: at rest" judges missing commands.
        at_rest = [times for times in at_rest if times]
    rates = {label: pooled_rate(spans) for label, spans in (
        ('at rest', at_rest), ('driving', driving)) if spans}
    met = all(abs(rate / nominal - 1.0) <= RATE_TOLERANCE for rate in rates.values())
    text = ', '.join(f'{rate:.2f} Hz {label}' for label, rate in rates.items())
    for topic, nodes in record.publishers.items():
        if topic.endswith(f'/{record.profile.topics.get(name, name)}') and len(nodes) > 1:
            text += f', published by {" and ".join(sorted(nodes))}'
    if name == 'brick' and not met and max(rates.values()) <= nominal * (1.0 + RATE_TOLERANCE):
        raise Open(f'{text}; the physics may run at {nominal:g} Hz, but the brick is not '
                   'broadcast in every step')
    single = [message_rate(times) for times in [*at_rest, *driving]]
    if not met and len(single) >= MIN_STEADY and max(single) - min(single) <= STEADY * nominal:
        raise Failed(text)  # The load would not reduce all rates equally.
    return Finding(met, text)


for name in ('cmd_vel', 'odom', 'joint_states', 'base_link'):
    rule(f'rate: {name}', 'All publishing and broadcasting shall be done at 100 Hz',
         f'{RATE:g} Hz ± {RATE_TOLERANCE:.0%}', needs_calm=True)(
             partial(judge_rate, name=name, nominal=RATE))


def velocity(message: Any) -> tuple[float, float, float]:
    """Return the x and y velocities (m/s) and the yaw rate (rad/s) in a twist message."""
    twist = getattr(message, 'twist', message)
    return twist.linear.x, twist.linear.y, twist.angular.z


def top_speed(record: Record) -> float:
    """Return the maximum speed (m/s) in all commands."""
    return largest(hypot(*velocity(command.message)[:2]) for command in record.topics['cmd_vel'])


def step_length(record: Record) -> float:
    """Return the distance (m) that the robot drives in one turtlesim step at its top speed."""
    return top_speed(record) * POSE_PERIOD_NS * SECONDS_PER_NS


@rule('cmd_vel: at rest', 'If the turtle is not moving … a cmd_vel of 0',
      'every command is 0 while the robot is at rest', ['rate: cmd_vel'])
def commands_at_rest(record: Record) -> Finding:
    require_data(record.idle, 'the graph was not observed')
    speeds = []
    for begin, end in record.idle:
        commands = record.messages('cmd_vel', begin, end)
        require(commands, 'no commands while the robot was at rest')
        speeds += [hypot(*velocity(command.message)) for command in commands]
    for drive in record.drives:
        if record.is_calm(drive.begin, drive.end):
            require(record.messages('cmd_vel', drive.end - BEFORE_NS, drive.end),
                    'no commands after a drive')
    return Finding(largest(speeds) <= 1e-9,
                   f'{len(speeds)} commands, at most {largest(speeds):.3f}')


def require_frames(record: Record, odometry: Any) -> None:
    """Raise Failed unless an odometry message contains the pose of base_link in odom."""
    names = [name.removeprefix('/') for name in (
        odometry.header.frame_id, odometry.child_frame_id)]
    if names != [record.actual('odom'), record.actual('base_link')]:
        parent, child = (repr(name) if name else 'a frame without a name' for name in names)
        raise Failed(f'odom contains the pose of {child} in {parent}')


@rule('odom: pose', 'Publishing nav_msgs/Odometry message on the odom topic',
      'the pose of base_link in odom, equal to a pose in TF at the same time ± '
      f'{ODOM_DELAY_NS * SECONDS_PER_NS:g} s, except for one turtlesim tick',
      ['frames: base_link'], needs_calm=True)
def odometry_equals_tf(record: Record) -> Finding:
    transforms = frame(record, 'base_link', 'odom').samples
    stamps = numpy.array([sample.stamp for sample in transforms])
    places = numpy.array([sample.pose.position[:2] for sample in transforms])
    headings = numpy.array([sample.pose.axes[:2, 0] for sample in transforms])
    messages(record, 'odom')
    off, turned = [], []
    for begin, end in record.trial_spans():
        for odometry in record.messages('odom', begin, end):
            require_frames(record, odometry.message)
            pose, stamp = odometry.message.pose.pose, stamp_of(odometry)
            there = read_pose(pose.position, pose.orientation)
            near = slice(*numpy.searchsorted(
                stamps, (stamp - ODOM_DELAY_NS, stamp + ODOM_DELAY_NS)))
            if len(stamps[near]):
                off.append(min(numpy.hypot(*(places[near] - there.position[:2]).T)))
                turned.append(min(numpy.hypot(*(headings[near] - there.axes[:2, 0]).T)))
    require_data(off, 'there is no odometry message at the time of a transform')
    text = f'at most {largest(off):.3f} m and {largest(turned):.3f} rad off in {len(off)} messages'
    late = top_speed(record) * ODOM_LOAD_DELAY
    if numpy.quantile(off, 0.9) > late or median(turned) > SAME_ANGLE:
        raise Failed(text)
    # Between two transforms, the robot may have moved for one step of turtlesim.
    allowed = step_length(record) + EXACT
    return Finding(largest(off) <= allowed and largest(turned) <= SAME_ANGLE, text)


@rule('odom: twist', 'twist can be a direct copy of the latest cmd_vel',
      'the twist equals a recent cmd_vel in 99 of 100 messages', needs_calm=True)
def twist_is_command(record: Record) -> Finding:
    messages(record, 'odom')
    equal = []
    for drive in drives(record):
        for odometry in thin(record.messages('odom', drive.begin, drive.end)):
            twist = velocity(odometry.message.twist)
            commands = [velocity(command.message) for command in record.messages(
                'cmd_vel', odometry.published - COMMAND_AGE_NS,
                odometry.published + COMMAND_AGE_NS)]
            if any(map(any, (twist, *commands))):
                equal.append(any(dist(twist, command) < 1e-6 for command in commands))
    require_data(equal, 'the robot did not move')
    text = f'equal in {sum(equal)} of {len(equal)} messages'
    if sum(equal) < 0.5 * len(equal):
        raise Failed(text)
    return Finding(sum(equal) >= 0.99 * len(equal), text)


@rule('joint_states: names', 'Publishing the joint_states of the turtle robot',
      'exactly the movable joints of the URDF, with finite positions')
def joints_are_published(record: Record) -> Finding:
    received = [state.message for state in messages(record, 'joint_states')]
    movable = {joint.name for joint in model(record).joints if joint.movable}
    published = {name for message in received for name in message.name}
    finite = all(isfinite(position) for message in received for position in message.position)
    text = '; in the URDF: '.join(
        ', '.join(sorted(names)) or 'no movable joint' for names in (published, movable))
    if not finite:
        text += '; not every position is finite'
    return Finding(published == movable and finite, text)


@rule('URDF: base_link', 'A base_link that … is represented by a cube', 'base_link is a cube')
def base_is_a_cube(record: Record) -> Finding:
    size = model(record).solid('base_link', 'box').size
    return Finding(max(size) <= 1.02 * min(size), '{:.3f} x {:.3f} x {:.3f} m'.format(*size))


@rule('URDF: platform', 'a cylindrical link at the top … parallel to the ground in the zero '
      'position, but should be able to rotate',
      'a level cylinder on a horizontal axis, above all other links')
def platform_turns(record: Record) -> Finding:
    robot = model(record)
    joint, platform = robot.joint('platform'), robot.solid('platform', 'cylinder').pose
    leaning = inclination(platform)
    higher = max(solid.pose.position[2] for link in robot.links
                 if joint not in robot.joints_to(link)
                 for solid in robot.solids(link)) - platform.position[2]
    return Finding(abs(robot.axis(joint)[2]) <= SAME_ANGLE and leaning <= SAME_ANGLE
                   and higher <= 1e-6, f'{joint.name}, inclined by {leaning:.3f} rad, '
                   f'{-higher:.3f} m above the other links')


@rule('URDF: room to turn', 'it may rotate fully without colliding with the base link',
      'the platform cannot touch the cube at any angle')
def platform_clears_the_base(record: Record) -> Finding:
    robot = model(record)
    base, platform = robot.solid('base_link', 'box'), robot.solid('platform', 'cylinder')
    hinge = robot.pose(robot.joint('platform').child).position
    (radius, thickness), (x, y, z) = platform.size, numpy.subtract(platform.pose.position, hinge)
    reach = hypot(radius + hypot(x, y), abs(z) + thickness / 2.0)
    top = base.pose.position[2] + base.size[2] / 2.0
    clearance = hinge[2] - top - reach
    return Finding(clearance >= -NEAR, f'a clearance of {clearance:.3f} m')


@rule('URDF: post', 'A fixed cylindrical link should connect the base_link to the platform',
      'a cylinder that is between the cube and the platform and is fixed to base_link')
def post_is_fixed(record: Record) -> Finding:
    robot = model(record)
    base = robot.solid('base_link', 'box').pose.position
    platform = robot.solid('platform', 'cylinder').pose.position
    fixed = [link for link in robot.links if link != 'base_link'
             and not any(joint.movable for joint in robot.joints_to(link))]
    posts = []
    for link in fixed:
        for solid in robot.links[link]:
            x, y, z = robot.pose(link).transform(solid.pose.position)
            if (solid.kind == 'cylinder' and dist((x, y), platform[:2]) <= NEAR
                    and base[2] < z < platform[2]):
                posts.append(link)
    return Finding(bool(posts), ', '.join(posts) or 'no cylinder between is fixed to base_link')


@rule('URDF: stem', 'a cylindrical link that turns about the vertical z-axis and is below',
      'a cylinder that is below the cube and turns about z')
def stem_turns(record: Record) -> Finding:
    robot, joint = model(record), model(record).joint('stem')
    stem, base = robot.solid('stem', 'cylinder'), robot.solid('base_link', 'box')
    below = base.pose.position[2] - stem.pose.position[2]
    upright = abs(float(robot.axis(joint)[2]))
    return Finding(below > 0.0 and upright > 0.999,
                   f'{joint.name}, {below:.3f} m below the cube, z component of the axis '
                   f'{upright:.3f}')


@rule('URDF: wheel', 'A wheel is connected to the stem and can roll as the robot moves',
      'a cylinder or sphere on the stem with a continuous joint along its level axis')
def wheel_rolls(record: Record) -> Finding:
    robot, joint = model(record), model(record).joint('wheel')
    wheel = robot.wheel()
    along = abs(float(robot.axis(joint) @ wheel.pose.upright)) if wheel.kind == 'cylinder' else 1.0
    on_stem = robot.joint('stem') in robot.joints_to(joint.parent)
    return Finding(on_stem and along > 0.999 and abs(robot.axis(joint)[2]) < 0.05
                   and joint.kind == 'continuous', f'{joint.kind} {joint.name}')


@rule('URDF: colors', 'Each link should be a different color',
      'base_link, platform, post, stem and wheel have different colors')
def links_differ_in_color(record: Record) -> Finding:
    robot = model(record)
    links = {'base_link', 'platform', 'stem', 'wheel',
             *(joint.child for joint in robot.joints_to('platform') if not joint.movable)}
    shown = {next(filter(robot.links.get, robot.body(link)), link) for link in links}
    colors = [robot.color(robot.links[link][0]) for link in shown if robot.links.get(link)]
    return Finding(len(set(colors)) == len(colors) >= 4,
                   f'{len(set(colors))} colors for {len(colors)} links')


@rule('config: numbers', 'A configuration file called config/turtle.yaml should include',
      'a node or the installed config/turtle.yaml has ' + ', '.join(CONFIGURED))
def numbers_are_configured(record: Record) -> Finding:
    missing = [name for name in CONFIGURED if name not in record.profile.numbers]
    require(not missing, f'no node or file has {", ".join(missing)}')
    return Finding(True, ', '.join(
        f'{name} {record.profile.numbers[name]:g}' for name in CONFIGURED))


@rule('URDF: numbers', 'changing config/turtle.yaml should be the only change required',
      'platform_height, wheel_radius and platform_radius as configured', ['URDF: wheel'])
def model_has_the_numbers(record: Record) -> Finding:
    robot, height = model(record), number(record, 'platform_height')
    wheel, platform = robot.wheel(), robot.solid('platform', 'cylinder')
    low, high = robot.platform_heights()
    met = low - EXACT <= height <= high + EXACT
    text = f'platform from {low:.3f} to {high:.3f} m (configured {height:.3f})'
    for name, solid in (('wheel_radius', wheel), ('platform_radius', platform)):
        configured, radius = number(record, name), solid.size[0]
        met = met and abs(radius - configured) <= EXACT
        text += f', {name} {radius:.3f} m'
        text += '' if radius == configured else f' (configured {configured:.3f})'
    return Finding(met, text)


@rule('drive: goal', 'driving the robot toward the goal pose using cmd_vel messages',
      f'the robot stops within {PRECISION} m of its goal, in 8 directions',
      ['frames: odom'], needs_calm=True)
def goals_are_reached(record: Record) -> Finding:
    off = []
    for drive in drives(record):
        track = require(turtle_track(record, drive.begin, drive.end), 'the robot was not observed')
        off.append(dist(track[-1], drive.goal))
    return within(PRECISION, off, '', 'at most {:.3f} m off in {} drives', IMPRECISION)


def deviations(record: Record) -> Iterator[tuple[float, float]]:
    """Yield the distance (m) past the goal and the lateral deviation (m) for each pose."""
    for drive in drives(record):
        (x0, y0), (x1, y1) = drive.start, drive.goal
        ux, uy = (x1 - x0) / drive.length, (y1 - y0) / drive.length
        offsets = [(x - x1, y - y1) for x, y in turtle_track(record, drive.begin, drive.end)]
        # A robot that ends far from the goal has not driven to it.
        if offsets and hypot(*offsets[-1]) < drive.length / 2.0:
            for dx, dy in offsets:
                yield dx * ux + dy * uy, dy * ux - dx * uy


@rule('drive: straight', 'the stem points in that direction and then the robot translates',
      f'at most {PRECISION} m beside the line from start to goal', ['frames: odom'],
      needs_calm=True)
def drives_are_straight(record: Record) -> Finding:
    return within(PRECISION, [abs(side) for _, side in deviations(record)],
                  'the robot did not drive to its goal',
                  'at most {:.3f} m beside the line in {} poses', IMPRECISION)


@rule('drive: overshoot', 'driving the robot toward the goal pose',
      f'at most {PRECISION} m beyond the goal', ['frames: odom'], needs_calm=True)
def drives_do_not_overshoot(record: Record) -> Finding:
    return within(PRECISION, [along for along, _ in deviations(record)],
                  'the robot did not drive to its goal',
                  'at most {:.3f} m beyond the goal in {} poses', IMPRECISION)


@rule('drive: speed', 'The max_velocity, maximum translational velocity of the robot',
      'no command is above max_velocity')
def speed_is_limited(record: Record) -> Finding:
    limit = number(record, 'max_velocity')
    messages(record, 'cmd_vel')
    speed = top_speed(record)
    if speed == 0.0:
        raise Open('every command was 0')
    return Finding(speed <= limit * (1.0 + 1e-6), f'at most {speed:.3f} m/s (limit {limit:g})')


def nearest(values: list[tuple[int, float]], stamp: int) -> float:
    """Return the value whose timestamp (ns) is closest to a given time (ns)."""
    index = bisect_left(values, stamp, key=itemgetter(0))
    return min(values[max(index - 1, 0):index + 1], key=lambda value: abs(value[0] - stamp))[1]


def angles_in(record: Record, joint: str, drive: Drive) -> list[tuple[int, float]]:
    """Return the times (ns) and angles (rad) of a joint during a drive, or raise Failed."""
    angles = record.joint(joint, drive.begin, drive.end)
    if not all(isfinite(angle) for _, angle in angles):
        raise Failed(f'joint_states contains an angle of {joint} that is not finite')
    return angles


def motion_between(start: Pose, end: Pose) -> Array:
    """Return the horizontal motion (m) from one pose to another."""
    return numpy.subtract(end.position[:2], start.position[:2])


def driven_and_rolled(record: Record, drive: Drive) -> tuple[float, float]:
    """Return the distance (m) driven by the robot and the signed distance rolled by the wheel."""
    robot, radius = model(record), wheel_radius(record)
    joint, stem = robot.joint('wheel'), robot.joint('stem').name
    # TF contains the stem angle too, but robot_state_publisher may publish it at a low rate.
    stem_angles = angles_in(record, stem, drive)
    track = []
    for stamp, angle in thin(angles_in(record, joint.name, drive)):
        base = record.pose('base_link', stamp)
        if base is not None and stem_angles:
            track.append((angle, base, nearest(stem_angles, stamp)))
    driven = rolled = direction = 0.0
    for (last_angle, last_base, _), (angle, base, steering) in pairwise(track):
        motion = motion_between(last_base, base)
        axis = base.axes @ robot.axis(joint, {stem: steering})
        turned = remainder(angle - last_angle, 2.0 * pi)  # The angle may be limited to one turn.
        driven += hypot(*motion)
        rolled += radius * abs(turned)
        direction += turned * (axis[1] * motion[0] - axis[0] * motion[1])
    return driven, copysign(rolled, direction)


@rule('drive: rolling', 'the wheel is rolling without slipping',
      f'wheel angle x wheel_radius = driven distance within {MAX_SLIP:.0%}, in the direction of '
      'the motion', ['joint_states: names', 'URDF: stem', 'URDF: wheel', 'URDF: numbers',
                     'frames: robot'], needs_calm=True)
def wheel_does_not_slip(record: Record) -> Finding:
    wheel = model(record).joint('wheel').name
    turned = [abs(b - a) for begin, end in record.idle
              for (_, a), (_, b) in pairwise(record.joint(wheel, begin, end))]
    if largest(turned) > SAME_ANGLE:
        return Finding(False, f'the wheel turns by {largest(turned):.2f} rad in one step while '
                       'the robot is at rest')
    measured = [driven_and_rolled(record, drive) for drive in drives(record)]
    driven, rolled = zip(*require_data([ways for ways in measured if ways[0] > 0.0],
                                       'the robot was not observed while driving'))
    text = (f'rolled {sum(map(abs, rolled)):.3f} m, driven {sum(driven):.3f} m in {len(driven)} '
            'drives')
    backward = sum(distance < 0.0 for distance in rolled)
    if backward:
        text += f', and backward in {backward} of them'
    if len(rolled) > 1 and max(rolled) <= 0.0:
        raise Failed(text)
    # Each command begins at a step of turtlesim, so the distances of a drive may differ by a step.
    met = abs(sum(rolled) - sum(driven)) <= MAX_SLIP * sum(driven) + NEAR and all(
        abs(b - a) <= MAX_SLIP * a + NEAR + step_length(record) for a, b in zip(driven, rolled))
    return Finding(met, text, Plot(
        'Rolling without slipping', 'driven distance (m)', 'wheel angle x radius (m)',
        (driven, rolled), ([0.0, max(driven)], [0.0, max(driven)])))


def misalignment(record: Record, sample: Sample, stem: float, motion: Array) -> float:
    """Return the angle (degrees) between a motion and the direction in which the wheel rolls."""
    robot = model(record)
    axis = sample.pose.axes @ robot.axis(robot.joint('wheel'), {robot.joint('stem').name: stem})
    return degrees(asin(min(abs(float(axis[:2] @ motion)) / hypot(*motion), 1.0)))


def stem_lead_time(record: Record, drive: Drive, stem: str) -> float | None:
    """Return the time (s) from the turn of the joint `stem` to the motion of the robot, if any."""
    samples = frame(record, 'base_link').between(drive.begin, drive.end)
    motions = [motion_between(samples[0].pose, sample.pose) for sample in samples]
    far = [motion for motion in motions if hypot(*motion) > START_DISTANCE]
    angles = angles_in(record, stem, drive)
    if not far or not angles:
        return None
    departure = next(sample for sample, motion in zip(samples, motions) if hypot(*motion) > EXACT)
    turned = departure.stamp + PERIOD_NS
    for stamp, angle in reversed(angles):
        if stamp < departure.stamp + PERIOD_NS / 2:
            if misalignment(record, departure, angle, far[0]) > MAX_MISALIGNMENT:
                break
            turned = stamp
    return (departure.stamp - turned) * SECONDS_PER_NS


@rule('drive: stem first', 'the stem points in that direction and then the robot translates',
      f'the stem has turned to within {MAX_MISALIGNMENT:g} degrees when the robot starts to move',
      ['drive: stem'], needs_calm=True)
def stem_turns_first(record: Record) -> Finding:
    stem = model(record).joint('stem').name
    lead_times = require_data([stem_lead_time(record, drive, stem) for drive in drives(record)],
                              'the robot was not observed while driving')
    # The stem turns at infinite speed, so it may turn in the step in which the robot starts.
    return Finding(min(lead_times) >= -PERIOD_NS / 2 * SECONDS_PER_NS,
                   f'at least {min(lead_times):.3f} s before, in {len(lead_times)} drives')


def are_parallel(a: Array, b: Array) -> bool:
    """Return whether two motions (m) are long enough and have the same direction."""
    turned = abs(atan2(a[0] * b[1] - a[1] * b[0], a @ b))
    return min(hypot(*a), hypot(*b)) > NEAR and degrees(turned) <= MAX_MISALIGNMENT


def steady_motions(record: Record, drive: Drive) -> list[tuple[Sample, Array]]:
    """Return the transforms and motions (m) of a robot that keeps its direction in a drive."""
    samples = frame(record, 'base_link').between(drive.begin, drive.end)
    motions = [motion_between(before.pose, after.pose)
               for before, after in zip(samples, samples[STRIDE:])]
    steady = [(sample, motion) for sample, before, motion, after in zip(
                  samples[2 * STRIDE:], motions, motions[STRIDE:], motions[2 * STRIDE:])
              if are_parallel(before, motion) and are_parallel(motion, after)]
    return thin(steady[len(steady) // 4:3 * len(steady) // 4])


@rule('drive: stem', 'the stem points in that direction … (while the wheel rolls)',
      f'the wheel rolls in the direction of motion, within {MAX_MISALIGNMENT:g} degrees',
      ['joint_states: names', 'URDF: stem', 'URDF: wheel'])
def stem_points_along(record: Record) -> Finding:
    off = []
    for drive in drives(record):
        motions = steady_motions(record, drive)
        angles = thin(angles_in(record, model(record).joint('stem').name, drive))
        for sample, motion in motions if angles else []:
            off.append(misalignment(record, sample, nearest(angles, sample.stamp), motion))
    text = 'at most {:.1f} degrees off in {} poses'
    if off and median(off) > MAX_MISALIGNMENT:
        raise Failed(text.format(largest(off), len(off)))
    return within(MAX_MISALIGNMENT, off, 'the robot was not observed while driving', text)


@rule('tilt', 'The tilt angle … is set to the last message received on this topic',
      'the joint and TF have each requested angle', ['frames: robot', 'URDF: platform'],
      needs_calm=True)
def platform_has_the_tilt(record: Record) -> Finding:
    require_clear(record, 'tilt', 'pose', 'joint_states', f'frame {record.actual("platform")}')
    tilts = require_data(record.tilts, 'the platform was not tilted')
    require(any(request.answered for request in tilts), tilts[0].message)
    for request in tilts:
        require_accepted(record, request)
    robot, joint = model(record), model(record).joint('platform').name
    texts, met = [], True
    for request in tilts:
        stamp = request.end - BEFORE_NS
        positions = record.joint(joint, request.begin, request.end)
        platform, base = record.pose('platform', stamp), record.pose('base_link', stamp)
        if not positions or platform is None or base is None:
            continue
        # Another node may have published an angle after the referee did.
        angles = record.messages('tilt', request.begin, stamp - BEFORE_NS)
        sent = angles[-1].message if angles else request.value
        expected = base.axes @ robot.pose('platform', {joint: sent}).upright
        off = angle_between(platform.upright, expected)
        _, angle = positions[-1]
        met = met and abs(angle - sent) <= SAME_ANGLE and off <= SAME_ANGLE
        text = f'{sent:g} rad: joint {angle:.3f}, TF {off:.3f} off'
        if abs(sent - request.value) > EXACT:
            text += f' ({request.value:g} rad from the referee was replaced by another node)'
        texts.append(text)
    require_data(texts, 'the joint or the frame of the platform was not observed')
    return Finding(met, '; '.join(texts))
