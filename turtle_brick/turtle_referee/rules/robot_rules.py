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
from itertools import pairwise
from math import asin, degrees, dist, hypot, isfinite
from typing import Any

from turtle_referee.graph_client.constants import (ALIKE, CENTER, CROOKED, EXACT, SECONDS_PER_NS, NEAR, PHYSICS_RATE,
                                      PRECISION, RATE, RATE_TOLERANCE, ROUGHLY, SLIP)
from turtle_referee.graph_client.geometry import Array, inclination
from turtle_referee.graph_client.record import Drive, Frame, Received, message_rate, Record, Sample, stamp_of
from turtle_referee.rules.robot_model import model
from turtle_referee.rules.rule import (from_faults, Broken, Finding, require, number, require_accepted, Open, Plot,
                                  Rules, Series, require_data, within, worst)

RULES = Rules()
rule = RULES.rule

AWAY = 0.02  # how far (m) the robot is from where it set off when its direction is taken
STRIDE = 5  # over how many transforms the direction of the motion is taken
LATELY = 50_000_000  # how long (ns) before and after an odometry message its command is published
GLOBAL = ('/tf', '/tf_static', '/rosout', '/parameter_events', '/clock')


def frame(record: Record, name: str, parent: str = '') -> Frame:
    """Return what was broadcast of a frame; Broken if nothing was, or below another parent."""
    found = require(record.frames.get(name), f'nobody broadcasts {name}')
    parents = {sample.parent for sample in found.samples}
    if parent and parents != {parent}:
        raise Broken(f'{name} is below {", ".join(sorted(parents))}')
    return found


def messages(record: Record, name: str) -> list[Received]:
    """Return what was heard on a topic; Broken if nothing was."""
    return require(record.topics[name] or None,
                  f'nothing was heard on {record.profile.topics[name]}')


def drives(record: Record) -> list[Drive]:
    """Return the drives that led somewhere; Open if there are none."""
    return require_data([drive for drive in record.drives if drive.length > 0.1],
                'the robot was not driven')


# ------------------------------------------------------------------------------ frames and names

@rule('frames: world', 'All other frames are descendants of world')
def all_below_world(record: Record) -> Finding:
    """Expect every frame to be below world, however far."""
    require(record.frames or None, 'nobody broadcasts any frame')
    return from_faults([f'{name} is not below world' for name in record.frames
                    if record.ancestors(name)[-1] != 'world'], len(record.frames), 'frames')


@rule('frames: odom', 'odom … a fixed offset from world … the initial location of the turtle')
def odom_is_fixed(record: Record) -> Finding:
    """Expect it below world, fixed, where the turtle began."""
    places = [sample.pose.position[:2] for sample in frame(record, 'odom', 'world').samples]
    moved = worst(dist(place, places[0]) for place in places)
    began = frame(record, 'base_link').samples[0].pose.position[:2]
    away = min(dist(places[0], CENTER), hypot(*began))
    return Finding(moved <= EXACT and away <= NEAR, 'at ({:.3f}, {:.3f})'.format(*places[0])
                   + f', {away:.3f} m from the start, moved by {moved:.3f} m')


@rule('frames: base_link', "The turtle's location relative to odom is … its wheel odometry",
      ['frames: odom'])
def base_link_is_the_turtle(record: Record) -> Finding:
    """Expect it below odom, at rest within {NEAR} m of where turtlesim has the turtle."""
    frame(record, 'base_link', 'odom')
    off = []
    for end in (*(end for _, end in record.idle), *(drive.end for drive in record.drives)):
        poses = record.messages('pose', end - 200_000_000, end)
        base = record.pose('base_link', end - 20_000_000)
        if poses and base:
            off.append(dist(base.position[:2], (poses[-1].message.x, poses[-1].message.y)))
    return within(NEAR, off, 'the turtle was not seen at rest')


@rule('frames: robot', "base_link has other child frames, as defined by the robot's urdf file",
      ['rate: joint_states'])
def links_are_frames(record: Record) -> Finding:
    """Expect every link of the URDF in TF, below base_link."""
    links = model(record).links
    return from_faults([f'{link} is not in TF' for link in links if link != 'base_link'
                    and 'base_link' not in record.ancestors(link)], len(links), 'links')


@rule('frames: brick', 'brick. This frame is the location of the brick')
def brick_is_below_world(record: Record) -> Finding:
    """Expect a frame below world."""
    frame(record, 'brick')
    way = record.ancestors('brick')
    return Finding(way[-1] == 'world', ' -> '.join(reversed(way)))


@rule('frames: broadcasters', 'Broadcasting the … base_link frame …, the brick frame …')
def one_broadcaster(record: Record) -> Finding:
    """Expect one broadcaster for each frame."""
    require(record.frames or None, 'nobody broadcasts any frame')
    return from_faults([f'{name} by several' for name, one in record.frames.items() if one.both
                    or sum(later < earlier for earlier, later in pairwise(one.numbers)) > 2],
                   len(record.frames), 'frames')


@rule('names: relative', 'refer to ROS entities using relative names from within your nodes')
def names_are_relative(record: Record) -> Finding:
    """Expect everything below the namespace, but what ROS itself has outside."""
    if record.namespace == '/':
        raise Open('start the graph in a namespace, and give it with --namespace')
    own = f'{record.namespace}/'
    topics = require([topic for topic, speakers in record.publishers.items() if topic not in GLOBAL
                     and any(speaker.startswith(own) for speaker in speakers)] or None,
                    f'nothing is published below {record.namespace}')
    return from_faults([f'{topic} is outside' for topic in topics if not topic.startswith(own)],
                   len(topics), 'topics')


# --------------------------------------------------------------------------------------- rates

def judge_rate(name: str, nominal: float, record: Record) -> Finding:
    """Judge the rate of something, by its stamps, at rest and on the move."""
    found = []
    for begin, end in (*require_data(record.idle, 'the graph was not watched'), *record.driving):
        if name in record.topics:
            required_messages(record, name)
            stamps = [stamp_of(heard) for heard in record.messages(name, begin, end)]
        else:
            stamps = [sample.stamp for sample in frame(record, name).between(begin, end)]
        found.append(message_rate([stamp * SECONDS_PER_NS for stamp in stamps]))
    return Finding(all(abs(hertz / nominal - 1.0) <= RATE_TOLERANCE for hertz in found), ', '.join(
        f'{hertz:.2f} Hz {label}' for hertz, label in zip(found, ('at rest', 'driving'))))


for sentence, nominal, *named in (
        ('All publishing and broadcasting shall be done at 100 Hz', RATE,
         'cmd_vel', 'odom', 'joint_states', 'base_link'),
        ('The node should simulate the physics at 250 Hz', PHYSICS_RATE, 'brick')):
    for one in named:
        rule(f'rate: {one}', sentence, expected=f'{nominal:g} Hz ± {{RATE_TOLERANCE:.0%}}')(
            partial(judge_rate, one, nominal))


# --------------------------------------------------------------------- what the robot publishes

def velocity(message: Any) -> tuple[float, float, float]:
    """Return x and y (m/s) and yaw (rad/s) of a Twist, or of a message that has one."""
    twist = getattr(message, 'twist', message)
    return twist.linear.x, twist.linear.y, twist.angular.z


@rule('cmd_vel: at rest', 'If the turtle is not moving … a cmd_vel of 0')
def commands_at_rest(record: Record) -> Finding:
    """Expect 0 at rest."""
    require_data(record.idle, 'the graph was not watched')
    speeds = [hypot(*velocity(one.message)) for begin, end in record.idle
              for one in record.messages('cmd_vel', begin, end)]
    require(speeds or None, 'no commands at rest')
    return Finding(worst(speeds) <= 1e-9, f'{len(speeds)} commands, at most {worst(speeds):.3f}')


@rule('odom: pose', 'Publishing nav_msgs/Odometry message on the odom topic')
def odometry_equals_tf(record: Record) -> Finding:
    """Expect the pose of base_link in odom, as TF has it, within a tick's way."""
    off = []
    for one in required_messages(record, 'odom'):
        said = (one.message.header.frame_id, one.message.child_frame_id)
        if said != ('odom', 'base_link'):
            raise Broken(f'odometry of {said[1]!r} in {said[0]!r}')
        sample = frame(record, 'base_link').at(stamp_of(one))
        if sample is not None:
            place = one.message.pose.pose.position
            off.append(dist((place.x, place.y), sample.pose.position[:2]))
    require(off or None, 'no transform at the time of any odometry')
    # Between two transforms it is not known where in a tick of turtlesim the robot was.
    return within(number(record, 'max_velocity') * 0.016 + EXACT, off, '')


@rule('odom: twist', 'twist can be a direct copy of the latest cmd_vel')
def twist_is_command(record: Record) -> Finding:
    """Expect a cmd_vel of that time, 99 of 100 times."""
    required_messages(record, 'odom')
    alike = []
    for one in [one for drive in drives(record)
                for one in record.messages('odom', drive.begin, drive.end)]:
        recent = record.messages('cmd_vel', one.published - LATELY, one.published + LATELY)
        alike.append(any(dist(velocity(one.message.twist), velocity(command.message)) < 1e-6
                         for command in recent))
    return Finding(sum(alike) >= 0.99 * len(alike), f'{sum(alike)} of {len(alike)} are')


@rule('joint_states: names', 'Publishing the joint_states of the turtle robot')
def joints_are_published(record: Record) -> Finding:
    """Expect every movable joint of the URDF and no other, with a finite position."""
    heard = [one.message for one in required_messages(record, 'joint_states')]
    known = {joint.name for joint in model(record).joints if joint.movable}
    published = {name for message in heard for name in message.name}
    finite = all(isfinite(position) for message in heard for position in message.position)
    return Finding(published == known and finite, f'{", ".join(sorted(published))}; in the URDF: '
                   f'{", ".join(sorted(known))}' + '; not finite' * (not finite))


@rule('joint_states: velocity', 'based on the wheel radius and the forward velocity')
def joints_have_their_velocity(record: Record) -> Finding:
    """Expect 0 at rest, and what rolls off within {ROUGHLY:.0%}."""
    if not any(len(one.message.velocity) for one in required_messages(record, 'joint_states')):
        raise Open('no velocity is published, and none is demanded')
    at_rest = worst(abs(value) for begin, end in record.idle for joint in model(record).joints
                    for _, value in record.joint(joint.name, begin, end, 'velocity'))
    wheel, rolled, summed = model(record).joint('wheel').name, 0.0, 0.0
    for drive in drives(record):
        angles = record.joint(wheel, drive.begin, drive.end)
        speeds = record.joint(wheel, drive.begin, drive.end, 'velocity')
        rolled += angles[-1][1] - angles[0][1]
        summed += sum((v + w) / 2.0 * (b - a) * SECONDS_PER_NS for (a, v), (b, w) in pairwise(speeds))
    return Finding(at_rest <= EXACT and abs(summed - rolled) <= ROUGHLY * abs(rolled),
                   f'at most {at_rest:.3f} rad/s at rest, {summed:.1f} of {rolled:.1f} rad')


# ----------------------------------------------------------------------- the robot's description

@rule('URDF: base_link', 'A base_link that … is represented by a cube')
def base_is_a_cube(record: Record) -> Finding:
    """Expect a cube."""
    size = model(record).solid('base_link', 'box').size
    return Finding(max(size) <= 1.02 * min(size), '{:.3f} x {:.3f} x {:.3f} m'.format(*size))


@rule('URDF: platform', 'a cylindrical link at the top … parallel to the ground in the zero '
      'position, but should be able to rotate')
def platform_turns(record: Record) -> Finding:
    """Expect a level cylinder that turns about a horizontal axis, the highest link."""
    robot = model(record)
    joint, platform = robot.joint('platform'), robot.pose('platform')
    leaning = inclination(platform.compose(robot.solid('platform', 'cylinder').pose))
    higher = max(robot.pose(link).position[2] for link in robot.links
                 if joint not in robot.way(link)) - platform.position[2]
    return Finding(abs(robot.axis(joint)[2]) <= ALIKE and leaning <= ALIKE and higher <= 1e-6,
                   f'{joint.name}, inclined by {leaning:.3f} rad, others {-higher:.3f} m below')


@rule('URDF: room to turn', 'it may rotate fully without colliding with the base link')
def platform_clears_the_base(record: Record) -> Finding:
    """Expect the cube out of reach of the platform, however far that turns."""
    robot = model(record)
    base, platform = robot.solid('base_link', 'box'), robot.solid('platform', 'cylinder')
    (radius, thickness), (x, y, z) = platform.size, platform.pose.position
    reach = hypot(radius + hypot(x, y), abs(z) + thickness / 2.0)
    top = base.pose.position[2] + base.size[2] / 2.0
    room = robot.pose(robot.joint('platform').child).position[2] - top - reach
    return Finding(room >= -1e-6, f'{room:.3f} m to spare')


@rule('URDF: post', 'A fixed cylindrical link should connect the base_link to the platform')
def post_is_fixed(record: Record) -> Finding:
    """Expect a cylinder below the platform, fixed to base_link."""
    robot = model(record)
    hinge = robot.pose('platform').position
    fixed = [link for link in robot.links if link != 'base_link'
             and not any(joint.movable for joint in robot.way(link))]
    found = [link for link in fixed for part in robot.links[link] if part.kind == 'cylinder'
             and dist((place := robot.middle(link, part))[:2], hinge[:2]) <= NEAR
             and place[2] < hinge[2]]
    return Finding(bool(found), ', '.join(found) or 'no such link')


@rule('URDF: stem', 'a cylindrical link that turns about the vertical z-axis and is below')
def stem_turns(record: Record) -> Finding:
    """Expect a cylinder below the cube that turns about z."""
    robot, joint = model(record), model(record).joint('stem')
    stem, base = robot.solid('stem', 'cylinder'), robot.solid('base_link', 'box')
    below = base.pose.position[2] - robot.middle('stem', stem)[2]
    upright = abs(float(robot.axis(joint)[2]))
    return Finding(below > 0.0 and upright > 0.999,
                   f'{joint.name}, {below:.3f} m below, its axis {upright:.3f} along z')


@rule('URDF: wheel', 'A wheel is connected to the stem and can roll as the robot moves')
def wheel_rolls(record: Record) -> Finding:
    """Expect a cylinder on the stem that turns without end about its own axis, a level one."""
    robot, joint = model(record), model(record).joint('wheel')
    along = abs(float(joint.axis @ robot.solid('wheel', 'cylinder').pose.upright))
    on_stem = robot.joint('stem') in robot.way(joint.parent)
    return Finding(on_stem and along > 0.999 and abs(robot.axis(joint)[2]) < 0.05
                   and joint.kind == 'continuous', f'{joint.kind} {joint.name}')


@rule('URDF: colors', 'Each link should be a different color')
def links_differ_in_color(record: Record) -> Finding:
    """Expect base_link, platform, post, stem and wheel to differ."""
    robot = model(record)
    parts = {'base_link', 'platform', 'stem', 'wheel',
             *(joint.child for joint in robot.way('platform') if not joint.movable)}
    colors = [robot.links[part][0].color for part in parts if robot.links.get(part)]
    return Finding(len(set(colors)) == len(colors) >= 4,
                   f'{len(set(colors))} colors of {len(colors)} links')


@rule('URDF: numbers', 'changing config/turtle.yaml should be the only change required',
      ['URDF: wheel'])
def model_has_the_numbers(record: Record) -> Finding:
    """Expect platform_height, wheel_radius and platform_radius as configured."""
    robot, height = model(record), number(record, 'platform_height')
    bottom, top = robot.platform_span()
    kept = bottom - EXACT <= height <= top + EXACT
    words = f'platform from {bottom:.3f} to {top:.3f} m (configured {height:.3f})'
    for link in ('wheel', 'platform'):
        name, drawn = f'{link}_radius', robot.solid(link, 'cylinder').size[0]
        configured = number(record, name)
        kept = kept and abs(drawn - configured) <= EXACT
        words += f', {name} {drawn:.3f} m (configured {configured:.3f})'
    return Finding(kept, words)


# ------------------------------------------------------------------------- driving and tilting

@rule('drive: goal', 'driving the robot toward the goal pose using cmd_vel messages',
      ['drive: straight', 'drive: overshoot'])
def goals_are_reached(record: Record) -> Finding:
    """Expect it there within {PRECISION} m, in 8 directions."""
    off = []
    for drive in drives(record):
        poses = require(record.messages('pose', drive.begin, drive.end) or None,
                       'the robot is not seen')
        off.append(dist((poses[-1].message.x, poses[-1].message.y), drive.goal))
    return within(PRECISION, off, '')


def on_the_way(record: Record) -> Iterator[tuple[float, float]]:
    """Yield where the robot is on its drives: how far (m) beyond its goal, and beside its way."""
    for drive in drives(record):
        (x0, y0), (x1, y1) = drive.start, drive.goal
        ux, uy = (x1 - x0) / drive.length, (y1 - y0) / drive.length
        for one in record.messages('pose', drive.begin, drive.end):
            dx, dy = one.message.x - x1, one.message.y - y1
            yield dx * ux + dy * uy, dy * ux - dx * uy


@rule('drive: straight', 'the stem points in that direction and then the robot translates')
def drives_are_straight(record: Record) -> Finding:
    """Expect at most {PRECISION} m beside the line from start to goal."""
    return within(PRECISION, [abs(side) for _, side in on_the_way(record)], 'it is not seen')


@rule('drive: overshoot', 'driving the robot toward the goal pose', ['drive: speed'])
def drives_do_not_overshoot(record: Record) -> Finding:
    """Expect at most {PRECISION} m beyond the goal."""
    return within(PRECISION, [along for along, _ in on_the_way(record)], 'it is not seen')


@rule('drive: speed', 'The max_velocity, maximum translational velocity of the robot')
def speed_is_limited(record: Record) -> Finding:
    """Expect commands above 0, and none above max_velocity."""
    limit = number(record, 'max_velocity')
    speeds = [hypot(*velocity(one.message)[:2]) for one in required_messages(record, 'cmd_vel')]
    if not any(speeds):
        drives(record)  # Who was not sent anywhere may stand.
    return Finding(0.0 < worst(speeds) <= limit * (1.0 + 1e-6),
                   f'at most {worst(speeds):.3f} m/s of {limit:g}')


@rule('drive: rolling', 'the wheel is rolling without slipping',
      ['joint_states: names', 'URDF: wheel', 'URDF: numbers', 'frames: base_link'])
def wheel_does_not_slip(record: Record) -> Finding:
    """Expect angle x wheel_radius = way, within {SLIP:.0%}."""
    joint, radius = model(record).joint('wheel'), number(record, 'wheel_radius')
    base, points = frame(record, 'base_link'), []
    for drive in drives(record):
        # Way and angle at the same instants: at the ends of the span the robot may still move.
        pairs = [(angle, sample.pose.position[:2]) for stamp, angle in record.joint(
            joint.name, drive.begin, drive.end) if (sample := base.at(stamp)) is not None]
        points.append((sum(dist(p, q) for (_, p), (_, q) in pairwise(pairs)),
                       radius * sum(abs(b - a) for (a, _), (b, _) in pairwise(pairs))))
    ways, rolled = zip(*points)
    return Finding(worst(abs(b - a) - SLIP * a - 0.005 for a, b in points) <= 0.0,
                   f'{sum(rolled):.3f} m rolled on {sum(ways):.3f} m, {len(points)} drives',
                   Plot('Rolling without slipping', 'way of the robot (m)',
                        'angle of the wheel x radius (m)', [Series('a drive', ways, rolled)],
                        Series('without slipping', [0.0, max(ways)], [0.0, max(ways)])))


def misaligned(record: Record, sample: Sample, stem: float, way: Array) -> float:
    """Return the angle (degrees) between a way of base_link and that on which the wheel rolls."""
    robot = model(record)
    axis = sample.pose.axes @ robot.axis(robot.joint('wheel'), {robot.joint('stem').name: stem})
    return degrees(asin(min(abs(float(axis[:2] @ way)) / hypot(*way), 1.0)))


@rule('drive: stem first', 'the stem points in that direction and then the robot translates',
      ['drive: stem'])
def stem_turns_first(record: Record) -> Finding:
    """Expect it turned, within {CROOKED:g} degrees, before the robot moves."""
    early = []
    for drive in drives(record):
        samples = frame(record, 'base_link').between(drive.begin, drive.end)
        ways = [(one.stamp, (one.pose.position - samples[0].pose.position)[:2]) for one in samples]
        far = [way for _, way in ways if hypot(*way) > AWAY]
        if far:
            sets_off = turned = next(stamp for stamp, way in ways if hypot(*way) > EXACT)
            for stamp, angle in reversed(record.joint(
                    model(record).joint('stem').name, drive.begin, sets_off)):
                if misaligned(record, samples[0], angle, far[0]) > CROOKED:
                    break
                turned = stamp
            early.append((sets_off - turned) * SECONDS_PER_NS)
    require_data(early, 'the robot was not seen to drive')
    return Finding(min(early) > 0.0, f'at least {min(early):.3f} s before, {len(early)} times')


@rule('drive: stem', 'the stem points in that direction … (while the wheel rolls)',
      ['joint_states: names', 'URDF: stem', 'URDF: wheel'])
def stem_points_along(record: Record) -> Finding:
    """Expect the wheel to roll along the motion, within {CROOKED:g} degrees."""
    off = []
    for drive in drives(record):
        samples = frame(record, 'base_link').between(drive.begin, drive.end)
        moving = [(b, way) for a, b in zip(samples, samples[STRIDE:])
                  if hypot(*(way := (b.pose.position - a.pose.position)[:2])) > NEAR]
        angles = record.joint(model(record).joint('stem').name, drive.begin, drive.end)
        for sample, way in moving[len(moving) // 4:-len(moving) // 4 or None]:
            angle = min(angles, key=lambda one: abs(one[0] - sample.stamp))[1]
            off.append(misaligned(record, sample, angle, way))
    return within(CROOKED, off, 'the robot was not seen to drive',
                  'at most {:.1f} degrees off, {} times')


@rule('tilt', 'The tilt angle … is set to the last message received on this topic',
      ['frames: robot', 'URDF: platform'])
def tilt_is_obeyed(record: Record) -> Finding:
    """Expect joint and TF at each angle that was asked for."""
    joint, words, kept = model(record).joint('platform'), [], True
    for ask in require_data(record.tilts, 'the platform was not tilted'):
        require_accepted(ask)
        positions = record.joint(joint.name, ask.begin, ask.end)
        platform = record.platform(ask.end - 50_000_000)
        if not positions or platform is None:
            raise Broken('joint or frame of the platform are not heard')
        angle, leaning = positions[-1][1], inclination(platform)
        kept = kept and abs(angle - ask.what) <= ALIKE and abs(leaning - abs(angle)) <= ALIKE
        words.append(f'{ask.what:g}: {angle:.3f}, in TF |{leaning:.3f}|')
    return Finding(kept, '; '.join(words))
