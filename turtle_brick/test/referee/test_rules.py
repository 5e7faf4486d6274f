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

"""The referee's rules on an exercise that is made up: all keep it, and each finds its faults."""

from functools import partial
from math import atan2, inf, nan, pi, radians, sin, sqrt
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
import numpy
import pytest
from sensor_msgs.msg import JointState
from turtle_brick.core.parameters import default_path, load
from turtle_referee import referee
from turtle_referee.graph_client.constants import CENTER, SECONDS_PER_NS, NS_PER_SECOND
from turtle_referee.graph_client.drops import DropWatch
from turtle_referee.graph_client.geometry import Pose, pose, turn, UPRIGHT
from turtle_referee.graph_client.profile import Profile
from turtle_referee.graph_client.record import Request, Drive, Frame, Received, ReceivedMarker, Record, Sample
from turtle_referee.rules import robot_rules
from turtle_referee.rules.robot_model import model
from turtle_referee.rules.rule import BROKEN, KEPT, OPEN, Rules
from visualization_msgs.msg import Marker
import xacro

BEGIN = 1_800_000_000 * NS_PER_SECOND
"""When all of this is said to have happened (ns)."""

PARAMETERS = load()
NUMBERS = Profile.from_parameters(PARAMETERS).numbers
LENGTH, WIDTH, HEIGHT = PARAMETERS.brick_size
REST = PARAMETERS.platform_height + HEIGHT / 2.0
"""Height (m) of the center of a brick on the platform."""

HINGE = PARAMETERS.platform_height - PARAMETERS.platform_thickness
SPEED = 3.0
"""How fast (m/s) the robot drives."""

AHEAD = numpy.array((0.8, 0.6))
"""In which direction it drives."""

LEG = 0.7
"""How long (s) it takes it to go 1.5 m, and to rest a while."""

URDF = xacro.process_file(
    str(Path(__file__).parents[2] / 'urdf' / 'turtle.urdf.xacro'),
    mappings={'params_file': str(default_path())}).toxml()

ASIDE = 0.1
"""How far (m) down the slope of the platform a brick lands, from its axis."""

FAR, CLOSE = (1.5, 1.5, 8.0), (CENTER[0] + ASIDE, CENTER[1], 4.0)
"""From where the bricks fall: one beside the robot, the other on its platform."""

LEANING, TILT, LEVEL = 0.5, 6.7, 7.9
"""The angle (rad) by which the platform is tilted to tip a brick off, from when to when (s)."""


def at(seconds):
    """Return the instant (ns) that is some time (s) after the beginning."""
    return BEGIN + round(seconds * NS_PER_SECOND)


def say_frame(record, child, parent, track, static=False):
    """Have a frame broadcast: (time in s, Pose) each."""
    frame = record.frames.setdefault(child, Frame(static))
    for number, (seconds, there) in enumerate(track, len(frame.samples)):
        frame.add(at(seconds), number, Sample(at(seconds), parent, there))


def say(record, topic, message, seconds, late=0.0):
    """Have a message published, some time (s) after its stamp if it has one."""
    if hasattr(message, 'header'):
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(at(seconds), NS_PER_SECOND)
    record.topics[topic].append(Received(at(seconds + late), message))


def show(record, marker, seconds, topic='/marker'):
    """Have a marker published."""
    record.markers.append(ReceivedMarker(at(seconds), topic, marker))


def pitch(angle):
    """Return the axes of what is turned about y."""
    return turn(UPRIGHT[1], angle)


def box(frame, x=0.0, y=0.0, size=(LENGTH, WIDTH, HEIGHT)):
    """Return a marker."""
    marker = Marker(type=Marker.CUBE)
    marker.header.frame_id = frame
    marker.pose.position.x, marker.pose.position.y = x, y
    marker.scale.x, marker.scale.y, marker.scale.z = size
    marker.color.a = 1.0
    return marker


def show_walls(record, times):
    """Have the walls published, four markers each time."""
    for seconds in times:
        for x, y, *size in ((5.5, 0.0, 11.1, 0.1, 0.5), (5.5, 11.1, 11.1, 0.1, 0.5),
                            (0.0, 5.5, 0.1, 11.1, 0.5), (11.1, 5.5, 0.1, 11.1, 0.5)):
            show(record, box('world', x, y, size), seconds, '/walls')


# ------------------------------------------------------------------------------- what is heard

def drive(record, off):
    """Have the robot rest until 0 s, drive a leg to and fro, and say what it does."""
    base = numpy.array((0.0, 0.0, HINGE - model(record).pose('platform').position[2]))
    for joint in model(record).joints:
        say_frame(record, joint.child, joint.parent, (
            (number / 10.0, joint.origin) for number in range(-5, 50)),
                  static=joint.child != 'platform')
    say_frame(record, 'odom', 'world', [(-0.5, pose((*CENTER, 0.0)))], static=True)
    record.idle, record.driving = [(at(-0.5), at(0.0))], [(at(0.0), at(2.0 * LEG))]
    for begin, here, there in ((0.0, 0.0, 1.5), (LEG, 1.5, 0.0)):
        start, goal = (tuple(CENTER + way * AHEAD) for way in (here, there))
        record.drives.append(Drive(at(begin), at(begin + LEG - 0.01), start, goal))
    for number in range(-int(off.rate / 2.0), int(2.0 * LEG * off.rate)):
        # In order, as DDS has it: whoever waits holds up those behind.
        seconds, late = number / off.rate, 0.5 / off.rate * (number % 100 == 49)
        back = seconds >= LEG
        way = min(max(seconds - LEG * back, 0.0) * SPEED, 1.5)
        speed = (-SPEED if back else SPEED) if 0.0 < way < 1.5 else 0.0
        x, y = (1.5 - way if back else way) * AHEAD
        turn_of_wheel = off.slip / NUMBERS['wheel_radius']
        odometry, twist = Odometry(child_frame_id='base_link'), Twist()
        odometry.header.frame_id = 'odom'
        odometry.pose.pose.position.x, odometry.pose.pose.position.y = x, y
        for one in (odometry.twist.twist, twist):
            one.linear.x, one.linear.y = speed * AHEAD
        say_frame(record, 'base_link', 'odom', [(seconds, pose(base + (x, y, 0.0)))])
        say(record, 'odom', odometry, seconds, late)
        say(record, 'cmd_vel', twist, seconds)
        say(record, 'joint_states', JointState(
            name=['stem_joint', 'wheel_joint', 'platform_joint'],
            position=[atan2(*AHEAD[::-1]) + pi * back + off.crooked,
                      (way + 1.5 * back) * turn_of_wheel, 0.0],
            velocity=[0.0, abs(speed) * turn_of_wheel, 0.0]), seconds)
        say(record, 'pose', SimpleNamespace(x=CENTER[0] + x, y=CENTER[1] + y), seconds)
    say_frame(record, 'base_link', 'odom', [
        (2.0 * LEG + number / 10.0, pose(base)) for number in range(72)])


def drop(record, asked, place, track):
    """Have a brick dropped that moves along (time in s, Pose) each, and watch it to the end."""
    watch = DropWatch(record, at(asked - 0.1), place, record.platform(at(asked - 0.1)))
    watch.asked = at(asked)
    watch.ask = Request(at(asked), at(asked + 0.01), None)
    say_frame(record, 'brick', 'world', track)
    if place == FAR:
        text = Marker(type=Marker.TEXT_VIEW_FACING, text='Unreachable')
        text.header.frame_id, text.lifetime.sec = 'world', 3
        text.scale.z = text.color.a = 1.0
        show(record, text, asked + 0.2, '/text')
    watch.look()
    watch.end, watch.should = at(track[-1][0]), place == CLOSE
    record.drops.append(watch)


def fall(record, off):
    """Have the brick hover until 2.5 s, fall beside the platform and lie on the ground."""
    say_frame(record, 'brick', 'world', (
        (number / 250.0, pose(FAR)) for number in range(-125, 610)))
    record.places.append(Request(at(2.0), at(2.44), FAR))
    track = []
    for now in numpy.arange(2.44, 4.2, off.step):
        time = max(now - 2.5, 0.0)
        depth = off.gravity * time * time / 2.0
        track.append((now, pose((FAR[0] + off.aside * time, FAR[1],
                                 max(FAR[2] - depth, HEIGHT / 2.0 - off.below)))))
    drop(record, 2.45, FAR, track)


def tip(record, off):
    """Have a brick fall on the platform from 5.5 s on, which is tilted then, and slide off."""
    joint, level, leaning = model(record).joint('platform'), UPRIGHT, pitch(LEANING)
    acceleration = off.pull * off.gravity * sin(LEANING)
    gone = TILT + sqrt(2.0 * (off.stop - ASIDE) / acceleration)
    track = []
    for now in (5.0 + number * 0.008 for number in range(425)):
        tilted = TILT <= now < LEVEL
        axes = leaning if tilted else level
        say_frame(record, 'platform', joint.parent, [
            (now, joint.origin.compose(Pose(numpy.zeros(3), axes)))])
        say(record, 'joint_states', JointState(
            name=['platform_joint'], position=[LEANING * tilted]), now)
        there = numpy.array(CLOSE) - (0.0, 0.0, off.gravity * max(now - 5.5, 0.0) ** 2 / 2.0)
        if there[2] < REST + off.above:
            way = ASIDE + acceleration * max(min(now, gone) - TILT, 0.0) ** 2 / 2.0
            hinge = Pose(numpy.array((*CENTER, HINGE)), leaning if now >= gone else axes)
            there = hinge.transform((way, 0.0, REST + off.above - HINGE))
            there[0] += off.drift * max(now - gone, 0.0)
        track.append((now, Pose(there, axes @ pitch(off.lean))))
    record.tilts = [Request(at(TILT), at(TILT + 0.3), LEANING), Request(at(LEVEL), at(LEVEL + 0.3), 0.0)]
    record.places.append(Request(at(5.0), at(5.44), CLOSE))
    drop(record, 5.45, CLOSE, track)


RIGHT = {
    'slip': 1.0, 'crooked': 0.0, 'rate': 100.0, 'gravity': NUMBERS['gravity_accel'],
    'step': 0.008, 'aside': 0.0, 'below': 0.0, 'above': 0.0, 'lean': 0.0, 'pull': 1.0,
    'stop': NUMBERS['platform_radius'] + LENGTH / 2.0, 'drift': 0.0}
"""
An exercise that is right: by which factor the wheel turns too far, and the stem too far (rad), how
often (Hz) the robot publishes, how a brick falls (m/s^2), how often (s) it is seen and how fast
(m/s) it goes aside, how far (m) below the ground and above the platform it comes to rest, how it
is inclined there (rad), with which part of g sin(angle) it slides, where (m) it floats, and how
fast (m/s) it drifts then.
"""


PARTS = (drive, fall, tip)


def exercise(parts=PARTS, **off):
    """Return the record of an exercise that is right, but for what is said to be off."""
    record = Record(Profile(numbers=dict(NUMBERS)))
    record.namespace, record.publishers = '/judged', {'/judged/odom': {'/judged/turtle_robot'}}
    record.latched = {'/brick_marker': True, '/walls': True}
    say(record, 'robot_description', SimpleNamespace(data=URDF), -0.5)
    show_walls(record, [-0.5])
    show(record, box('brick'), -0.5, '/brick_marker')
    for show_part in parts:
        show_part(record, SimpleNamespace(**{**RIGHT, **off}))
    return record


# -------------------------------------------------------------------------------- its faults

NAMES = {rule.name for rule in referee.RULES}
OF_THE_ROBOT = {rule.name for rule in robot_rules.RULES} - {'frames: brick', 'rate: brick', 'tilt'}
"""All requirements, and those that a robot without a brick can keep."""


def judge(record, *names):
    """Return what some rules find."""
    return Rules(rule for rule in referee.RULES if rule.name in names).judge(record)


def mark(record, name):
    """Return the mark of a rule."""
    return judge(record, name)[0].mark


def shift(record, frame, seconds, way, axis=0):
    """Have a frame be some way (m) off for a moment."""
    for sample in record.frames[frame].between(at(seconds), at(seconds + 0.03)):
        sample.pose.position[axis] += way


def change(record, topic, seconds, field, way):
    """Have a number of the first message on a topic be off that comes after some time (s)."""
    message = record.messages(topic, at(seconds))[0].message
    *parts, last = field.split('.')
    for part in parts:
        message = getattr(message, part)
    setattr(message, last, getattr(message, last) + way)


def edit(record, where, attribute, value):
    """Have something else stand in the URDF."""
    robot = ElementTree.fromstring(URDF)
    robot.find(where).set(attribute, value)
    record.topics['robot_description'].clear()
    say(record, 'robot_description',
        SimpleNamespace(data=ElementTree.tostring(robot, 'unicode')), -0.5)


def urdf(rule, where, attribute, *values):
    """Return a row for a part of the URDF with values that break a rule."""
    return rule, lambda record, value: edit(record, where, attribute, value), (), values


def spin(record, part):
    """Have a part of the velocity of the wheel be published."""
    for heard in record.topics['joint_states']:
        heard.message.velocity[1] *= part


def answer(record, seconds, unseen=0):
    """Have a drop answered some time (s) after the fall, whose first steps may not be seen."""
    record.drops[0].ask = Request(at(2.45), at(2.5 + seconds), None)
    samples = record.frames['brick'].samples
    first = next(n for n, sample in enumerate(samples) if sample.stamp > at(2.5))
    del samples[first:first + unseen]


def stir(record, down):
    """Have a brick move a little (m) before its drop is answered."""
    answer(record, -0.002)
    shift(record, 'brick', 2.494, -down, 2)
    record.drops[0].released = at(2.488)


def publish_walls(record, times):
    """Have the walls not be latched, and published at some times (s) only."""
    record.latched['/walls'] = False
    record.markers = [heard for heard in record.markers if heard.topic != '/walls']
    show_walls(record, times)


def write(record, seconds, text='Unreachable', kind=Marker.TEXT_VIEW_FACING, again=()):
    """Have a text shown for some time (s), and again later."""
    first = next(heard for heard in record.markers if heard.topic == '/text')
    marker = first.marker
    marker.text, marker.type = text, kind
    marker.lifetime.sec, marker.lifetime.nanosec = divmod(round(seconds * 1e9), NS_PER_SECOND)
    record.markers += [first._replace(published=first.published + round(later * NS_PER_SECOND))
                       for later in again]


def remove_text(record, seconds, action):
    """Have a text that stays be removed after some time (s)."""
    write(record, 0.0)
    show(record, Marker(action=action), 2.65 + seconds, '/text')


def change_ask(record, name, **changes):
    """Have a service asked for, or answered, in another way."""
    asks = getattr(record, name)
    asks[0] = asks[0]._replace(**changes)


def silence(record, _):
    """Have nobody say that a brick is out of reach."""
    record.drops[0].refusals.clear()
    record.markers = [heard for heard in record.markers if heard.topic != '/text']


FAULTS = (
    ('frames: odom', lambda record, dx: record.frames['odom'].add(at(0.5), 1, Sample(
        at(0.5), 'world', pose((CENTER[0] + dx, CENTER[1], 0.0)))), (0.0,), (0.02,)),
    ('frames: base_link', lambda record, dy: change(record, 'pose', LEG - 0.02, 'y', dy),
     (0.005,), (0.02,)),
    ('frames: robot', lambda record, name: record.frames.pop(name), (), ('eyes',)),
    ('rate: base_link', lambda record, lost: record.frames['base_link'].samples.__delitem__(
        slice(0, 40, lost)), (), (10,)),
    ('frames: brick', lambda record, parent: say_frame(
        record, 'brick', parent, [(9.0, pose(FAR))]), (), ('sky',)),
    ('frames: broadcasters', lambda record, numbers: setattr(
        record.frames['base_link'], 'numbers', numbers), ([0, 1, 2, 3],), ([7, 0] * 4,)),
    ('names: relative', lambda record, node: record.publishers.update({'/walls': {node}}),
     ('/elsewhere/arena',), ('/judged/arena',)),
    ('odom: twist', lambda record, speed: [change(
        record, 'odom', number / 100.0, 'twist.twist.linear.x', speed) for number in range(50)],
     (), (0.1,)),
    ('joint_states: names', lambda record, name: setattr(
        record.topics['joint_states'][5].message, 'name', [name]),
     ('wheel_joint',), ('antenna_joint',)),
    ('joint_states: velocity', spin, (0.92, 1.08), (0.88, 1.15)),
    ('joint_states: velocity', lambda record, speed: setattr(
        record.topics['joint_states'][5].message, 'velocity', [speed, 0.0, 0.0]), (), (-0.1,)),
    ('drive: rolling', 'slip', (0.98,), (0.973, 1.027)),
    ('drive: stem', 'crooked', (radians(4.0),), (radians(-6.0),)),
    ('drive: straight', lambda record, dy: change(record, 'pose', 0.2, 'y', dy),
     (0.04,), (0.08, -0.08)),
    ('drive: overshoot', lambda record, dx: change(record, 'pose', 0.55, 'x', dx),
     (0.04,), (0.08,)),
    ('drive: goal', lambda record, dx: change_ask(
        record, 'drives', goal=(CENTER[0] + 1.2 + dx, CENTER[1] + 0.9)), (0.04,), (0.06,)),
    ('drive: speed', lambda record, dy: change(record, 'cmd_vel', 0.2, 'linear.y', dy),
     (), (0.3,)),
    urdf('URDF: base_link', "link[@name='base_link']/visual/geometry/box", 'size', '0.3 0.3 0.27'),
    urdf('URDF: platform', "link[@name='platform']/visual/origin", 'rpy', '0.05 0 0', '0 -0.05 0'),
    urdf('URDF: platform', "joint[@name='eyes_joint']/origin", 'xyz', '0 0 3'),
    urdf('URDF: room to turn', "link[@name='base_link']/visual/origin", 'xyz', '0 0 1.1'),
    urdf('URDF: post', "link[@name='post']/visual/origin", 'xyz', '0.03 0 0'),
    urdf('URDF: stem', "link[@name='stem']/visual/origin", 'xyz', '0 0 0.9'),
    urdf('URDF: stem', "joint[@name='stem_joint']/axis", 'xyz', '0 1 0'),
    urdf('URDF: wheel', "joint[@name='wheel_joint']/parent", 'link', 'base_link'),
    urdf('URDF: wheel', "joint[@name='wheel_joint']/origin", 'rpy', '1.5708 0 0'),
    urdf('URDF: wheel', "link[@name='wheel']/visual/origin", 'rpy', '0 0 0'),
    urdf('URDF: wheel', "joint[@name='wheel_joint']", 'type', 'revolute'),
    urdf('URDF: colors', "link[@name='platform']/visual/material", 'name', 'green'),
    urdf('URDF: numbers', "link[@name='wheel']/visual/geometry/cylinder", 'radius', '0.22'),
    urdf('URDF: numbers', "link[@name='platform']/visual/geometry/cylinder", 'radius', '0.15'),
    urdf('URDF: numbers', "link[@name='platform']/visual/origin", 'xyz', '0 0 0.1'),
    ('place', lambda record, x: change_ask(record, 'places', what=(x, *FAR[1:])),
     (1.508,), (1.52,)),
    ('place', lambda record, answer: change_ask(record, 'places', accepted=answer),
     (True,), (False,)),
    ('drop', lambda record, begin: answer(record, begin), (-0.45,), (-0.55,)),
    ('drop', lambda record, answer: setattr(
        record.drops[0], 'ask', record.drops[0].ask._replace(accepted=answer)), (), (False,)),
    ('drop: answer first', answer, (-0.0005, 0.0035), (0.0045,)),
    ('drop: answer first', partial(answer, unseen=1), (0.0035,), (0.0045,)),
    ('drop: answer first', stir, (), (1e-4,)),
    ('brick: hovers', lambda record, dx: shift(record, 'brick', -0.4, dx), (0.0005,), (0.002,)),
    ('brick: rides', lambda record, dx: shift(record, 'brick', 6.4, dx), (0.15,), (0.3,)),
    ('fall: acceleration', 'gravity', (9.63, 9.99), (9.59, 10.03, 15.0)),
    ('fall: acceleration', 'step', (0.002, 0.02), ()),
    ('fall: course', 'aside', (0.002,), (0.05,)),
    ('fall: course', lambda record, dz: shift(record, 'brick', 3.2, dz, 2), (0.015,), (0.03,)),
    ('fall: ground', 'below', (0.0,), (-0.06, 0.06)),
    ('fall: platform', 'above', (0.0,), (-0.06, 0.06)),
    ('brick: angle', 'lean', (0.018, -0.018), (0.022,)),
    ('slide: law', 'pull', (1.0,), (0.8, 1.15, 1e-6)),
    ('slide: end', 'stop', (), (NUMBERS['platform_radius'], NUMBERS['platform_radius'] + LENGTH)),
    ('brick: floats', 'drift', (0.002,), (0.006,)),
    ('again', lambda record, never: setattr(record.drops[1], 'leveled', never), (), (None,)),
    ('carry', lambda record, dx: setattr(
        record.drops[1], 'carried_to', (CENTER[0] + dx, CENTER[1])), (0.08,), (0.12,)),
    ('walls: to be seen', publish_walls, (range(-1, 12),), ((0.0,), (0.0, 0.1))),
    ('brick marker: to be seen', lambda record, latched: record.latched.update(
        {'/brick_marker': latched}), (), (False,)),
    ('brick marker: place', lambda record, dx: setattr(
        record.markers[4].marker.pose.position, 'x', dx), (0.005,), (0.02,)),
    ('markers: frames', lambda record, alpha: setattr(
        record.markers[0].marker.color, 'a', alpha), (0.1,), (0.0,)),
    ('verdict: in time', silence, (), (None,)),
    ('text: time', write, (2.71, 3.29), (2.69, 3.31)),
    ('text: time', partial(remove_text, action=Marker.DELETE), (2.71,), (3.31,)),
    ('text: time', partial(remove_text, action=Marker.DELETEALL), (3.29,), (2.69,)),
    # One that is repeated lasts from the first to the end of the last.
    ('text: time', partial(write, again=(1.0, 2.0)), (1.0,), (3.0,)),
    ('text: kind', lambda record, text: write(record, 3.0, text), (),
     ('unreachable!', 'UNREACHABLE')),
    ('text: kind', lambda record, kind: write(record, 3.0, kind=kind), (), (Marker.ARROW,)))
"""Rules, what is off, or changes what is heard, by how much, and by how much it must not be."""


def test_an_exercise_that_is_right_keeps_every_requirement():
    found = referee.RULES.judge(exercise())
    assert len(found) == 60
    assert [one for one in found if one.mark != KEPT] == []


@pytest.mark.parametrize('rule, off, allowed, broken', FAULTS)
def test_what_is_allowed_is_kept_and_of_a_fault_all_else_follows(rule, off, allowed, broken):
    # A robot that only waits for bricks need not say much.
    parts, others, rate = ((drive,), OF_THE_ROBOT, 100.0) if rule in OF_THE_ROBOT else (
        PARTS, NAMES - OF_THE_ROBOT, 10.0)
    for value in (*allowed, *broken):
        if isinstance(off, str):
            record = exercise(parts, **{'rate': rate, off: value})
        else:
            record = exercise(parts, rate=rate)
            off(record, value)
        if value in allowed:
            assert mark(record, rule) == KEPT, value
        else:
            found = [one for one in judge(record, *others) if one.mark == BROKEN]
            assert [one.name for one in found if not one.follows] == [rule], value


@pytest.mark.parametrize('rate, kept', (
    (97.7, False), (98.3, True), (101.7, True), (102.3, False)))
def test_rates_go_by_stamps(rate, kept):
    """However late a stamped message is published, its stamp counts."""
    names = {f'rate: {name}' for name in ('cmd_vel', 'odom', 'joint_states', 'base_link')}
    found = judge(exercise((drive,), rate=rate), *names)
    assert {one.name for one in found if one.mark == BROKEN} == (set() if kept else names)


def test_times_are_those_of_the_closed_form():
    fall, slide = exercise().drops
    acceleration = NUMBERS['gravity_accel']
    assert (fall.down - fall.released) * SECONDS_PER_NS == pytest.approx(
        sqrt(2.0 * (FAR[2] - HEIGHT / 2.0) / acceleration), abs=0.01)
    assert (slide.floated - slide.tilted) * SECONDS_PER_NS == pytest.approx(
        sqrt(2.0 * (RIGHT['stop'] - ASIDE) / (acceleration * sin(LEANING))), abs=0.05)


# ------------------------------------------------------------------------------ a busy machine

def test_what_is_broken_while_the_machine_has_time_is_broken():
    record = exercise((drive,))
    change_ask(record, 'drives', goal=CENTER, start=(0.0, 0.0))
    # A stall may be seen a second after it; of the second drive alone nothing is off.
    for begin, due in ((-3.0, BROKEN), (-0.9, OPEN), (0.2, OPEN), (1.5, BROKEN)):
        record.stalls = [(at(begin), at(begin + 0.1))]
        found, = judge(record, 'drive: goal')
        assert found.mark == due
        assert ('the machine stood still in' in found.measured) == (due == OPEN)


def test_nothing_is_broken_that_was_seen_in_a_stall_alone():
    record = exercise(rate=10.0, gravity=15.0, slip=2.0, drift=1.0)
    silence(record, None)
    record.stalls = [(at(-1.0), at(10.0))]
    broken = {one.name for one in referee.RULES.judge(record) if one.mark == BROKEN}
    assert broken == set()


# ------------------------------------------------------------------------------- odd records

def test_who_publishes_no_velocity_is_not_judged_by_it():
    record = exercise()
    for heard in record.topics['joint_states']:
        del heard.message.velocity[:]
    assert mark(record, 'joint_states: velocity') == OPEN


def test_rules_rest_on_rules_and_none_on_itself():
    for name in NAMES:
        assert referee.RULES.above(name) <= NAMES - {name}


def test_what_is_not_there_is_missed_by_many_and_told_by_one():
    record = exercise()
    record.topics['robot_description'].clear()
    found = [one for one in referee.RULES.judge(record) if one.mark == BROKEN]
    assert {one.measured for one in found} == {'there is no robot_description'}
    assert [one.follows for one in found] == [[], *[['frames: robot']] * (len(found) - 1)]


def test_a_frame_is_known_between_its_transforms_that_are_close():
    record = Record(Profile())
    for seconds, parent in ((0.0, 'world'), (0.1, 'world'), (0.3, 'world'), (0.4, 'platform')):
        say_frame(record, 'brick', parent, [(seconds, pose((seconds, 0.0, 0.0)))])
    frame = record.frames['brick']
    assert frame.at(at(0.05)).pose.position[0] == pytest.approx(0.05)
    assert frame.at(at(0.2)) is None
    assert frame.at(at(0.35)) == frame.samples[2]
    assert frame.at(at(0.44)) == frame.samples[-1]
    assert frame.at(at(0.46)) is None


def test_nothing_heard_is_judged():
    assert {one.mark for one in referee.RULES.judge(Record(Profile()))} == {BROKEN, OPEN}


@pytest.mark.filterwarnings('ignore:invalid value')
@pytest.mark.parametrize('odd', (nan, inf, 0.0))
def test_whatever_is_heard_is_judged(odd):
    """Numbers that make no sense keep nobody from judging, and are not what is demanded."""
    record = exercise()
    for frame in record.frames.values():
        for sample in frame.samples:
            sample.pose.position[:] = odd
            sample.pose.axes[:] = odd
    for heard in record.topics['pose']:
        heard.message.x = odd
    for heard in record.markers:
        heard.marker.pose.position.x = heard.marker.scale.x = odd
    found = {one.name: one.mark for one in referee.RULES.judge(record)}
    assert len(found) == len(referee.RULES)
    assert KEPT not in {found[name] for name in ('walls: size', 'drive: goal', 'odom: pose',
                                                 'slide: law', 'place')}
