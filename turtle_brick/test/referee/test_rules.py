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

"""The referee's rules on records that are made up. No graph."""

from copy import copy
from functools import partial
from math import cos, hypot, inf, nan, pi, radians, sin, sqrt
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

from geometry_msgs.msg import PoseStamped, Twist
from hypothesis import given, settings
from hypothesis.strategies import floats, lists, sampled_from
from mutants import MUTANTS
from nav_msgs.msg import Odometry
import numpy
import pytest
from sensor_msgs.msg import JointState
from turtle_brick.core.parameters import default_path, load
from turtle_referee import referee
from turtle_referee.constants import CENTER, NANOSECONDS
from turtle_referee.drops import DropWatch, MOVED
from turtle_referee.geometry import Pose, pose, turn, UPRIGHT
from turtle_referee.names import Profile
from turtle_referee.record import Ask, Drive, Frame, Heard, MarkerHeard, Record, Sample
from turtle_referee.robot_model import RobotModel
from turtle_referee.rules import BROKEN, KEPT, OPEN, Rules
from visualization_msgs.msg import Marker
import xacro

BEGIN = 1_800_000_000 * NANOSECONDS
"""When all of this is said to have happened (ns)."""

URDF = Path(__file__).parents[2] / 'urdf' / 'turtle.urdf.xacro'

PARAMETERS = load()
NUMBERS = Profile.from_parameters(PARAMETERS).numbers
LENGTH, WIDTH, HEIGHT = PARAMETERS.brick_size
REST = PARAMETERS.platform_height + HEIGHT / 2.0
"""Height (m) of the center of a brick on the platform."""

HINGE = PARAMETERS.platform_height - PARAMETERS.platform_thickness
PLACE = (5.5, 5.5, 8.0)

KEPT_OR_BROKEN = {True: KEPT, False: BROKEN}


def at(seconds):
    """Return the instant (ns) that is some time (s) after the beginning."""
    return BEGIN + round(seconds * NANOSECONDS)


def new_record(**numbers):
    """Return a record with the numbers of the robot and nothing heard."""
    return Record(Profile(numbers={**NUMBERS, **numbers}))


def say_frame(record, child, parent, track, static=False):
    """Have a frame broadcast: (time in s, Pose) each."""
    frame = record.frames.setdefault(child, Frame(static))
    for number, (seconds, there) in enumerate(track, len(frame.samples)):
        frame.add(at(seconds), number, Sample(at(seconds), parent, there))


def stamped(message, seconds):
    """Return a message that was published when its stamp says."""
    stamp = message.header.stamp
    stamp.sec, stamp.nanosec = divmod(at(seconds), NANOSECONDS)
    return Heard(at(seconds), message)


def upright(x, y, z):
    """Return the pose of something that stands upright."""
    return pose((x, y, z))


def pitch(angle):
    """Return the axes of what is turned about y."""
    return turn(UPRIGHT[1], angle)


def show(record, marker, seconds, topic='/marker'):
    """Have a marker published."""
    record.markers.append(MarkerHeard(at(seconds), topic, marker))


def brick_marker():
    """Return a marker of the brick."""
    marker = Marker(type=Marker.CUBE)
    marker.header.frame_id = 'brick'
    marker.scale.x, marker.scale.y, marker.scale.z = LENGTH, WIDTH, HEIGHT
    marker.color.a = 1.0
    return marker


def judge(record, names):
    """Return what some rules find."""
    return Rules(rule for rule in referee.RULES if rule.name in names).judge(record)


def find(name, record):
    """Return what one rule finds."""
    return judge(record, {name})[0]


def marks(record, names):
    """Return which of some rules are not kept."""
    return {one.name for one in judge(record, names) if one.mark != KEPT}


# ------------------------------------------------------------------------------------------ rates

RATES = {'rate: base_link', 'rate: odom'}


@pytest.mark.parametrize('rate, kept', (
    (97.7, False), (98.3, True), (101.7, True), (102.3, False)))
def test_rates_go_by_stamps(rate, kept):
    """However late a stamped message is published, its stamp counts."""
    record = new_record()
    record.idle = [(at(0.0), at(2.0))]
    record.drives = [Drive(at(2.0), at(5.0), (0.0, 0.0), (1.0, 0.0))]
    for number in range(int(5.0 * rate)):
        say_frame(record, 'base_link', 'odom', [(number / rate, upright(0.0, 0.0, 0.0))])
        # In order, as DDS has it: whoever waits holds up those behind.
        late = 0.5 / rate if number % 100 == 99 else 0.0
        heard = stamped(Odometry(), number / rate)
        record.topics['odom'].append(heard._replace(published=at(number / rate + late)))
    assert marks(record, RATES) == (set() if kept else RATES)


def test_who_is_not_driven_has_its_rate_at_rest():
    record = new_record()
    record.idle = [(at(0.0), at(3.0))]
    say_frame(record, 'brick', 'world', (
        (number / 250.0, upright(*PLACE)) for number in range(750)))
    assert find('rate: brick', record).mark == KEPT


@pytest.mark.parametrize('stalls, full, marks', (
    ([(3.0, 3.1)], [], (BROKEN, BROKEN)),
    ([(1.0, 1.1)], [], (OPEN, OPEN)),
    ([], [(0.0, 3.0)], (BROKEN, OPEN)),
    ([], [(0.0, 1.5)], (BROKEN, BROKEN))))
@pytest.mark.parametrize('times', (
    [number / 100.0 for number in range(280) if number % 6],
    [number / 81.0 + 0.002 * (number % 2) for number in range(230)]), ids=('lost', 'uneven'))
def test_a_machine_without_time_breaks_no_rate(times, stalls, full, marks):
    """A node that pauses, from 2 s to 2.1 s, is excused while no processor is to spare."""
    for pause, mark in zip((0.0, 0.1), marks):
        record = new_record()
        record.idle = [(at(0.0), at(3.0))]
        say_frame(record, 'base_link', 'odom', (
            (seconds + pause * (seconds > 2.0), upright(0.0, 0.0, 0.0)) for seconds in times))
        say_frame(record, 'brick', 'world', (
            (number / 125.0 + pause * (number > 250), upright(*PLACE)) for number in range(350)))
        record.stalls, record.full = (
            [(at(begin), at(end)) for begin, end in spans] for spans in (stalls, full))
        assert find('rate: brick', record).mark == BROKEN  # Its usual interval is twice as long.
        judgement = find('rate: base_link', record)
        assert judgement.mark == mark
        assert ('stood still in 1 of 1 trial' in judgement.measured) == (mark == OPEN)


def test_what_is_broken_also_while_the_machine_has_time_is_broken():
    record = new_record()
    say_frame(record, 'base_link', 'odom', [(0.0, upright(0.0, 0.0, 0.0))])
    for begin, off in ((0.0, 0.2), (1.0, 0.0)):
        record.drives.append(Drive(at(begin), at(begin + 0.9), (0.0, 0.0), (1.0, 0.0)))
        record.topics['pose'].append(Heard(at(begin + 0.5), SimpleNamespace(x=1.0 - off, y=0.0)))
    assert find('drive: goal', record).mark == BROKEN
    record.stalls = [(at(0.2), at(0.4))]
    assert find('drive: goal', record).mark == OPEN
    record.stalls = [(at(1.2), at(1.4))]
    assert find('drive: goal', record).mark == BROKEN


# ---------------------------------------------------------------------------------- the robot

@pytest.fixture(scope='module')
def description():
    """Return the URDF of the robot."""
    return xacro.process_file(str(URDF), mappings={'params_file': str(default_path())}).toxml()


def describe(record, description):
    """Have the robot described."""
    record.topics['robot_description'] = [Heard(at(0.0), SimpleNamespace(data=description))]


URDF_FAULTS = {
    'URDF: base_link': [("link[@name='base_link']/visual/geometry/box", 'size', '0.3 0.3 0.27')],
    'URDF: platform': [("link[@name='platform']/visual/origin", 'rpy', '0.05 0 0'),
                       ("link[@name='platform']/visual/origin", 'rpy', '0 -0.05 0')],
    'URDF: room to turn': [("link[@name='base_link']/visual/origin", 'xyz', '0 0 1.1')],
    'URDF: post': [("link[@name='post']/visual/origin", 'xyz', '0.03 0 0')],
    'URDF: stem': [("link[@name='stem']/visual/origin", 'xyz', '0 0 0.9')],
    'URDF: wheel': [("link[@name='wheel']/visual/origin", 'rpy', '0 0 0'),
                    ("joint[@name='wheel_joint']", 'type', 'revolute')],
    'URDF: colors': [("link[@name='platform']/visual/material", 'name', 'green')],
    'URDF: numbers': [("link[@name='wheel']/visual/geometry/cylinder", 'radius', '0.22'),
                      ("link[@name='platform']/visual/geometry/cylinder", 'radius', '0.15'),
                      ("link[@name='platform']/visual/origin", 'xyz', '0 0 0.1')],
}


@pytest.mark.parametrize('rule, path, attribute, value', [
    (rule, *edit) for rule, edits in URDF_FAULTS.items() for edit in edits])
def test_faults_of_the_urdf_are_found(description, rule, path, attribute, value):
    robot = ElementTree.fromstring(description)
    robot.find(path).set(attribute, value)
    for text, broken in ((description, set()), (ElementTree.tostring(robot, 'unicode'), {rule})):
        record = new_record()
        describe(record, text)
        assert marks(record, URDF_FAULTS) == broken


def drive(record, slip=1.0, crooked=0.0, count=8):
    """Have the robot rest for a second and drive some legs of 1.5 m, and say what it does."""
    record.idle = [(at(-1.0), at(0.0))]
    say_frame(record, 'odom', 'world', [(-1.0, upright(*CENTER, 0.0))], static=True)
    x = y = angle = 0.0
    for leg in range(-1, count):
        length = 1.5 * (leg >= 0)
        heading, begin = leg * 2.0 * pi / count, leg * 1.0
        goal = x + length * cos(heading), y + length * sin(heading)
        if leg >= 0:
            record.drives.append(Drive(at(begin), at(begin + 0.99), (x + CENTER[0], y + CENTER[1]),
                                       (goal[0] + CENTER[0], goal[1] + CENTER[1])))
        for step in range(100):
            way, seconds = min(step * 0.03, length), begin + step * 0.01
            here = upright(x + way * cos(heading), y + way * sin(heading), 0.0)
            odometry, twist = Odometry(child_frame_id='base_link'), Twist()
            odometry.header.frame_id = 'odom'
            for message in (odometry.twist.twist, twist):
                message.linear.x, message.linear.y = (
                    (3.0 * cos(heading), 3.0 * sin(heading)) if way < length else (0.0, 0.0))
            odometry.pose.pose.position.x, odometry.pose.pose.position.y = here.position[:2]
            joints = JointState(name=['stem_joint', 'wheel_joint', 'platform_joint'], position=[
                heading + crooked, (angle + way * slip) / NUMBERS['wheel_radius'], 0.0],
                velocity=[0.0, hypot(twist.linear.x, twist.linear.y) * slip
                          / NUMBERS['wheel_radius'], 0.0])
            say_frame(record, 'base_link', 'odom', [(seconds, here)])
            record.topics['joint_states'].append(stamped(joints, seconds))
            record.topics['odom'].append(stamped(odometry, seconds))
            record.topics['cmd_vel'].append(Heard(at(seconds), twist))
            record.topics['pose'].append(Heard(at(seconds), SimpleNamespace(
                x=here.position[0] + CENTER[0], y=here.position[1] + CENTER[1])))
        (x, y), angle = goal, angle + length * slip


def shift(sample, dx):
    """Return a transform that is some way (m) to the side."""
    return sample._replace(pose=sample.pose._replace(position=sample.pose.position + (dx, 0, 0)))


ROBOT_FAULTS = (
    'frames: odom', 'frames: base_link', 'frames: robot', 'frames: broadcasters',
    'names: relative', 'rate: cmd_vel', 'odom: twist', 'joint_states: names',
    'joint_states: velocity', 'joint_states: velocity, at rest', 'drive: stem first',
    'drive: straight', 'drive: overshoot', 'drive: goal', 'drive: speed', '')


def break_robot(record, fault):
    """Have something be heard that breaks one requirement, and no other."""
    poses, commands, joints = ([heard.message for heard in record.topics[name]]
                               for name in ('pose', 'cmd_vel', 'joint_states'))
    match fault:
        case 'frames: odom':
            frame = record.frames['odom']
            frame.add(at(0.5), 1, shift(frame.samples[0], 0.02))
        case 'frames: base_link':
            for message in poses:
                message.y += 0.02
        case 'frames: robot':
            del record.frames['platform']
        case 'frames: broadcasters':
            record.frames['base_link'].numbers[:8] = [7, 0] * 4
        case 'names: relative':
            record.speakers['/walls'] = {'/judged/arena'}
        case 'rate: cmd_vel':
            del record.topics['cmd_vel'][::20]
        case 'odom: twist':
            for heard in record.topics['odom']:
                heard.message.twist.twist = Twist()
        case 'joint_states: names':
            joints[-1].name.append('antenna_joint')
        case 'joint_states: velocity':
            for message in joints:
                message.velocity[1] *= 0.88
        case 'joint_states: velocity, at rest':
            joints[5].velocity[0] = -0.1
        case 'drive: stem first':
            joints[100].position[0] += 0.1
        case 'drive: straight':
            poses[120].y += 0.06
        case 'drive: overshoot':
            poses[170].x += 0.06
        case 'drive: goal':
            first = record.drives[0]
            record.drives[0] = first._replace(goal=(first.goal[0] + 0.08, first.goal[1]))
        case 'drive: speed':
            commands[120].linear.y = 0.3


def rules_of(faults):
    """Return the requirements that faults break."""
    return {fault.partition(',')[0] for fault in faults if fault}


@pytest.mark.parametrize('fault', ROBOT_FAULTS)
def test_faults_of_the_robot_are_found(description, fault):
    """What is broken is found, and nothing else is broken."""
    record = new_record()
    describe(record, description)
    for joint in RobotModel(description, 'platform').joints:
        say_frame(record, joint.child, joint.parent, [(-1.0, joint.origin)])
    drive(record, count=2)
    record.namespace, record.speakers = '/judged', {'/judged/odom': {'/judged/turtle_robot'}}
    break_robot(record, fault)
    assert marks(record, {*rules_of(ROBOT_FAULTS), 'drive: rolling', 'drive: stem', 'odom: pose',
                          'frames: world', 'cmd_vel: at rest', 'rate: base_link'}) == (
        rules_of([fault]))


def test_who_publishes_no_velocity_is_not_judged_by_it(description):
    record = new_record()
    describe(record, description)
    drive(record, count=1)
    for heard in record.topics['joint_states']:
        del heard.message.velocity[:]
    assert find('joint_states: velocity', record).mark == OPEN


# --------------------------------------------------------------------------------- the brick

def fall(record, gravity=9.81, step=0.004, floor=HEIGHT / 2.0, aside=0.0, place=PLACE):
    """Have the brick hover for 0.5 s, fall onto a floor (m) and lie there; return its watch."""
    record.drops = []
    now, track = 0.0, []
    end = 1.0 + sqrt(2.0 * (place[2] - floor) / gravity)
    while now < end:
        time = max(now - 0.5, 0.0)
        z = max(place[2] - gravity * time * time / 2.0, floor)
        track.append((now, upright(place[0] + aside * time, place[1], z)))
        now += step
    say_frame(record, 'brick', 'world', track)
    watch = DropWatch(record, at(0.3), place, record.platform(at(0.3)))
    watch.asked = at(0.45)
    watch.look()
    watch.end = at(end)
    record.drops.append(watch)
    show(record, brick_marker(), 0.0)
    return watch


@settings(max_examples=8, deadline=None)
@given(configured=floats(1.0, 20.0), factor=sampled_from((0.8, 0.978, 0.982, 1.018, 1.022)),
       step=floats(0.002, 0.02))
def test_falls_have_their_acceleration(configured, factor, step):
    record = new_record(gravity_accel=configured)
    watch = fall(record, configured * factor, step)
    judgement = find('fall: acceleration', record)
    assert judgement.mark == KEPT_OR_BROKEN[abs(factor - 1.0) < 0.02], judgement
    assert find('fall: course', record).mark == KEPT
    assert find('fall: ground', record).mark == KEPT
    due = sqrt(2.0 * (PLACE[2] - HEIGHT / 2.0) / (configured * factor))
    # It is seen to fall when it has gone down by MOVED.
    unseen = sqrt(2.0 * MOVED / (configured * factor))
    assert watch.fall_time == pytest.approx(due, abs=unseen + 2.0 * step)
    assert not watch.caught


def test_a_fall_that_the_machine_did_not_disturb_is_judged():
    record = new_record()
    fall(record, gravity=9.0)
    record.stalls = [(at(-0.9), at(-0.8))]
    assert find('fall: acceleration', record).mark == BROKEN
    record.stalls = [(at(0.8), at(0.9))]
    assert find('fall: acceleration', record).mark == OPEN
    record.drops *= 3
    assert find('fall: acceleration', record).mark == BROKEN  # No stall is the same three times.
    record.drops[1] = copy(record.drops[1])
    record.drops[1].place = (*PLACE[:2], PLACE[2] + 0.05)
    assert find('fall: acceleration', record).mark == OPEN


def test_a_brick_that_moves_before_the_answer_has_fallen_too_early():
    record = new_record()
    watch = fall(record)
    watch.ask = Ask(at(0.45), at(0.5025), None)
    assert find('drop: answer first', record).mark == KEPT
    watch.released = at(0.496)
    record.frames['brick'].samples[125].pose.position[2] -= 1e-4
    assert find('drop: answer first', record).mark == BROKEN


def test_a_drop_that_is_refused_is_broken():
    record = new_record()
    fall(record).ask = Ask(at(0.45), at(0.46), None, accepted=False, words='not now')
    assert find('drop', record)[3:5] == (BROKEN, 'not now')


def tip(record, pull=1.0, angle=0.5, stop=None, drift=0.0):
    """
    Have a brick fall on the platform, which is then tilted at once, and slide off.

    It slides with a part of g sin(angle), as far (m) as to a stop, and then drifts (m/s).
    """
    stop = stop if stop is not None else NUMBERS['platform_radius'] + LENGTH / 2.0
    place = (5.5, 5.5, 4.0)
    down = sqrt(2.0 * (4.0 - REST) / 9.81) + 0.5
    ticks = [number * 0.008 for number in range(625)]
    tilted, level = 2.0, 4.0
    slope = [pitch(angle if tilted <= now < level else 0.0) for now in ticks]
    say_frame(record, 'platform', 'world', (
        (now, Pose(numpy.array((5.5, 5.5, HINGE)), axes)) for now, axes in zip(ticks, slope)))
    track = []
    gone = tilted + sqrt(2.0 * stop / (pull * 9.81 * sin(angle)))
    for now, axes in zip(ticks, slope):
        if now < down:
            time = max(now - 0.5, 0.0)
            track.append((now, upright(*place[:2], 4.0 - 9.81 * time * time / 2.0)))
            continue
        time = max(min(now, gone) - tilted, 0.0)
        way = pull * 9.81 * sin(angle) * time * time / 2.0
        there = Pose(numpy.array((5.5, 5.5, HINGE)), pitch(angle) if now >= gone else axes
                     ).transform((way, 0.0, REST - HINGE))
        x, y, z = there
        track.append((now, Pose(numpy.array((x + drift * max(now - gone, 0.0), y, z)), axes)))
    say_frame(record, 'brick', 'world', track)
    show(record, brick_marker(), 0.0)
    watch = DropWatch(record, at(0.3), place, record.platform(at(0.3)))
    watch.asked = at(0.45)
    watch.look()
    watch.end = at(5.0)
    record.drops.append(watch)
    return watch


SLIDING = ('slide: law', 'slide: end', 'brick: floats', 'brick: rides', 'brick: angle', 'tip off',
           'again', 'fall: platform', 'fall: acceleration')


@pytest.mark.parametrize('angle', (0.2, 1.2))
def test_slides_follow_the_closed_form(angle):
    record = new_record()
    watch = tip(record, angle=angle)
    assert watch.caught
    due = sqrt(2.0 * (NUMBERS['platform_radius'] + LENGTH / 2.0) / (9.81 * sin(angle)))
    assert watch.slide_time == pytest.approx(due, abs=0.05)
    assert marks(record, SLIDING) == set()


@pytest.mark.parametrize('gravity, fault, broken', (
    (9.81, {'pull': 0.8}, ['slide: law']),
    (9.81, {'pull': 1.15}, ['slide: law']),
    (9.81, {'pull': 1e-6}, ['slide: law', 'tip off', 'slide: end', 'brick: floats', 'again']),
    (12.0, {}, ['fall: acceleration', 'slide: law']),
    (9.81, {'stop': NUMBERS['platform_radius']}, ['slide: end']),
    (9.81, {'stop': NUMBERS['platform_radius'] + LENGTH}, ['slide: end']),
    (9.81, {'drift': 0.004}, ['brick: floats'])), ids=str)
def test_slides_are_judged(gravity, fault, broken):
    """The cause comes first, and nothing else is one."""
    record = new_record(gravity_accel=gravity)
    tip(record, **fault)
    assert [one.name for one in judge(record, SLIDING) if one.mark != KEPT] == broken
    assert {cause for one in judge(record, SLIDING) for cause in one.follows} <= {broken[0]}


ARENA_FAULTS = (
    'place', 'place, refused', 'drop', 'drop: answer first', 'brick: hovers', 'brick: rides',
    'brick marker: to be seen', 'markers: frames', 'frames: brick', 'again', 'carry', '')


def break_arena(record, fault):
    """Have something be heard that breaks one requirement, and no other."""
    drop, place = record.drops[0], record.places[0]
    samples = record.frames['brick'].samples
    match fault:
        case 'place':
            record.places = [place._replace(what=(5.52, 5.5, 4.0))]
        case 'place, refused':
            record.places = [place._replace(accepted=False)]
        case 'drop':
            drop.ask = Ask(at(-0.2), at(-0.1), None)
        case 'drop: answer first':
            drop.ask = Ask(at(0.45), at(0.51), None)
        case 'brick: hovers':
            samples[5] = shift(samples[5], 0.002)
        case 'brick: rides':
            samples[210:215] = [shift(sample, 0.3) for sample in samples[210:215]]
        case 'brick marker: to be seen':
            record.latched.clear()
        case 'markers: frames':
            record.markers[0].marker.color.a = 0.0
        case 'frames: brick':
            samples[-1] = samples[-1]._replace(parent='sky')
        case 'again':
            drop.leveled = None
        case 'carry':
            drop.carried_to = numpy.array((5.75, 5.5))


@pytest.mark.parametrize('fault', ARENA_FAULTS)
def test_faults_of_the_arena_are_found(fault):
    """What is broken is found, and nothing else is broken."""
    record = new_record()
    watch = tip(record)
    watch.ask = Ask(at(0.45), at(0.46), None)
    record.idle = [(at(0.0), at(0.45))]
    record.places = [Ask(at(0.0), at(0.45), watch.place)]
    record.latched['/marker'] = True
    break_arena(record, fault)
    assert marks(record, {*SLIDING, *rules_of(ARENA_FAULTS), 'brick marker: place'}) == (
        rules_of([fault]))


def turn_brick(record, axes):
    """Turn the brick by what is returned for its axes."""
    frame = record.frames['brick']
    frame.samples = [one._replace(pose=one.pose._replace(axes=axes(one.pose.axes)))
                     for one in frame.samples]


def test_the_brick_has_the_angle_of_the_platform_on_the_ground_too():
    record = new_record()
    fall(record)
    say_frame(record, 'platform', 'world', [
        (tenths / 10.0, Pose(numpy.array((2.0, 2.0, HINGE)), pitch(0.3))) for tenths in range(30)])
    assert find('brick: angle', record).mark == BROKEN
    turn_brick(record, lambda _: pitch(0.3))
    assert find('brick: angle', record).mark == KEPT


# ------------------------------------------------------------------------------------- the text

def refuse(record, text='Unreachable', lifetime=0.0, removed=None, kind=Marker.TEXT_VIEW_FACING,
           repeated=(), action=Marker.DELETE):
    """Have a brick fall beside everything, and a text be shown, some time long."""
    watch = fall(record)
    marker = Marker(type=kind, text=text)
    marker.lifetime.sec, marker.lifetime.nanosec = divmod(round(lifetime * 1e9), NANOSECONDS)
    for seconds in (0.6, *repeated):
        show(record, marker, seconds, '/text')
    if removed is not None:
        show(record, Marker(action=action), removed, '/text')
    watch.look()
    watch.should = False
    return watch


def test_silence_is_broken():
    record = new_record()
    fall(record).should = False
    found = {one.name: one.mark for one in referee.RULES.judge(record)}
    assert {name for name in ('verdict: in time', 'verdict: out of reach', 'verdict: kept',
                              'text: kind', 'text: time') if found[name] == BROKEN} == {
        'verdict: in time', 'verdict: out of reach', 'verdict: kept', 'text: kind', 'text: time'}


# ----------------------------------------------------------------------------- what is allowed

def fall_after(record, answer, unseen=0):
    """Have a brick fall from 0.5 s on, and the drop answer; its first steps may not be seen."""
    fall(record).ask = Ask(at(0.45), at(answer), None)
    del record.frames['brick'].samples[126:126 + unseen]


def lift(record, off):
    """Have a brick be above its parabola once."""
    fall(record)
    record.frames['brick'].samples[220].pose.position[2] += off


def lean(record, angle):
    """Have the brick on the platform be inclined by some angle more."""
    tip(record)
    turn_brick(record, lambda axes: axes @ pitch(angle))


BOUNDS = (
    ('drive: rolling', lambda record, slip: drive(record, slip=slip, count=2),
     (0.98,), (0.973, 1.027)),
    ('drive: stem', lambda record, angle: drive(record, crooked=radians(angle), count=2),
     (4.0,), (-6.0,)),
    ('drop: answer first', fall_after, (0.4995, 0.5035), (0.5045,)),
    ('drop: answer first', partial(fall_after, unseen=3), (0.5035,), (0.5045,)),
    ('fall: course', lambda record, aside: fall(record, aside=aside), (0.002,), (0.05,)),
    ('fall: course', lift, (0.015,), (0.03,)),
    ('fall: ground', lambda record, above: fall(record, floor=HEIGHT / 2.0 + above),
     (0.0,), (-0.06, 0.06)),
    ('fall: platform', lambda record, above: setattr(
        fall(record, floor=REST + above), 'caught', True), (0.0,), (-0.06, 0.06)),
    ('brick: angle', lean, (0.018, -0.018), (0.022,)),
    ('text: time', lambda record, length: refuse(record, lifetime=length),
     (2.71, 3.29), (2.69, 3.31)),
    *(('text: time', lambda record, length, action=action: refuse(
        record, removed=0.6 + length, action=action), (2.71, 3.29), (2.69, 3.31))
      for action in (Marker.DELETE, Marker.DELETEALL)),
    # One that is repeated lasts from the first to the end of the last.
    ('text: time', lambda record, length: refuse(record, lifetime=length, repeated=(1.6, 2.6)),
     (1.0,), (3.0,)),
    ('text: kind', lambda record, text: refuse(record, text, 3.0),
     ('Unreachable',), ('unreachable!', 'UNREACHABLE')),
    ('text: kind', lambda record, kind: refuse(record, lifetime=3.0, kind=kind),
     (Marker.TEXT_VIEW_FACING,), (Marker.CUBE,)))
"""Rules, how something is heard that is so much off, what they allow, and what they do not."""


@pytest.mark.parametrize('name, hear, allowed, broken', BOUNDS)
def test_what_is_allowed_is_kept_and_more_is_not(description, name, hear, allowed, broken):
    for values, mark in ((allowed, KEPT), (broken, BROKEN)):
        for value in values:
            record = new_record()
            describe(record, description)
            hear(record, value)
            assert find(name, record).mark == mark, value


# ---------------------------------------------------------------------------------------- markers

@pytest.mark.parametrize('latched, times, seen', (
    (True, (0.0,), True), (False, (0.0,), False), (False, (1.0, 2.0, 3.0, 4.0), True),
    (False, (0.0, 0.1), False)))
def test_walls_last(latched, times, seen):
    """Four walls in one message are no four messages."""
    record = new_record()
    record.idle = [(at(0.0), at(5.0))]
    record.latched['/walls'] = latched
    for seconds in times:
        for x, y, length, width in ((5.5, 0.0, 11.1, 0.1), (5.5, 11.1, 11.1, 0.1),
                                    (0.0, 5.5, 0.1, 11.1), (11.1, 5.5, 0.1, 11.1)):
            marker = Marker(type=Marker.CUBE)
            marker.header.frame_id = 'world'
            marker.pose.position.x, marker.pose.position.y = x, y
            marker.scale.x, marker.scale.y, marker.scale.z = length, width, 0.5
            show(record, marker, seconds, '/walls')
    assert find('walls: size', record).mark == KEPT
    assert find('walls: to be seen', record).mark == KEPT_OR_BROKEN[seen]


# ------------------------------------------------------------------------------ cause and effect

WRONG_GRAVITY = ('fall: acceleration', 'slide: law', 'verdict: in time', 'verdict: out of reach',
                 'verdict: in reach', 'verdict: kept', 'text: kind', 'text: time')
"""What was broken in a graph whose arena had 15 m/s^2."""


@pytest.mark.parametrize('rows', (WRONG_GRAVITY, *(mutant.rows for mutant in MUTANTS)), ids=str)
def test_what_follows_says_so_and_the_cause_does_not(rows):
    assert referee.RULES.causes({row: f'{row} is wrong' for row in rows}) == {
        row: [] if row == rows[0] else [rows[0]] for row in rows}


def test_rules_rest_on_rules_and_none_on_itself():
    names = {rule.name for rule in referee.RULES}
    assert len(names) == len(referee.RULES) == 60
    for name in names:
        assert referee.RULES.above(name) <= names - {name}


def test_what_is_not_there_is_missed_by_many_and_told_by_one():
    record = new_record()
    say_frame(record, 'odom', 'world', [(0.0, upright(*CENTER, 0.0))])
    found = judge(record, {'frames: robot', *URDF_FAULTS})
    assert {one.measured for one in found} == {'there is no robot_description'}
    assert [one.follows for one in found] == [[], *[['frames: robot']] * len(URDF_FAULTS)]


# -------------------------------------------------------------------------------- odd records

def test_a_frame_is_known_between_its_transforms_that_are_close():
    record = new_record()
    for seconds, parent in ((0.0, 'world'), (0.1, 'world'), (0.3, 'world'), (0.4, 'platform')):
        say_frame(record, 'brick', parent, [(seconds, upright(seconds, 0.0, 0.0))])
    frame = record.frames['brick']
    assert frame.at(at(0.05)).pose.position[0] == pytest.approx(0.05)
    assert frame.at(at(0.2)) is None
    assert frame.at(at(0.35)) == frame.samples[2]
    assert frame.at(at(0.44)) == frame.samples[-1]
    assert frame.at(at(0.46)) is None


def test_nothing_heard_is_judged():
    found = referee.RULES.judge(Record(Profile()))
    assert KEPT not in {one.mark for one in found}
    assert BROKEN in {one.mark for one in found}


ODD = sampled_from((nan, inf, -inf, 0.0, 1e300, -1.0))


@settings(max_examples=10, deadline=None)
@given(values=lists(ODD, min_size=40, max_size=40))
def test_whatever_is_heard_is_judged(values):
    """Numbers that make no sense keep nobody from judging, and their frames keep no law."""
    record = new_record()
    value = iter(values * 10)

    def odd():
        return pose([next(value) for _ in range(3)], [next(value) for _ in range(4)])

    for child, parent in (('odom', 'world'), ('base_link', 'odom'), ('platform', 'base_link'),
                          ('brick', 'world'), ('loop', 'loop')):
        say_frame(record, child, parent, ((second * 0.1, odd()) for second in range(5)))
    record.idle = [(at(0.0), at(1.0))]
    record.drives = [Drive(at(0.0), at(1.0), (0.0, 0.0), (next(value), 1.0))]
    there = SimpleNamespace(x=next(value), y=next(value))
    record.topics['pose'] = [Heard(at(0.1), there), Heard(at(0.9), there)]
    record.topics['robot_description'] = [Heard(at(0.1), SimpleNamespace(data='<robot/>'))]
    record.topics['goal_pose'] = [Heard(at(0.1), PoseStamped())]
    marker = brick_marker()
    marker.pose.position.x, marker.scale.x, marker.text = next(value), next(value), 'Unreachable'
    show(record, marker, 0.1)
    watch = DropWatch(record, at(0.0), PLACE, None)
    watch.asked = at(0.0)
    watch.look()
    record.drops = [watch]
    watch.end = at(1.0)
    assert len(referee.RULES.judge(record)) == len(referee.RULES)
