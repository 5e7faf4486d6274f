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

"""The rules for frames, names, the robot's description and the robot's node. No ROS."""

from collections.abc import Iterator
from math import atan2, cos, hypot, isfinite, pi, sin
from typing import Any

from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.geometry import axes, yaw_of
from turtle_brick.core.time_steps import NANO, NANOSECONDS
from turtle_referee.record import Drive, Frame, inclination, rate, Record, stamp_of
from turtle_referee.robot_model import RobotModel
from turtle_referee.rules import Broken, Finding, number, Open, Plot, Rules, Series, worst

RULES = Rules()
rule = RULES.rule

RATE_TOLERANCE = 0.02
"""The part by which a rate may be off."""

BLAME = 5.0
"""How much more of a rate may be missing than of the time that the machine had, for its sake."""

NEAR = 0.01
"""How far (m) apart two statements about one place may be."""

PRECISION = 0.05
"""How far (m) from its goal, beside its line and beyond its goal the robot may come."""

ALIKE = 0.02
"""How far (rad) an angle may be off."""

GLOBAL = ('/tf', '/tf_static', '/rosout', '/parameter_events', '/clock')


def frame(record: Record, name: str) -> Frame:
    """Return what was broadcast of one of the assignment's frames; Broken if nothing was."""
    found = record.frame(name)
    if found is None:
        raise Broken(f'nobody broadcasts {record.profile.frames[name]}')
    return found


def model(record: Record) -> RobotModel:
    """Return the robot's description; Broken if there is none."""
    if not record.topics['robot_description']:
        raise Broken('there is no robot_description')
    found = RobotModel.of(record)
    if found is None:
        raise Broken('the robot_description is no URDF that can be read')
    return found


def parent_is(record: Record, child: str, parent: str) -> None:
    """Raise Broken unless a frame hangs below another, and no other."""
    parents = frame(record, child).parents
    if parents != {record.profile.frames[parent]}:
        raise Broken(f'{record.profile.frames[child]} is below {", ".join(sorted(parents))}')


def drives(record: Record) -> list[Drive]:
    """Return the drives that led somewhere; Open or Broken if there are none."""
    found = [drive for drive in record.drives if hypot(
        drive.goal[0] - drive.start[0], drive.goal[1] - drive.start[1]) > 0.1]
    if not found:
        raise Open('the robot was not driven')
    return found


# -------------------------------------------------------------------------------------- frames

@rule('frames: world', 'All other frames are descendants of world', 'every frame below world')
def all_below_world(record: Record) -> Finding:
    """Check that every frame that is broadcast hangs, however far, below the world."""
    if not record.frames:
        raise Broken('nobody broadcasts any frame')
    world = record.profile.frames['world']
    astray = [name for name in record.frames if record.way_up(name)[-1] != world]
    return Finding(not astray, f'{len(record.frames)} frames' + (
        f', not below {world}: {", ".join(sorted(astray)[:5])}' if astray else ''))


@rule('frames: odom', 'The odom frame is at a fixed offset from world and represents the initial '
      'location of the turtle', 'below world, fixed, at the start')
def odom_is_fixed(record: Record) -> Finding:
    """Check that the odom frame does not move, and is where the turtle began."""
    parent_is(record, 'odom', 'world')
    places = [sample.pose.position for sample in frame(record, 'odom').samples]
    x, y, _ = places[0]
    moved = worst([hypot(place[0] - x, place[1] - y) for place in places])
    base = record.frame('base_link')
    began = hypot(*base.samples[0].pose.position[:2]) if base else float('nan')
    away = min(hypot(x - CENTER[0], y - CENTER[1]), began)
    return Finding(moved <= 1e-3 and away <= NEAR,
                   f'at ({x:.3f}, {y:.3f}), {away:.3f} m from the start, moved by {moved:.3f} m')


@rule('frames: base_link', "The turtle's location relative to odom is its position according to "
      'its wheel odometry', f'below odom, where the turtle is (within {NEAR} m at rest)',
      timely=True)
def base_link_is_the_turtle(record: Record) -> Finding:
    """Check that at rest base_link is where turtlesim says the turtle is."""
    parent_is(record, 'base_link', 'odom')
    ends = [end for _, end in record.idle] + [drive.end for drive in record.drives]
    off = []
    for end in ends:
        poses = record.heard('pose', end - 200_000_000, end)
        base = record.pose(record.profile.frames['base_link'], end - 20_000_000)
        if poses and base:
            pose = poses[-1].message
            off.append(hypot(base.position[0] - pose.x, base.position[1] - pose.y))
    if not off:
        raise Open('the turtle was not seen at rest')
    return Finding(worst(off) <= NEAR, f'at most {worst(off):.4f} m from it, {len(off)} times')


@rule('frames: robot', "The base_link has other child frames, as defined by the robot's urdf file",
      'every link of the URDF in TF, below base_link')
def links_are_frames(record: Record) -> Finding:
    """Check that every link of the description is a frame below base_link."""
    robot, base = model(record).robot, record.profile.frames['base_link']
    if robot.root != base:
        raise Broken(f'the root of the URDF is {robot.root}')
    missing = [link for link in robot.links if link != base
               and (link not in record.frames or base not in record.way_up(link))]
    return Finding(not missing, f'{len(robot.links)} links' + (
        f', not in TF: {", ".join(missing[:5])}' if missing else ''))


@rule('frames: brick', 'brick. This frame is the location of the brick', 'a frame below world')
def brick_is_below_world(record: Record) -> Finding:
    """Check that the brick's frame can be looked up in the world."""
    frame(record, 'brick')
    way = record.way_up(record.profile.frames['brick'])
    return Finding(way[-1] == record.profile.frames['world'], ' -> '.join(reversed(way)))


@rule('frames: broadcasters', 'Broadcasting the location of the base_link frame …, broadcasting '
      'the brick frame …', 'one broadcaster for each frame')
def one_broadcaster(record: Record) -> Finding:
    """Check that no frame is broadcast by two."""
    if not record.frames:
        raise Broken('nobody broadcasts any frame')
    twice = [name for name, one in record.frames.items() if one.restarts > 2 or one.both]
    return Finding(not twice, ', '.join(f'{name} by several' for name in sorted(twice)[:5])
                   or f'{len(record.frames)} frames, each by one')


@rule('names: relative', 'you should refer to ROS entities using relative names from within your '
      'nodes', 'everything below the namespace')
def names_are_relative(record: Record) -> Finding:
    """Check that in a namespace, nothing is outside it but what ROS itself has there."""
    if record.namespace == '/':
        raise Open('start the graph in a namespace, and give it with --namespace')
    own = f'{record.namespace}/'
    outside = sorted(topic for topic, speakers in record.speakers.items()
                     if not topic.startswith(own) and topic not in GLOBAL
                     and any(speaker.startswith(own) for speaker in speakers))
    inside = [topic for topic in record.speakers if topic.startswith(own)]
    if not inside:
        raise Broken(f'nothing is published below {record.namespace}')
    return Finding(not outside, ', '.join(outside[:5]) + ' outside' if outside
                   else f'{len(inside)} topics, all below {record.namespace}')


# --------------------------------------------------------------------------------------- rates

def judge_rate(record: Record, name: str, nominal: float,
               instants: list[list[int]]) -> Finding:
    """Judge the rate of something at rest and on the move; Open if the machine is to blame."""
    broken, busy, words, series = False, '', [], []
    for label, span, found in zip(('at rest', 'driving'), spans(record), instants):
        seconds = [(instant - found[0]) * NANO for instant in found]
        frequency = rate(seconds)
        off = abs(frequency / nominal - 1.0) - RATE_TOLERANCE
        if off > 0.0:
            blamed = record.is_busy([span], off / BLAME)
            broken, busy = broken or not blamed, busy or blamed
        words.append(f'{frequency:.2f} Hz {label}')
        series.append(Series(label, seconds, range(len(seconds))))
    if busy and not broken:
        raise Open(f'{", ".join(words)}; {busy}')
    longest = max((one.x[-1] for one in series if one.x), default=1.0)
    line = Series(f'{nominal:g} per second', [0.0, longest], [0.0, nominal * longest])
    return Finding(not broken, ', '.join(words), Plot(
        f'Rate of {name}', 'time (s)', 'messages', series, line))


def spans(record: Record) -> list[tuple[int, int]]:
    """Return when the robot rested, and if it drove, from the first leg to the last (ns)."""
    if not record.idle:
        raise Open('the graph was not watched')
    legs = record.drives[:1]
    for drive in record.drives[1:]:
        # Something else was done in between, and this is no single span.
        if drive.begin - legs[-1].end > NANOSECONDS // 2:
            break
        legs.append(drive)
    return [record.idle[0], *([(legs[0].begin, legs[-1].end)] if legs else [])]


def stamps_of_topic(record: Record, name: str) -> list[list[int]]:
    """Return the instants (ns) that the messages of a topic belong to, at rest and driving."""
    if not record.topics[name]:
        raise Broken(f'nothing was heard on {record.profile.topics[name]}')
    found = []
    for begin, end in spans(record):
        heard = record.heard(name, begin, end)
        stamped = bool(heard) and hasattr(heard[0].message, 'header')
        found.append([stamp_of(one) if stamped else one.published for one in heard])
    return found


@rule('rate: cmd_vel', 'All publishing and broadcasting shall be done at 100 Hz', '100 Hz ± 2 %')
def rate_of_cmd_vel(record: Record) -> Finding:
    """Check that commands come 100 times per second, whether the robot moves or not."""
    return judge_rate(record, 'cmd_vel', 100.0, stamps_of_topic(record, 'cmd_vel'))


@rule('rate: odom', 'All publishing and broadcasting shall be done at 100 Hz', '100 Hz ± 2 %')
def rate_of_odom(record: Record) -> Finding:
    """Check that odometry comes 100 times per second."""
    return judge_rate(record, 'odom', 100.0, stamps_of_topic(record, 'odom'))


@rule('rate: joint_states', 'All publishing and broadcasting shall be done at 100 Hz',
      '100 Hz ± 2 %')
def rate_of_joint_states(record: Record) -> Finding:
    """Check that joint states come 100 times per second."""
    return judge_rate(record, 'joint_states', 100.0, stamps_of_topic(record, 'joint_states'))


def judge_frame_rate(record: Record, name: str, nominal: float) -> Finding:
    """Judge how often a frame is broadcast."""
    found = frame(record, name)
    return judge_rate(record, record.profile.frames[name], nominal, [
        [sample.stamp for sample in found.between(begin, end)] for begin, end in spans(record)])


@rule('rate: base_link', 'All publishing and broadcasting shall be done at 100 Hz',
      '100 Hz ± 2 %')
def rate_of_base_link(record: Record) -> Finding:
    """Check that the robot's place is broadcast 100 times per second."""
    return judge_frame_rate(record, 'base_link', 100.0)


@rule('rate: brick', 'The node should simulate the physics at 250 Hz', '250 Hz ± 2 %')
def rate_of_brick(record: Record) -> Finding:
    """Check that the brick is broadcast with each step of the physics."""
    return judge_frame_rate(record, 'brick', 250.0)


# --------------------------------------------------------------------------- the robot's topics

@rule('cmd_vel: at rest', 'If the turtle is not moving, this node should publish a cmd_vel of 0',
      '0 at rest')
def commands_at_rest(record: Record) -> Finding:
    """Check that a robot at rest is commanded to stand."""
    spans(record)
    commands = [one for begin, end in record.idle for one in record.heard('cmd_vel', begin, end)]
    if not commands:
        raise Broken('no commands at rest')
    speeds = [hypot(*velocity(one.message)) for one in commands]
    return Finding(worst(speeds) <= 1e-9, f'{len(speeds)} commands, at most {worst(speeds):.3f}')


def velocity(message: Any) -> tuple[float, float, float]:
    """Return x and y (m/s) and yaw (rad/s) of a Twist, or of a message that has one."""
    twist = getattr(message, 'twist', message)
    return twist.linear.x, twist.linear.y, twist.angular.z


@rule('odom: pose', 'Publishing nav_msgs/Odometry message on the odom topic',
      'pose of base_link in odom, equal to TF')
def odometry_equals_tf(record: Record) -> Finding:
    """Check that the odometry says what the transform of the same instant says."""
    if not record.topics['odom']:
        raise Broken('nothing was heard on odom')
    names = record.profile.frames
    base, off, at_once = frame(record, 'base_link'), [], 0
    for one in record.topics['odom']:
        message = one.message
        if (message.header.frame_id, message.child_frame_id) != (
                names['odom'], names['base_link']):
            raise Broken(f'odometry of {message.child_frame_id!r} in {message.header.frame_id!r}')
        sample = base.at(stamp_of(one))
        if sample is not None and stamp_of(one) <= base.samples[-1].stamp:
            place = message.pose.pose.position
            at_once += sample.stamp == stamp_of(one) and sample in base.between(
                sample.stamp, sample.stamp + 1)
            off.append(hypot(place.x - sample.pose.position[0],
                             place.y - sample.pose.position[1]))
    if not off:
        raise Broken('no transform at the time of any odometry')
    # Between two transforms it is not known where in a tick of turtlesim the robot was.
    allowed = 1e-3 if at_once > 0.9 * len(off) else number(record, 'max_velocity') * 0.02 + 1e-3
    return Finding(worst(off) <= allowed, f'{len(off)} compared, at most {worst(off):.4f} m apart')


@rule('odom: twist', 'twist can be a direct copy of the latest cmd_vel', 'a recent cmd_vel',
      timely=True)
def twist_is_command(record: Record) -> Finding:
    """Check that each odometry's twist is one of the commands of that time."""
    odometry = [one for drive in drives(record)
                for one in record.heard('odom', drive.begin, drive.end)]
    if not odometry:
        raise Broken('nothing was heard on odom')
    other = 0
    for one in odometry:
        recent = record.heard('cmd_vel', one.published - 50_000_000, one.published + 50_000_000)
        twist = velocity(one.message.twist)
        other += bool(recent) and not any(
            hypot(*(a - b for a, b in zip(twist, velocity(command.message)))) < 1e-6
            for command in recent)
    return Finding(other <= 0.01 * len(odometry),
                   f'{len(odometry) - other} of {len(odometry)} are')


@rule('joint_states: names', 'Publishing the joint_states of the turtle robot',
      'every movable joint of the URDF')
def joints_are_published(record: Record) -> Finding:
    """Check that every movable joint has a finite position, and no joint is made up."""
    if not record.topics['joint_states']:
        raise Broken('nothing was heard on joint_states')
    known = {joint.name for joint in model(record).joints if joint.movable}
    published = {name for one in record.topics['joint_states'] for name in one.message.name}
    odd = [name for one in record.topics['joint_states']
           for name, position in zip(one.message.name, one.message.position)
           if not isfinite(position)]
    words = ', '.join(sorted(published))
    if published != known:
        words += f'; in the URDF: {", ".join(sorted(known))}'
    if odd:
        words += f'; not finite: {odd[0]}'
    return Finding(published == known and not odd, words)


# ---------------------------------------------------------------------------------- the model

@rule('URDF: base_link', 'A base_link that is the main location of the robot and is represented '
      'by a cube', 'a cube')
def base_is_a_cube(record: Record) -> Finding:
    """Check that the robot's base is a box with equal sides."""
    box = model(record).solid(record.profile.frames['base_link'], 'box')
    if box is None:
        raise Broken('base_link has no box')
    return Finding(max(box.size) <= 1.02 * min(box.size), '{:.3f} x {:.3f} x {:.3f} m'.format(
        *box.size))


@rule('URDF: platform', 'A platform which is a cylindrical link at the top of the robot … '
      'parallel to the ground in the zero position, but should be able to rotate',
      'a cylinder that turns about a horizontal axis, the highest link')
def platform_turns(record: Record) -> Finding:
    """Check that the platform is a level cylinder on top that can be tilted."""
    robot, name = model(record), record.profile.frames['platform']
    shape, joint = robot.solid(name, 'cylinder'), robot.platform_joint(name)
    if shape is None:
        raise Broken('platform has no cylinder')
    if joint is None or joint.kind not in ('revolute', 'continuous'):
        raise Broken('no joint turns the platform')
    tilt = abs(robot.axis(joint)[2])
    level = inclination(robot.pose(name)) + inclination(shape.pose)
    top = robot.pose(name).position[2]
    higher = [link for link in robot.robot.links
              if link != name and robot.pose(link).position[2] > top + 1e-6
              and joint not in robot.way(link)]
    return Finding(tilt <= ALIKE and level <= ALIKE and not higher,
                   f'{joint.kind} {joint.name}, inclined by {level:.3f} rad' + (
                       f', below {higher[0]}' if higher else ''))


@rule('URDF: room to turn', 'a fixed vertical distance above the base_link, so that it may rotate '
      'fully without colliding with the base link', 'the cube out of reach of the platform')
def platform_clears_the_base(record: Record) -> Finding:
    """Check that the platform can turn over without touching the cube."""
    robot, name = model(record), record.profile.frames['platform']
    base = record.profile.frames['base_link']
    box, shape = robot.solid(base, 'box'), robot.solid(name, 'cylinder')
    joint = robot.platform_joint(name)
    if box is None or shape is None or joint is None:
        raise Broken('there is no cube, no cylinder or no joint')
    hinge = robot.pose(joint.child).position
    reach = hypot(shape.size[0] / 2.0 + hypot(*shape.pose.position[:2]),
                  abs(shape.pose.position[2]) + shape.size[2] / 2.0)
    room = hinge[2] - (box.pose.position[2] + box.size[2] / 2.0) - reach
    return Finding(room >= -1e-6, f'{room:.3f} m to spare')


@rule('URDF: post', 'A fixed cylindrical link should connect the base_link to the platform',
      'a cylinder, fixed to base_link')
def post_is_fixed(record: Record) -> Finding:
    """Check that between base and platform there is a cylinder that does not move."""
    robot, name = model(record), record.profile.frames['platform']
    hinge, found = robot.pose(name).position, []
    for link in robot.robot.links:
        shape = robot.solid(link, 'cylinder')
        if shape is None or link in (name, record.profile.frames['base_link']):
            continue
        x, y, z = robot.pose(link).transform(shape.pose.position)
        if (not any(joint.movable for joint in robot.way(link))
                and hypot(x - hinge[0], y - hinge[1]) <= NEAR and z < hinge[2]):
            found.append(link)
    return Finding(bool(found), ', '.join(found) or 'no such link')


@rule('URDF: stem', 'A stem is a cylindrical link that turns about the vertical z-axis and is '
      'below the base_link', 'a cylinder below the cube that turns about z')
def stem_turns(record: Record) -> Finding:
    """Check that below the base a cylinder turns about the vertical."""
    robot = model(record)
    joint = robot.stem_joint(record.profile.frames['platform'])
    if joint is None:
        raise Broken('no link that turns about the vertical carries a wheel')
    shape = robot.solid(joint.child, 'cylinder')
    box = robot.solid(record.profile.frames['base_link'], 'box')
    if shape is None or box is None:
        raise Broken(f'{joint.child} is no cylinder, or there is no cube')
    height = robot.pose(joint.child).transform(shape.pose.position)[2]
    return Finding(height < box.pose.position[2] and joint.kind in ('revolute', 'continuous'),
                   f'{joint.kind} {joint.name}, {box.pose.position[2] - height:.3f} m below')


@rule('URDF: wheel', 'A wheel is connected to the stem and can roll as the robot moves',
      'a cylinder that turns without end about its own axis')
def wheel_rolls(record: Record) -> Finding:
    """Check that the wheel is a cylinder on the stem, and its joint is continuous."""
    robot = model(record)
    joint = robot.wheel_joint(record.profile.frames['platform'])
    shape = robot.solid(joint.child, 'cylinder') if joint else None
    if joint is None or shape is None:
        raise Broken('no cylinder on the stem turns about a horizontal axis')
    axis, (x, y, z) = joint.axis, axis_of(shape.pose.orientation)
    along = abs(axis[0] * x + axis[1] * y + axis[2] * z)
    return Finding(along > 0.999 and joint.kind == 'continuous', f'{joint.kind} {joint.name}')


def axis_of(orientation: tuple[float, float, float, float]) -> tuple[float, float, float]:
    """Return the z axis of a frame in its parent."""
    return axes(orientation)[2]


@rule('URDF: colors', 'Each link should be a different color',
      'base_link, platform, post, stem and wheel differ')
def links_differ_in_color(record: Record) -> Finding:
    """Check that no two of the robot's parts have the same color."""
    robot, name = model(record), record.profile.frames['platform']
    parts = {record.profile.frames['base_link'], name}
    parts |= {joint.child for joint in (robot.stem_joint(name), robot.wheel_joint(name)) if joint}
    parts |= {joint.child for joint in robot.way(name) if not joint.movable}
    colors = [robot.robot.links[part][0].color for part in sorted(parts)
              if robot.robot.links.get(part)]
    return Finding(len(set(colors)) == len(colors) >= 4,
                   f'{len(set(colors))} colors of {len(colors)} links')


@rule('URDF: numbers', 'changing config/turtle.yaml should be the only change required to work '
      'with a different platform_height or wheel_radius and have the robot appear correctly',
      'platform_height and wheel_radius as configured')
def model_has_the_numbers(record: Record) -> Finding:
    """Check that the description was built from the configured numbers."""
    robot, name = model(record), record.profile.frames['platform']
    for wanted in ('platform_height', 'wheel_radius'):
        if wanted in record.profile.guessed:
            raise Open(f'{wanted} is known from the URDF alone')
    height, wheel = number(record, 'platform_height'), number(record, 'wheel_radius')
    span = robot.platform_top(name)
    if span is None:
        raise Broken('no wheel on the ground, or no platform')
    radius = robot.numbers(name)['wheel_radius']
    return Finding(span[0] - 1e-3 <= height <= span[1] + 1e-3 and abs(radius - wheel) <= 1e-3,
                   f'platform from {span[0]:.3f} to {span[1]:.3f} m (configured {height:.3f}), '
                   f'wheel {radius:.3f} m (configured {wheel:.3f})')


# -------------------------------------------------------------------------------- the driving

@rule('drive: goal', 'When the node receives this message it starts driving the robot toward the '
      'goal pose using cmd_vel messages', f'there within {PRECISION} m, in 8 directions',
      timely=True)
def goals_are_reached(record: Record) -> Finding:
    """Check that each goal is where the robot ends."""
    off = []
    for drive in drives(record):
        poses = record.heard('pose', drive.begin, drive.end)
        if not poses:
            raise Broken('the robot is not seen')
        pose = poses[-1].message
        off.append(hypot(pose.x - drive.goal[0], pose.y - drive.goal[1]))
    return Finding(worst(off) <= PRECISION, f'{len(off)} goals, at most {worst(off):.3f} m off')


def on_the_way(record: Record) -> Iterator[tuple[float, float, float]]:
    """Yield the robot's poses on its drives: part of the way (m), beside it (m), its length."""
    for drive in drives(record):
        (x0, y0), (x1, y1) = drive.start, drive.goal
        length = hypot(x1 - x0, y1 - y0)
        ux, uy = (x1 - x0) / length, (y1 - y0) / length
        for one in record.heard('pose', drive.begin, drive.end):
            dx, dy = one.message.x - x0, one.message.y - y0
            yield dx * ux + dy * uy, dy * ux - dx * uy, length


@rule('drive: straight', 'To move in a given direction, the stem points in that direction and '
      'then the robot translates', f'at most {PRECISION} m beside the line', timely=True)
def drives_are_straight(record: Record) -> Finding:
    """Check that the robot keeps to the line from where it was to its goal."""
    beside = worst([abs(side) for _, side, _ in on_the_way(record)])
    return Finding(beside <= PRECISION, f'at most {beside:.3f} m')


@rule('drive: overshoot', 'driving the robot toward the goal pose',
      f'at most {PRECISION} m beyond the goal', timely=True)
def drives_do_not_overshoot(record: Record) -> Finding:
    """Check that the robot does not go beyond its goal."""
    beyond = worst([along - length for along, _, length in on_the_way(record)])
    return Finding(beyond <= PRECISION, f'{max(beyond, 0.0):.3f} m')


@rule('drive: speed', 'The max_velocity, maximum translational velocity of the robot',
      'no command above max_velocity')
def speed_is_limited(record: Record) -> Finding:
    """Check that no command is faster than the robot may be, and some are not zero."""
    limit = number(record, 'max_velocity')
    speeds = [hypot(*velocity(one.message)[:2]) for one in record.topics['cmd_vel']]
    if not speeds:
        raise Broken('nothing was heard on cmd_vel')
    if not any(speeds):
        drives(record)  # Who was not sent anywhere may stand.
    return Finding(0.0 < worst(speeds) <= limit * (1.0 + 1e-6),
                   f'at most {worst(speeds):.3f} m/s of {limit:g}')


@rule('drive: rolling', 'The wheel joint state should be published so that the wheel is rolling '
      'without slipping', 'angle x wheel_radius = way, within 2 %', timely=True)
def wheel_does_not_slip(record: Record) -> Finding:
    """Check that what rolls off the wheel is the way of the robot, in eight directions."""
    joint = model(record).wheel_joint(record.profile.frames['platform'])
    if joint is None:
        raise Broken('there is no wheel')
    radius, base = number(record, 'wheel_radius'), frame(record, 'base_link')
    points, off, directions = [], [], set()
    for drive in drives(record):
        # Way and angle at the same instants: at the ends of the span the robot may still move.
        pairs = [(angle, sample.pose.position) for stamp, angle in record.joint(
            joint.name, drive.begin, drive.end) if (sample := base.at(stamp)) is not None]
        places = [place for _, place in pairs]
        way = sum(hypot(b[0] - a[0], b[1] - a[1]) for a, b in zip(places, places[1:]))
        rolled = radius * sum(abs(b - a) for (a, _), (b, _) in zip(pairs, pairs[1:]))
        off.append(abs(rolled - way) - 0.02 * way - 0.005)
        points.append((way, rolled))
        heading = atan2(drive.goal[1] - drive.start[1], drive.goal[0] - drive.start[0])
        directions.add(round(heading / (pi / 4.0)) % 8)
    longest = max(way for way, _ in points)
    return Finding(worst(off) <= 0.0, f'{sum(rolled for _, rolled in points):.3f} m rolled on '
                   f'{sum(way for way, _ in points):.3f} m, {len(directions)} directions',
                   Plot('Rolling without slipping', 'way of the robot (m)',
                        'angle of the wheel x radius (m)',
                        [Series('a drive', *zip(*points))],
                        Series('without slipping', [0.0, longest], [0.0, longest])))


@rule('drive: stem', 'the stem points in that direction and then the robot translates (while the '
      'wheel rolls)', 'the wheel rolls along the motion, within 5 degrees', timely=True)
def stem_points_along(record: Record) -> Finding:
    """Check that in the middle of each drive the wheel's axis is across the motion."""
    robot, name = model(record), record.profile.frames['platform']
    wheel, stem = robot.wheel_joint(name), robot.stem_joint(name)
    if wheel is None or stem is None:
        raise Broken('there is no stem or no wheel')
    base, off = frame(record, 'base_link'), []
    for drive in drives(record):
        samples = base.between(drive.begin, drive.end)
        moving = [(a, b) for a, b in zip(samples, samples[5:]) if hypot(
            b.pose.position[0] - a.pose.position[0],
            b.pose.position[1] - a.pose.position[1]) > 0.01]
        angles = record.joint(stem.name, drive.begin, drive.end)
        for a, b in moving[len(moving) // 4:-len(moving) // 4 or None]:
            angle = min(angles, key=lambda one: abs(one[0] - b.stamp))[1]
            x, y, _ = robot.axis(wheel, {stem.name: angle})
            yaw = yaw_of(b.pose.orientation)
            dx, dy = (q - p for p, q in zip(a.pose.position[:2], b.pose.position[:2]))
            across = x * cos(yaw) - y * sin(yaw), x * sin(yaw) + y * cos(yaw)
            off.append(abs((across[0] * dx + across[1] * dy) / hypot(dx, dy)))
    if not off:
        raise Open('the robot was not seen to drive')
    return Finding(worst(off) <= sin(5.0 * pi / 180.0),
                   f'at most {worst(off) * 180.0 / pi:.1f} degrees off, {len(off)} times')


@rule('tilt', 'The tilt angle of the platform is set to the last message received on this topic',
      'joint and TF at each angle that was asked for', timely=True)
def tilt_is_obeyed(record: Record) -> Finding:
    """Check that the platform takes each angle that is asked for, in its joint and in TF."""
    if not record.tilts:
        raise Open('the platform was not tilted')
    if not record.tilts[0].answered:
        raise Broken(record.tilts[0].words)
    joint = model(record).platform_joint(record.profile.frames['platform'])
    if joint is None:
        raise Broken('no joint turns the platform')
    words, kept = [], True
    for ask in record.tilts:
        positions = record.joint(joint.name, ask.begin, ask.end)
        platform = record.platform(ask.end - 50_000_000)
        if not positions or platform is None:
            raise Broken('joint or frame of the platform are not heard')
        angle, leaning = positions[-1][1], inclination(platform)
        kept = kept and abs(angle - ask.what) <= ALIKE and abs(leaning - abs(angle)) <= ALIKE
        words.append(f'{ask.what:g}: {angle:.3f}, in TF |{leaning:.3f}|')
    return Finding(kept, '; '.join(words))
