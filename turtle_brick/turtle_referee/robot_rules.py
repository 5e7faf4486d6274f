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
from functools import partial
from math import asin, atan2, degrees, dist, hypot, isfinite, pi, radians
from typing import Any

from turtle_referee.constants import (ALIKE, CENTER, CROOKED, EXACT, NANO, NANOSECONDS, NEAR,
                                      PHYSICS_RATE, PRECISION, RATE, RATE_TOLERANCE, ROUGHLY, SLIP)
from turtle_referee.geometry import Array, inclination
from turtle_referee.record import Drive, Frame, Heard, rate, Record, Sample, stamp_of
from turtle_referee.robot_model import Joint, model, Solid
from turtle_referee.rules import (Broken, Finding, needed, number, Open, Plot, Rules, Series, some,
                                  worst)

RULES = Rules()
rule = RULES.rule

AWAY = 0.02
"""How far (m) the robot is from where it set off when its direction is taken."""

STRIDE = 5
"""Over how many transforms the direction of the motion is taken."""

LATELY = 50_000_000
"""How long (ns) before and after an odometry message a command is one of its time."""

GLOBAL = ('/tf', '/tf_static', '/rosout', '/parameter_events', '/clock')


def frame(record: Record, name: str) -> Frame:
    """Return what was broadcast of one of the assignment's frames; Broken if nothing was."""
    return needed(record.frame(name), f'nobody broadcasts {record.profile.frames[name]}')


def messages(record: Record, name: str) -> list[Heard]:
    """Return what was heard on a topic; Broken if nothing was."""
    return needed(record.topics[name] or None,
                  f'nothing was heard on {record.profile.topics[name]}')


def parent_is(record: Record, child: str, parent: str) -> None:
    """Raise Broken unless a frame hangs below another, and no other."""
    parents = frame(record, child).parents
    if parents != {record.profile.frames[parent]}:
        raise Broken(f'{record.profile.frames[child]} is below {", ".join(sorted(parents))}')


def drives(record: Record) -> list[Drive]:
    """Return the drives that led somewhere; Open if there are none."""
    found = [drive for drive in record.drives if drive.length > 0.1]
    return some(found, 'the robot was not driven')


def listing(names: list[str]) -> str:
    """Return the first of some names, in order."""
    return ', '.join(sorted(names)[:5])


# ------------------------------------------------------------------------------ frames and names

@rule('frames: world', 'All other frames are descendants of world', 'every frame below world')
def all_below_world(record: Record) -> Finding:
    """Check that every frame that is broadcast hangs, however far, below the world."""
    needed(record.frames or None, 'nobody broadcasts any frame')
    world = record.profile.frames['world']
    astray = [name for name in record.frames if record.way_up(name)[-1] != world]
    return Finding(not astray, f'{len(record.frames)} frames' + (
        f', not below {world}: {listing(astray)}' if astray else ''))


@rule('frames: odom', 'The odom frame is at a fixed offset from world and represents the initial '
      'location of the turtle', 'below world, fixed, at the start')
def odom_is_fixed(record: Record) -> Finding:
    """Check that the odom frame does not move, and is where the turtle began."""
    parent_is(record, 'odom', 'world')
    places = [sample.pose.position[:2] for sample in frame(record, 'odom').samples]
    moved = worst(dist(place, places[0]) for place in places)
    base = record.frame('base_link')
    began = hypot(*base.samples[0].pose.position[:2]) if base else float('nan')
    away = min(dist(places[0], CENTER), began)
    return Finding(moved <= EXACT and away <= NEAR, 'at ({:.3f}, {:.3f})'.format(*places[0])
                   + f', {away:.3f} m from the start, moved by {moved:.3f} m')


@rule('frames: base_link', "The turtle's location relative to odom is its position according to "
      'its wheel odometry', f'below odom, where the turtle is (within {NEAR} m at rest)',
      rests_on=['frames: odom'])
def base_link_is_the_turtle(record: Record) -> Finding:
    """Check that at rest base_link is where turtlesim says the turtle is."""
    parent_is(record, 'base_link', 'odom')
    off = []
    for end in (*(end for _, end in record.idle), *(drive.end for drive in record.drives)):
        poses = record.heard('pose', end - 200_000_000, end)
        base = record.pose(record.profile.frames['base_link'], end - 20_000_000)
        if poses and base:
            pose = poses[-1].message
            off.append(dist(base.position[:2], (pose.x, pose.y)))
    some(off, 'the turtle was not seen at rest')
    return Finding(worst(off) <= NEAR, f'at most {worst(off):.4f} m from it, {len(off)} times')


@rule('frames: robot', "The base_link has other child frames, as defined by the robot's urdf file",
      'every link of the URDF in TF, below base_link', rests_on=['rate: joint_states'])
def links_are_frames(record: Record) -> Finding:
    """Check that every link of the description is a frame below base_link."""
    robot, base = model(record), record.profile.frames['base_link']
    if robot.roots != [base]:
        raise Broken(f'the root of the URDF is {listing(robot.roots)}')
    missing = [link for link in robot.links if link != base
               and (link not in record.frames or base not in record.way_up(link))]
    return Finding(not missing, f'{len(robot.links)} links' + (
        f', not in TF: {listing(missing)}' if missing else ''))


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
    needed(record.frames or None, 'nobody broadcasts any frame')
    twice = [name for name, one in record.frames.items() if one.restarts > 2 or one.both]
    return Finding(not twice, f'{listing(twice)} by several' if twice
                   else f'{len(record.frames)} frames, each by one')


@rule('names: relative', 'you should refer to ROS entities using relative names from within your '
      'nodes', 'everything below the namespace')
def names_are_relative(record: Record) -> Finding:
    """Check that in a namespace, nothing is outside it but what ROS itself has there."""
    if record.namespace == '/':
        raise Open('start the graph in a namespace, and give it with --namespace')
    own = f'{record.namespace}/'
    inside = [topic for topic in record.speakers if topic.startswith(own)]
    needed(inside or None, f'nothing is published below {record.namespace}')
    outside = [topic for topic, speakers in record.speakers.items()
               if topic not in (*inside, *GLOBAL)
               and any(speaker.startswith(own) for speaker in speakers)]
    return Finding(not outside, f'{listing(outside)} outside' if outside
                   else f'{len(inside)} topics, all below {record.namespace}')


# --------------------------------------------------------------------------------------- rates

def spans(record: Record) -> list[tuple[int, int]]:
    """Return when the robot rested, and if it drove, from the first leg to the last (ns)."""
    some(record.idle, 'the graph was not watched')
    legs = record.drives[:1]
    for drive in record.drives[1:]:
        # Something else was done in between, and this is no single span.
        if drive.begin - legs[-1].end > NANOSECONDS // 2:
            break
        legs.append(drive)
    return [record.idle[0], *([(legs[0].begin, legs[-1].end)] if legs else [])]


def instants_of(record: Record, name: str, begin: int, end: int) -> list[int]:
    """Return the instants (ns) that the messages of a topic, or the transforms, belong to."""
    if name not in record.topics:
        return [sample.stamp for sample in frame(record, name).between(begin, end)]
    messages(record, name)
    return [stamp_of(heard) for heard in record.heard(name, begin, end)]


def judge_rate(name: str, nominal: float, record: Record) -> Finding:
    """Judge the rate of something at rest and on the move."""
    kept, words = True, []
    for label, (begin, end) in zip(('at rest', 'driving'), spans(record)):
        frequency = rate([instant * NANO for instant in instants_of(record, name, begin, end)])
        kept = kept and abs(frequency / nominal - 1.0) <= RATE_TOLERANCE
        words.append(f'{frequency:.2f} Hz {label}')
    return Finding(kept, ', '.join(words))


for sentence, hertz, *named in (
        ('All publishing and broadcasting shall be done at 100 Hz', RATE,
         'cmd_vel', 'odom', 'joint_states', 'base_link'),
        ('The node should simulate the physics at 250 Hz', PHYSICS_RATE, 'brick')):
    for one in named:
        rule(f'rate: {one}', sentence, f'{hertz:g} Hz ± 2 %')(partial(judge_rate, one, hertz))


# --------------------------------------------------------------------- what the robot publishes

def velocity(message: Any) -> tuple[float, float, float]:
    """Return x and y (m/s) and yaw (rad/s) of a Twist, or of a message that has one."""
    twist = getattr(message, 'twist', message)
    return twist.linear.x, twist.linear.y, twist.angular.z


@rule('cmd_vel: at rest', 'If the turtle is not moving, this node should publish a cmd_vel of 0',
      '0 at rest')
def commands_at_rest(record: Record) -> Finding:
    """Check that a robot at rest is commanded to stand."""
    spans(record)
    speeds = [hypot(*velocity(one.message)) for begin, end in record.idle
              for one in record.heard('cmd_vel', begin, end)]
    needed(speeds or None, 'no commands at rest')
    return Finding(worst(speeds) <= 1e-9, f'{len(speeds)} commands, at most {worst(speeds):.3f}')


@rule('odom: pose', 'Publishing nav_msgs/Odometry message on the odom topic',
      'pose of base_link in odom, equal to TF')
def odometry_equals_tf(record: Record) -> Finding:
    """Check that the odometry says what the transform of the same instant says."""
    names, base, off, at_once = record.profile.frames, record.frame('base_link'), [], 0
    for one in messages(record, 'odom'):
        message, stamp = one.message, stamp_of(one)
        if (message.header.frame_id, message.child_frame_id) != (
                names['odom'], names['base_link']):
            raise Broken(f'odometry of {message.child_frame_id!r} in {message.header.frame_id!r}')
        sample = frame(record, 'base_link').at(stamp)
        if sample is not None and base and stamp <= base.samples[-1].stamp:
            place = message.pose.pose.position
            at_once += bool(base.between(stamp, stamp + 1))
            off.append(dist((place.x, place.y), sample.pose.position[:2]))
    needed(off or None, 'no transform at the time of any odometry')
    # Between two transforms it is not known where in a tick of turtlesim the robot was.
    allowed = 1e-3 if at_once > 0.9 * len(off) else number(record, 'max_velocity') * 0.02 + 1e-3
    return Finding(worst(off) <= allowed, f'{len(off)} compared, at most {worst(off):.4f} m apart')


@rule('odom: twist', 'twist can be a direct copy of the latest cmd_vel', 'a recent cmd_vel')
def twist_is_command(record: Record) -> Finding:
    """Check that each odometry's twist is one of the commands of that time."""
    odometry = [one for drive in drives(record)
                for one in record.heard('odom', drive.begin, drive.end)]
    needed(odometry or None, 'nothing was heard on odom')
    other = 0
    for one in odometry:
        recent = record.heard('cmd_vel', one.published - LATELY, one.published + LATELY)
        twist = velocity(one.message.twist)
        other += bool(recent) and not any(
            dist(twist, velocity(command.message)) < 1e-6 for command in recent)
    return Finding(other <= 0.01 * len(odometry),
                   f'{len(odometry) - other} of {len(odometry)} are')


@rule('joint_states: names', 'Publishing the joint_states of the turtle robot',
      'every movable joint of the URDF')
def joints_are_published(record: Record) -> Finding:
    """Check that every movable joint has a finite position, and no joint is made up."""
    heard = [one.message for one in messages(record, 'joint_states')]
    known = {joint.name for joint in model(record).joints if joint.movable}
    published = {name for message in heard for name in message.name}
    odd = [name for message in heard for name, position in zip(message.name, message.position)
           if not isfinite(position)]
    words = ', '.join(sorted(published))
    if published != known:
        words += f'; in the URDF: {", ".join(sorted(known))}'
    if odd:
        words += f'; not finite: {odd[0]}'
    return Finding(published == known and not odd, words)


@rule('joint_states: velocity', 'Publishing the joint_states … compute based on the wheel radius '
      'and the forward velocity', f'0 at rest, and what rolls off within {ROUGHLY:.0%}')
def joints_have_their_velocity(record: Record) -> Finding:
    """Check that velocities, where they are published, fit the positions."""
    if not any(len(one.message.velocity) for one in messages(record, 'joint_states')):
        raise Open('no velocity is published, and none is demanded')
    at_rest = worst(abs(value) for begin, end in record.idle for joint in model(record).joints
                    for _, value in record.joint(joint.name, begin, end, 'velocity'))
    wheel, rolled, summed = model(record).wheel_joint.name, 0.0, 0.0
    for drive in drives(record):
        angles = record.joint(wheel, drive.begin, drive.end)
        speeds = record.joint(wheel, drive.begin, drive.end, 'velocity')
        rolled += angles[-1][1] - angles[0][1]
        summed += sum((v + w) / 2.0 * (b - a) * NANO
                      for (a, v), (b, w) in zip(speeds, speeds[1:]))
    return Finding(at_rest <= EXACT and abs(summed - rolled) <= ROUGHLY * abs(rolled),
                   f'at most {at_rest:.3f} rad/s at rest, {summed:.1f} of {rolled:.1f} rad')


# ----------------------------------------------------------------------- the robot's description

def cube(record: Record) -> Solid:
    """Return the box of the robot's base; Broken if there is none."""
    return model(record).solid(record.profile.frames['base_link'], 'box')


def turns(joint: Joint) -> bool:
    """Tell whether a joint is one that turns."""
    return joint.kind in ('revolute', 'continuous')


@rule('URDF: base_link', 'A base_link that is the main location of the robot and is represented '
      'by a cube', 'a cube')
def base_is_a_cube(record: Record) -> Finding:
    """Check that the robot's base is a box with equal sides."""
    size = cube(record).size
    return Finding(max(size) <= 1.02 * min(size), '{:.3f} x {:.3f} x {:.3f} m'.format(*size))


@rule('URDF: platform', 'A platform which is a cylindrical link at the top of the robot … '
      'parallel to the ground in the zero position, but should be able to rotate',
      'a cylinder that turns about a horizontal axis, the highest link')
def platform_turns(record: Record) -> Finding:
    """Check that the platform is a level cylinder on top that can be tilted."""
    robot = model(record)
    joint = robot.platform_joint
    platform = robot.pose(robot.platform)
    leaning = inclination(platform) + inclination(robot.solid(robot.platform, 'cylinder').pose)
    higher = [link for link in robot.links if link != robot.platform
              and robot.pose(link).position[2] > platform.position[2] + 1e-6
              and joint not in robot.way(link)]
    level = abs(robot.axis(joint)[2]) <= ALIKE and leaning <= ALIKE
    return Finding(turns(joint) and level and not higher,
                   f'{joint.kind} {joint.name}, inclined by {leaning:.3f} rad' + (
                       f', below {higher[0]}' if higher else ''))


@rule('URDF: room to turn', 'a fixed vertical distance above the base_link, so that it may rotate '
      'fully without colliding with the base link', 'the cube out of reach of the platform')
def platform_clears_the_base(record: Record) -> Finding:
    """Check that the platform can turn over without touching the cube."""
    robot, base = model(record), cube(record)
    platform = robot.solid(robot.platform, 'cylinder')
    radius, thickness = platform.size
    x, y, z = platform.pose.position
    reach = hypot(radius + hypot(x, y), abs(z) + thickness / 2.0)
    top = base.pose.position[2] + base.size[2] / 2.0
    room = robot.pose(robot.platform_joint.child).position[2] - top - reach
    return Finding(room >= -1e-6, f'{room:.3f} m to spare')


@rule('URDF: post', 'A fixed cylindrical link should connect the base_link to the platform',
      'a cylinder, fixed to base_link')
def post_is_fixed(record: Record) -> Finding:
    """Check that between base and platform there is a cylinder that does not move."""
    robot, found = model(record), []
    hinge = robot.pose(robot.platform).position
    for link in set(robot.links) - {robot.platform, record.profile.frames['base_link']}:
        for part in robot.links[link]:
            center = robot.pose(link).transform(part.pose.position)
            if (part.kind == 'cylinder' and not any(joint.movable for joint in robot.way(link))
                    and dist(center[:2], hinge[:2]) <= NEAR and center[2] < hinge[2]):
                found.append(link)
    return Finding(bool(found), listing(found) or 'no such link')


@rule('URDF: stem', 'A stem is a cylindrical link that turns about the vertical z-axis and is '
      'below the base_link', 'a cylinder below the cube that turns about z')
def stem_turns(record: Record) -> Finding:
    """Check that below the base a cylinder turns about the vertical."""
    joint = model(record).stem_joint
    stem = model(record).solid(joint.child, 'cylinder')
    height = model(record).pose(joint.child).transform(stem.pose.position)[2]
    below = cube(record).pose.position[2] - height
    return Finding(below > 0.0 and turns(joint), f'{joint.kind} {joint.name}, {below:.3f} m below')


@rule('URDF: wheel', 'A wheel is connected to the stem and can roll as the robot moves',
      'a cylinder that turns without end about its own axis')
def wheel_rolls(record: Record) -> Finding:
    """Check that the wheel is a cylinder on the stem, and its joint is continuous."""
    joint = model(record).wheel_joint
    along = abs(float(joint.axis @ model(record).solid(joint.child, 'cylinder').pose.upright))
    return Finding(along > 0.999 and joint.kind == 'continuous', f'{joint.kind} {joint.name}')


@rule('URDF: colors', 'Each link should be a different color',
      'base_link, platform, post, stem and wheel differ')
def links_differ_in_color(record: Record) -> Finding:
    """Check that no two of the robot's parts have the same color."""
    robot = model(record)
    parts = {record.profile.frames['base_link'], robot.platform}
    parts |= {robot.stem_joint.child, robot.wheel_joint.child}
    parts |= {joint.child for joint in robot.way(robot.platform) if not joint.movable}
    colors = [robot.links[part][0].color for part in parts if robot.links.get(part)]
    return Finding(len(set(colors)) == len(colors) >= 4,
                   f'{len(set(colors))} colors of {len(colors)} links')


@rule('URDF: numbers', 'changing config/turtle.yaml should be the only change required to work '
      'with a different platform_height or wheel_radius and have the robot appear correctly',
      'platform_height, wheel_radius and platform_radius as configured')
def model_has_the_numbers(record: Record) -> Finding:
    """Check that the description was built from the configured numbers."""
    robot = model(record)
    drawn = robot.numbers()
    for wanted in ('platform_height', 'wheel_radius'):
        if wanted in record.profile.guessed:
            raise Open(f'{wanted} is known from the URDF alone')
    height = number(record, 'platform_height')
    bottom, top = robot.platform_span()
    kept = bottom - EXACT <= height <= top + EXACT
    words = f'platform from {bottom:.3f} to {top:.3f} m (configured {height:.3f})'
    for name in ('wheel_radius', 'platform_radius'):
        configured = record.profile.numbers.get(name)
        if configured is not None:
            kept = kept and abs(drawn[name] - configured) <= EXACT
            words += f', {name} {drawn[name]:.3f} m (configured {configured:.3f})'
    return Finding(kept, words)


# ------------------------------------------------------------------------- driving and tilting

@rule('drive: goal', 'When the node receives this message it starts driving the robot toward the '
      'goal pose using cmd_vel messages', f'there within {PRECISION} m, in 8 directions',
      rests_on=['drive: straight', 'drive: overshoot'])
def goals_are_reached(record: Record) -> Finding:
    """Check that each goal is where the robot ends."""
    off = []
    for drive in drives(record):
        poses = needed(record.heard('pose', drive.begin, drive.end) or None,
                       'the robot is not seen')
        off.append(dist((poses[-1].message.x, poses[-1].message.y), drive.goal))
    return Finding(worst(off) <= PRECISION, f'{len(off)} goals, at most {worst(off):.3f} m off')


def on_the_way(record: Record) -> Iterator[tuple[float, float]]:
    """Yield where the robot is on its drives: how far (m) beyond its goal, and beside its way."""
    for drive in drives(record):
        (x0, y0), (x1, y1) = drive.start, drive.goal
        ux, uy = (x1 - x0) / drive.length, (y1 - y0) / drive.length
        for one in record.heard('pose', drive.begin, drive.end):
            dx, dy = one.message.x - x1, one.message.y - y1
            yield dx * ux + dy * uy, dy * ux - dx * uy


@rule('drive: straight', 'To move in a given direction, the stem points in that direction and '
      'then the robot translates', f'at most {PRECISION} m beside the line')
def drives_are_straight(record: Record) -> Finding:
    """Check that the robot keeps to the line from where it was to its goal."""
    beside = worst(abs(side) for _, side in on_the_way(record))
    return Finding(beside <= PRECISION, f'at most {beside:.3f} m')


@rule('drive: overshoot', 'driving the robot toward the goal pose',
      f'at most {PRECISION} m beyond the goal', rests_on=['drive: speed'])
def drives_do_not_overshoot(record: Record) -> Finding:
    """Check that the robot does not go beyond its goal."""
    beyond = worst(along for along, _ in on_the_way(record))
    return Finding(beyond <= PRECISION, f'{max(beyond, 0.0):.3f} m')


@rule('drive: speed', 'The max_velocity, maximum translational velocity of the robot',
      'no command above max_velocity')
def speed_is_limited(record: Record) -> Finding:
    """Check that no command is faster than the robot may be, and some are not zero."""
    limit = number(record, 'max_velocity')
    speeds = [hypot(*velocity(one.message)[:2]) for one in messages(record, 'cmd_vel')]
    if not any(speeds):
        drives(record)  # Who was not sent anywhere may stand.
    return Finding(0.0 < worst(speeds) <= limit * (1.0 + 1e-6),
                   f'at most {worst(speeds):.3f} m/s of {limit:g}')


@rule('drive: rolling', 'The wheel joint state should be published so that the wheel is rolling '
      'without slipping', 'angle x wheel_radius = way, within 2 %',
      rests_on=['joint_states: names', 'URDF: wheel', 'URDF: numbers', 'frames: base_link'])
def wheel_does_not_slip(record: Record) -> Finding:
    """Check that what rolls off the wheel is the way of the robot, in eight directions."""
    joint, radius = model(record).wheel_joint, number(record, 'wheel_radius')
    base, points, directions = frame(record, 'base_link'), [], set()
    for drive in drives(record):
        # Way and angle at the same instants: at the ends of the span the robot may still move.
        pairs = [(angle, sample.pose.position[:2]) for stamp, angle in record.joint(
            joint.name, drive.begin, drive.end) if (sample := base.at(stamp)) is not None]
        points.append((sum(dist(p, q) for (_, p), (_, q) in zip(pairs, pairs[1:])),
                       radius * sum(abs(b - a) for (a, _), (b, _) in zip(pairs, pairs[1:]))))
        heading = atan2(drive.goal[1] - drive.start[1], drive.goal[0] - drive.start[0])
        directions.add(round(heading / (pi / 4.0)) % 8)
    ways, rolled = zip(*points)
    return Finding(worst(abs(b - a) - SLIP * a - 0.005 for a, b in points) <= 0.0,
                   f'{sum(rolled):.3f} m rolled on {sum(ways):.3f} m, '
                   f'{len(directions)} directions',
                   Plot('Rolling without slipping', 'way of the robot (m)',
                        'angle of the wheel x radius (m)', [Series('a drive', ways, rolled)],
                        Series('without slipping', [0.0, max(ways)], [0.0, max(ways)])))


def misaligned(record: Record, sample: Sample, stem: float, way: Array) -> float:
    """Return the angle between a way of base_link and that on which the wheel rolls."""
    axis = sample.pose.axes @ model(record).axis(
        model(record).wheel_joint, {model(record).stem_joint.name: stem})
    return asin(min(abs(float(axis[:2] @ way)) / hypot(*way), 1.0))


@rule('drive: stem first', 'To move in a given direction, the stem points in that direction and '
      'then the robot translates', f'turned, within {CROOKED:g} degrees, before the robot moves',
      rests_on=['drive: stem'])
def stem_turns_first(record: Record) -> Finding:
    """Check that the stem points along the motion already while the robot still stands."""
    early = []
    for drive in drives(record):
        samples = frame(record, 'base_link').between(drive.begin, drive.end)
        ways = [(one.pose.position - samples[0].pose.position)[:2] for one in samples]
        moved = [number for number, way in enumerate(ways) if hypot(*way) > EXACT]
        far = [way for way in ways if hypot(*way) > AWAY]
        if not far:
            continue
        sets_off = turned = samples[moved[0]].stamp
        for stamp, angle in reversed(record.joint(
                model(record).stem_joint.name, drive.begin, drive.end)):
            if stamp < sets_off:
                if misaligned(record, samples[0], angle, far[0]) > radians(CROOKED):
                    break
                turned = stamp
        early.append((sets_off - turned) * NANO)
    some(early, 'the robot was not seen to drive')
    return Finding(min(early) > 0.0, f'at least {min(early):.3f} s before, {len(early)} times')


@rule('drive: stem', 'the stem points in that direction and then the robot translates (while the '
      'wheel rolls)', f'the wheel rolls along the motion, within {CROOKED:g} degrees',
      rests_on=['joint_states: names', 'URDF: stem', 'URDF: wheel'])
def stem_points_along(record: Record) -> Finding:
    """Check that in the middle of each drive the wheel's axis is across the motion."""
    off = []
    for drive in drives(record):
        samples = frame(record, 'base_link').between(drive.begin, drive.end)
        moving = [(b, way) for a, b in zip(samples, samples[STRIDE:])
                  if hypot(*(way := (b.pose.position - a.pose.position)[:2])) > NEAR]
        angles = record.joint(model(record).stem_joint.name, drive.begin, drive.end)
        for sample, way in moving[len(moving) // 4:-len(moving) // 4 or None]:
            angle = min(angles, key=lambda one: abs(one[0] - sample.stamp))[1]
            off.append(misaligned(record, sample, angle, way))
    some(off, 'the robot was not seen to drive')
    return Finding(worst(off) <= radians(CROOKED),
                   f'at most {degrees(worst(off)):.1f} degrees off, {len(off)} times')


@rule('tilt', 'The tilt angle of the platform is set to the last message received on this topic',
      'joint and TF at each angle that was asked for',
      rests_on=['frames: robot', 'URDF: platform'])
def tilt_is_obeyed(record: Record) -> Finding:
    """Check that the platform takes each angle that is asked for, in its joint and in TF."""
    if not some(record.tilts, 'the platform was not tilted')[0].answered:
        raise Broken(record.tilts[0].words)
    joint, words, kept = model(record).platform_joint, [], True
    for ask in record.tilts:
        positions = record.joint(joint.name, ask.begin, ask.end)
        platform = record.platform(ask.end - 50_000_000)
        if not positions or platform is None:
            raise Broken('joint or frame of the platform are not heard')
        angle, leaning = positions[-1][1], inclination(platform)
        kept = kept and abs(angle - ask.what) <= ALIKE and abs(leaning - abs(angle)) <= ALIKE
        words.append(f'{ask.what:g}: {angle:.3f}, in TF |{leaning:.3f}|')
    return Finding(kept, '; '.join(words))
