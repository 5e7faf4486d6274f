# SPDX-License-Identifier: Apache-2.0
"""Test each rule of the referee with correct and faulty simulated records."""

from copy import deepcopy
from functools import cache, partial
from itertools import pairwise
from math import atan2, cos, inf, nan, pi, radians, remainder, sin, sqrt
from pathlib import Path
import pickle
from types import SimpleNamespace
from xml.etree import ElementTree

from broken_graphs import all_dependencies
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, TransformStamped, Twist
from nav_msgs.msg import Odometry
import numpy
import pytest
from sensor_msgs.msg import JointState
from turtle_brick.core.parameters import default_path, load
from turtle_brick_tools.demo import forget_old_messages, KEPT_MESSAGES
from turtle_graph.client.drops import DropWatch
from turtle_graph.client.geometry import CENTER, IDENTITY, multiply, ORIGIN, Pose, turn, Y, Z
from turtle_graph.client.launch_errors import explain_missing
from turtle_graph.client.load import Window
from turtle_graph.client.messages import NS_PER_SECOND, SECONDS_PER_NS
from turtle_graph.client.profiles import Profile
from turtle_graph.client.record import (Drive, Frame, Received, ReceivedMarker, Record, Request,
                                        Sample)
from turtle_graph.client.storage import load as load_record, save
from turtle_graph.referee import referee
from turtle_graph.referee.rules import robot_rules
from turtle_graph.referee.rules.catcher_rules import is_text_visible
from turtle_graph.referee.rules.robot_model import model
from turtle_graph.referee.rules.rule import BEFORE_NS, FAILED, Finding, MET, OPEN, Rules
from visualization_msgs.msg import Marker
import xacro

BEGIN = 1_800_000_000 * NS_PER_SECOND
"""Time (ns) that corresponds to 0 s in all simulated records."""

PARAMETERS = load()
NUMBERS = Profile.from_parameters(PARAMETERS).numbers
LENGTH, WIDTH, HEIGHT = PARAMETERS.brick_size
REST = PARAMETERS.platform_height + HEIGHT / 2.0
"""Height (m) of the center of a brick on the platform."""

HINGE = PARAMETERS.platform_height - PARAMETERS.platform_thickness
SPEED = 3.0
"""Speed (m/s) of the robot."""

DIRECTION = numpy.array((0.8, 0.6))
"""Unit vector in the robot's initial driving direction."""

LEG = 0.7
"""Duration (s) of each 1.5 m drive, including the pause at its end."""

URDF = xacro.process_file(str(Path(__file__).parents[4] / 'urdf/turtle.urdf.xacro'),
                          mappings={'params_file': str(default_path())}).toxml()

OFFSET = 0.1
"""Distance (m) from the platform center to the brick's landing point, in the sliding direction."""

FAR, CLOSE = (1.5, 1.5, 8.0), (CENTER[0] + OFFSET, CENTER[1], 4.0)
"""Starting positions (m) of a brick beside the robot and of a brick above its platform."""

ANGLE, TILT, LEVEL = 0.5, 6.7, 7.9
"""Tilt angle (rad) of the platform, and the times (s) at which it is tilted and leveled."""


def at(seconds):
    """Convert a time (s) after BEGIN to an absolute time (ns)."""
    return BEGIN + round(seconds * NS_PER_SECOND)


def add_transforms(record, child, parent, track, static=False):
    frame = record.frames.setdefault(child, Frame(static))
    for number, (seconds, there) in enumerate(track, len(frame.samples)):
        frame.add(at(seconds), number, Sample(at(seconds), parent, there))


def add_message(record, topic, message, seconds, late=0.0):
    """Add a message with the given timestamp (s) and publication delay (s) to a record."""
    if hasattr(message, 'header'):
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(at(seconds), NS_PER_SECOND)
    record.topics[topic].append(Received(at(seconds + late), message))


def add_marker(record, marker, seconds, topic='/marker'):
    marker.id = len(record.markers)
    record.markers.append(ReceivedMarker(at(seconds), topic, marker))


def box(frame, x=0.0, y=0.0, size=(LENGTH, WIDTH, HEIGHT)):
    marker = Marker(type=Marker.CUBE)
    marker.header.frame_id = frame
    marker.pose.position.x, marker.pose.position.y = x, y
    marker.scale.x, marker.scale.y, marker.scale.z = size
    marker.color.a = 1.0
    return marker


def add_walls(record, times):
    for seconds in times:
        for x, y, *size in ((5.5, 0.0, 11.1, 0.1, 0.5), (5.5, 11.1, 11.1, 0.1, 0.5),
                            (0.0, 5.5, 0.1, 11.1, 0.5), (11.1, 5.5, 0.1, 11.1, 0.5)):
            add_marker(record, box('world', x, y, size), seconds, '/walls')


def drive(record, off):
    """Simulate a straight drive that begins at 0 s, and the return to the start."""
    base = HINGE - model(record).pose('platform').position[2]
    stem = model(record).joint('stem')
    for joint in model(record).joints:
        if joint != stem:
            static = joint.child != 'platform'
            track = [(number / 10.0, joint.origin) for number in range(-5, -4 if static else 50)]
            add_transforms(record, joint.child, joint.parent, track, static)
    add_transforms(record, 'odom', 'world', [(-0.5, Pose((*CENTER, 0.0)))], static=True)
    record.idle = [(at(-0.5), at(0.0))]
    for begin, here, there in ((0.0, 0.0, 1.5), (LEG, 1.5, 0.0)):
        start, goal = (tuple(CENTER + way * DIRECTION) for way in (here, there))
        record.drives.append(Drive(at(begin), at(begin + LEG - 0.01), start, goal))
    for number in range(-int(off.rate / 2.0), int(2.0 * LEG * off.rate)):
        seconds, late = number / off.rate, 0.5 / off.rate * (number % 100 == 49)
        back = seconds >= LEG
        way = min(max(seconds - LEG * back, 0.0) * SPEED, 1.5)
        speed = (-SPEED if back else SPEED) if 0.0 < way < 1.5 else 0.0
        x, y = (1.5 - way if back else way) * DIRECTION
        angle_per_meter = off.slip / NUMBERS['wheel_radius']
        odometry, twist = Odometry(child_frame_id='base_link'), Twist()
        odometry.header.frame_id = 'odom'
        odometry.pose.pose.position.x, odometry.pose.pose.position.y = x, y
        for one in (odometry.twist.twist, twist):
            one.linear.x, one.linear.y = speed * DIRECTION
        angle = atan2(*DIRECTION[::-1]) + pi * back + off.crooked
        add_transforms(record, 'base_link', 'odom', [(seconds, Pose((x, y, base)))])
        add_transforms(record, 'stem', 'base_link', [
            (seconds, Pose(stem.origin.position, turn(Z, angle)))])
        add_message(record, 'odom', odometry, seconds, late)
        add_message(record, 'cmd_vel', twist, seconds)
        add_message(record, 'joint_states', JointState(
            name=['stem_joint', 'wheel_joint', 'platform_joint'],
            position=[angle, (way + 1.5 * back) * angle_per_meter, 0.0],
            velocity=[0.0, abs(speed) * angle_per_meter, 0.0]), seconds)
        add_message(record, 'pose', SimpleNamespace(x=CENTER[0] + x, y=CENTER[1] + y), seconds)
    add_transforms(record, 'base_link', 'odom', [
        (2.0 * LEG + number / 10.0, Pose((0.0, 0.0, base))) for number in range(72)])


def drop(record, requested, place, track):
    """Add a drop to a record. `track` contains times (s) and poses of the brick."""
    watch = DropWatch(record, at(requested - 0.1), place)
    watch.requested = at(requested)
    watch.request = Request(at(requested), at(requested + 0.01), None)
    add_transforms(record, 'brick', 'world', track)
    if place == FAR:
        text = Marker(type=Marker.TEXT_VIEW_FACING, text='Unreachable')
        text.header.frame_id, text.lifetime.sec = 'world', 3
        text.scale.z = text.color.a = 1.0
        add_marker(record, text, requested + 0.2, '/text')
    watch.update()
    watch.end, watch.should_be_caught = at(track[-1][0]), place == CLOSE
    record.drops.append(watch)


def fall(record, off):
    """Simulate a brick that hovers until 2.5 s and then falls beside the platform."""
    add_transforms(record, 'brick', 'world', (
        (now, Pose(FAR)) for now in numpy.arange(-0.5, 2.44, 0.4 / off.rate)))
    record.places.append(Request(at(2.0), at(2.44), FAR))
    track = []
    for now in numpy.arange(2.44, 4.2, off.step):
        time = max(now - 2.5, 0.0)
        depth = off.gravity * time * time / 2.0
        track.append((now, Pose((FAR[0] + off.aside * time, FAR[1],
                                 max(FAR[2] - depth, HEIGHT / 2.0 - off.below)))))
    drop(record, 2.45, FAR, track)


def tip(record, off):
    """Simulate a brick that is released at 5.5 s, caught and then tipped off."""
    joint, level, leaning = model(record).joint('platform'), IDENTITY, turn(Y, ANGLE)
    acceleration = off.pull * off.gravity * sin(ANGLE)
    gone = TILT + sqrt(2.0 * (off.stop - OFFSET) / acceleration)
    track = []
    for now in numpy.arange(5.0, 8.4, 0.02):
        tilted, behind = TILT <= now < LEVEL, now - off.late
        rotation = leaning if TILT <= behind < LEVEL else level
        add_transforms(record, 'platform', joint.parent, [
            (now, joint.origin.compose(Pose(ORIGIN.position, leaning if tilted else level)))])
        add_message(record, 'joint_states', JointState(
            name=['platform_joint'], position=[ANGLE * tilted]), now)
        there = numpy.array(CLOSE) - (0.0, 0.0, off.gravity * max(now - 5.5, 0.0) ** 2 / 2.0)
        if there[2] < REST + off.above:
            way = OFFSET + acceleration * max(min(behind, gone) - TILT, 0.0) ** 2 / 2.0
            hinge = Pose((*CENTER, HINGE), leaning if behind >= gone else rotation)
            there = hinge.transform((way, 0.0, REST + off.above - HINGE))
            if off.kept and rotation == leaning:
                there = numpy.array((CENTER[0] + OFFSET, CENTER[1], REST)) + (
                    way - OFFSET) * numpy.array((cos(ANGLE), 0.0, -sin(ANGLE)))
            there[0] += off.drift * max(behind - gone, 0.0)
        track.append((now, Pose(tuple(there), multiply(rotation, turn(Y, off.lean)))))
    record.tilts = [Request(at(TILT), at(TILT + 0.3), ANGLE),
                    Request(at(LEVEL), at(LEVEL + 0.3), 0.0)]
    record.places.append(Request(at(5.0), at(5.44), CLOSE))
    drop(record, 5.45, CLOSE, track)


CORRECT = {
    'slip': 1.0,  # Factor applied to the wheel rotation.
    'crooked': 0.0,  # Error (rad) added to the stem angle.
    'rate': 100.0,  # Message rate (Hz) of the robot.
    'gravity': NUMBERS['gravity_accel'],
    'step': 0.008,  # Period (s) of the brick transforms.
    'aside': 0.0,  # Sideways speed (m/s) of the falling brick.
    'below': 0.0, 'above': 0.0,  # Height errors (m) of a brick on the ground and on the platform.
    'lean': 0.0,  # Inclination (rad) of the brick.
    'late': 0.0,  # Delay (s) between the motions of the platform and of the brick on it.
    'pull': 1.0,  # Factor applied to the acceleration of the sliding brick.
    'kept': 0.0,  # Whether (1) the brick keeps its place in the world when the platform tilts.
    'stop': NUMBERS['platform_radius'] + LENGTH / 2.0,  # End position (m) of the sliding brick.
    'drift': 0.0}  # Speed (m/s) of the brick after it slides off the platform.
"""Values for a correct record."""

PARTS = (drive, fall, tip)


def make_record(parts=PARTS, **off):
    """Return a record of `parts`. The values in `off` replace those in CORRECT."""
    record = Record(Profile(numbers=dict(NUMBERS)))
    record.namespace, record.publishers = '/judged', {'/judged/odom': {'/judged/turtle_robot'}}
    record.latched = {'/brick_marker': True, '/walls': True}
    add_message(record, 'robot_description', SimpleNamespace(data=URDF), -0.5)
    add_walls(record, [-0.5])
    add_marker(record, box('brick'), -0.5, '/brick_marker')
    for add_part in parts:
        add_part(record, SimpleNamespace(**{**CORRECT, **off}))
    return record


@cache
def saved_record(parts, rate):
    """Return a record as bytes. Loading one takes a third of the time of making one."""
    return pickle.dumps(make_record(parts, rate=rate))


NAMES = {rule.name for rule in referee.RULES}
ROBOT_RULES = {rule.name for rule in robot_rules.RULES} - {'tilt'}
BRICK_RULES = NAMES - ROBOT_RULES - {'rate: brick'}
"""The brick rules are tested at a low message rate, which violates 'rate: brick'."""


def judge(record, *names):
    return Rules(rule for rule in referee.RULES if rule.name in names).judge(record)


def move(frame, pose_of, begin=0, end=inf):
    """Replace the pose of each sample between two times (ns) by the result of `pose_of`."""
    def moved(sample):
        return sample._replace(pose=pose_of(sample)) if begin <= sample.stamp < end else sample

    frame.samples = [moved(sample) for sample in frame.samples]
    frame.published = [(time, moved(sample)) for time, sample in frame.published]


def shifted(pose, way):
    """Return a pose whose position is shifted by a vector (m)."""
    return pose._replace(position=tuple(numpy.add(pose.position, way)))


def shift(record, frame, seconds, way, axis=0):
    """Shift a frame by `way` (m) along an axis for 0.03 s, starting at `seconds`."""
    move(record.frames[frame], lambda sample: shifted(sample.pose, way * numpy.eye(3)[axis]),
         at(seconds), at(seconds + 0.03))


def change(record, topic, seconds, field, way):
    """Add a number to a field of the first message received on a topic after a given time (s)."""
    message = record.messages(topic, at(seconds))[0].message
    *parts, last = field.split('.')
    for part in parts:
        message = getattr(message, part)
    setattr(message, last, getattr(message, last) + way)


def add_description(record, robot):
    """Add a robot_description that contains the URDF of a robot."""
    data = ElementTree.tostring(robot, 'unicode')
    add_message(record, 'robot_description', SimpleNamespace(data=data), -0.4)


def urdf(rule, where, attribute, *values):
    """Return a row of FAULTS that sets an attribute in the URDF to wrong values."""
    def edit(record, value):
        robot = ElementTree.fromstring(URDF)
        robot.find(where).set(attribute, value)
        add_description(record, robot)
    return rule, edit, (), values


def scale_wheel(record, factor, *fields):
    for received in record.topics['joint_states']:
        for field in fields:
            getattr(received.message, field)[1] *= factor


def tilt_in_tf(record, angle):
    """Tilt the platform by 0.3 rad in joint_states and by another angle (rad) in TF."""
    joint = model(record).joint('platform')
    record.tilts.append(Request(at(9.0), at(9.3), 0.3))
    add_transforms(record, 'base_link', 'odom', [(9.2, ORIGIN)])
    # By default, robot_state_publisher publishes every 50 to 60 ms.
    add_transforms(record, 'platform', joint.parent, [
        (now, joint.origin.compose(Pose(ORIGIN.position, turn(Y, tilt))))
        for now, tilt in ((9.18, angle), (9.24, angle), (9.305, 0.0))])
    add_message(record, 'joint_states', JointState(name=[joint.name], position=[0.3]), 9.1)


def move_response(record, seconds, missing=0, accepted=True):
    """Make the drop service respond `seconds` after the release of the brick."""
    record.drops[0].request = Request(at(2.45), at(2.5 + seconds), None, accepted)
    samples = record.frames['brick'].samples
    first = next(n for n, sample in enumerate(samples) if sample.stamp > at(2.5))
    del samples[first:first + missing]


def move_early(record, down):
    """Lower the brick by `down` (m) before the drop service responds."""
    move_response(record, 0.002)
    shift(record, 'brick', 2.494, -down, 2)
    record.drops[0].released = at(2.488)


def publish_walls(record, times):
    record.latched['/walls'] = False
    record.markers = [received for received in record.markers if received.topic != '/walls']
    add_walls(record, times)


def change_text(record, seconds, text='Unreachable', kind=Marker.TEXT_VIEW_FACING, again=()):
    """Change a text marker and its lifetime (s), and publish it again after given delays (s)."""
    first = next(received for received in record.markers if received.topic == '/text')
    marker = first.marker
    marker.text, marker.type = text, kind
    marker.lifetime.sec, marker.lifetime.nanosec = divmod(round(seconds * 1e9), NS_PER_SECOND)
    record.markers += [first._replace(published=first.published + round(later * NS_PER_SECOND))
                       for later in again]


def remove_text(record, seconds, action):
    """Delete the text marker after a given time (s) instead of limiting its lifetime."""
    change_text(record, 0.0)
    add_marker(record, Marker(action=action), 2.65 + seconds, '/text')


def change_request(record, name, **changes):
    requests = getattr(record, name)
    requests[0] = requests[0]._replace(**changes)


def turn_late(record, seconds):
    """Make the robot's stem point in the wrong direction until `seconds` after BEGIN."""
    for received in record.messages('joint_states', at(-0.5), at(seconds)):
        received.message.position[0] += 1.0


def change_verdict(record, refused, number, should_be_caught):
    """Make the catcher accept or refuse a brick 0.2 s after its release."""
    watch = record.drops[number]
    watch.should_be_caught, watch.goal = should_be_caught, at((2.7, 5.7)[number])
    watch.refusals = [watch.goal] if refused else []


def replace_text(record, seconds):
    """Replace the text marker after a given time (s) by one without text."""
    change_text(record, 0.0)
    text = next(received for received in record.markers if received.topic == '/text')
    empty = deepcopy(text.marker)
    empty.text = ''
    record.markers.append(text._replace(
        published=text.published + round(seconds * NS_PER_SECOND), marker=empty))


def remove_verdict(record, _):
    record.drops[0].refusals.clear()
    record.markers = [received for received in record.markers if received.topic != '/text']


def stop_commands(record, end):
    """Publish no commands after a time (s)."""
    record.topics['cmd_vel'] = record.messages('cmd_vel', 0, at(end))


def delay_odometry(record, seconds):
    """Publish each pose on odom `seconds` late."""
    number, received = round(seconds * 100.0), record.topics['odom']
    poses = [one.message.pose for one in received]
    for one, old in zip(received, [*poses[:1] * number, *poses]):
        one.message.pose = old


def turned_marker(kind, x, y, size, axis):
    """Return a marker that becomes a wall of a given size (m) after a quarter turn."""
    marker = box('world', x, y, size)
    marker.type, marker.pose.orientation.w = kind, sqrt(0.5)
    setattr(marker.pose.orientation, axis, sqrt(0.5))
    return marker


def marker_of_points(kind, *points):
    marker = Marker(type=kind, points=[Point(x=x, y=y, z=z) for x, y, z in points])
    marker.header.frame_id = 'world'
    marker.scale.x = marker.color.a = 1.0
    return marker


def box_list(size, *points):
    marker = marker_of_points(Marker.CUBE_LIST, *points)
    marker.scale.x, marker.scale.y, marker.scale.z = size
    return marker


A, B, C, D = ((x, y, 0.0) for x, y in ((0.0, 0.0), (11.1, 0.0), (11.1, 11.1), (0.0, 11.1)))
PIECES = [(x, y, 0.5) for one in numpy.arange(0.5, 11.5)
          for x, y in ((one, 0.0), (one, 11.1), (0.0, one), (11.1, one))]
WALLS = (
    [turned_marker(Marker.CUBE, x, 5.5, (1.0, 4.0, 11.1), 'x') for x in (-0.5, 11.6)]
    + [turned_marker(Marker.CUBE, 5.5, y, (0.2, 11.1, 4.0), 'z') for y in (0.0, 11.1)],
    [turned_marker(Marker.CYLINDER, x, 5.5, (0.2, 0.2, 11.1), 'x') for x in (0.0, 11.1)]
    + [turned_marker(Marker.CYLINDER, 5.5, y, (0.2, 0.2, 11.1), 'y') for y in (0.0, 11.1)],
    [marker_of_points(Marker.LINE_STRIP, A, B, C, D, A)],
    [marker_of_points(Marker.LINE_LIST, A, B, D, C, B, C, A, D)],
    [marker_of_points(Marker.TRIANGLE_LIST, *(
        corner for a, b in pairwise((A, B, C, D, A)) for corner in (a, b, (*b[:2], 1.0))))],
    [box('world', 5.5, 0.0, (11.1, 0.1, 0.5)), box('world', 5.5, 11.1, (11.1, 0.1, 0.5)),
     box('world', 0.0, 5.5, (0.1, 11.1, 0.5)), box('world', 11.1, 5.5, (0.1, 11.1, 0.5)),
     box('world', 5.5, 5.5, (11.1, 11.1, 0.1))],
    [box('world', x, y, (1.0, 0.1, 0.5) if y in (0.0, 11.1) else (0.1, 1.0, 0.5))
     for x, y, _ in PIECES],
    [box('world', x, y, (0.222, 0.222, 0.222)) for way in numpy.linspace(0.11, 10.99, 50)
     for x, y in ((way, 0.0), (way, 11.1), (0.0, way), (11.1, way))],
    [box_list((1.0, 0.1, 0.5), *PIECES[::4], *PIECES[1::4]),
     box_list((0.1, 1.0, 0.5), *PIECES[2::4], *PIECES[3::4])])
"""Markers of walls: boxes, cylinders, lines, triangles, boxes with a floor, and small boxes."""
WALLS[5][-1].pose.position.z = -0.05


def show_walls(record, off, markers):
    """Show other walls on another topic, shifted by `off` (m)."""
    del record.markers[:4]
    record.latched['/boundary'] = True
    for marker in deepcopy(markers):
        marker.pose.position.x += off
        add_marker(record, marker, -0.5, '/boundary')


def add_falls(record, number, speed=0.0, factor=1.0):
    """Add three falls, of which the last `number` have another initial speed (m/s) or gravity."""
    add_transforms(record, 'brick', 'world', [(9.9, Pose(FAR))])
    for index in range(3):
        changed, begin = index >= 3 - number, 10.0 + 2.0 * index
        gravity = NUMBERS['gravity_accel'] * (factor if changed else 1.0)
        drop(record, begin, FAR, [(begin + now, Pose((*FAR[:2], max(
            FAR[2] - speed * changed * now - gravity * now * now / 2.0, HEIGHT / 2.0))))
            for now in numpy.arange(0.0, 1.8, 0.01)])
        record.drops[-1].request = Request(at(begin - 0.01), at(begin - 0.005), None)


def roll_too_far(record, steps):
    """Turn the wheel by some steps of turtlesim too much in each drive."""
    angle = steps * SPEED * 0.016 / NUMBERS['wheel_radius']
    for begin, end, sign in ((0.0, LEG, 1.0), (LEG, 2.0 * LEG, -1.0)):
        for received in record.messages('joint_states', at(begin + 0.3), at(end)):
            received.message.position[1] += sign * angle


def limit_wheel(record, period):
    for received in record.topics['joint_states']:
        received.message.position[1] = remainder(received.message.position[1], period)


def turn_wheel_at_rest(record, angle):
    record.messages('joint_states', at(-0.3))[0].message.position[1] += angle


def turn_stem_in_tf(record, angle):
    move(record.frames['stem'], lambda sample: sample.pose._replace(
        orientation=multiply(turn(Z, angle), sample.pose.orientation)))


def show_wheel(record, shape):
    robot = ElementTree.fromstring(URDF)
    robot.find("link[@name='wheel']/visual/geometry/cylinder").tag = shape
    add_description(record, robot)


def turn_brick_marker(record, axis):
    """Exchange two sides of the marker and turn it, so that it looks as before."""
    marker = record.markers[4].marker
    marker.scale.x, marker.scale.z = marker.scale.z, marker.scale.x
    setattr(marker.pose.orientation, axis, sqrt(0.5))
    marker.pose.orientation.w = sqrt(0.5)


def change_height(record, offset):
    record.profile.numbers['platform_height'] += offset


def delay_tilting_brick(record, samples):
    before, *late = record.frames['brick'].between(at(TILT - 0.02), at(TILT + 0.1))
    move(record.frames['brick'], lambda _: before.pose, late[0].stamp, late[samples - 1].stamp + 1)


def land_late(record, seconds):
    """Let the brick land some time before it is tipped off."""
    record.drops[1].down = at(TILT - seconds)
    move(record.frames['brick'], lambda sample: shifted(sample.pose, (0.0, 0.0, 0.1)),
         end=record.drops[1].down)


def interrupt(record, seconds):
    """End the record some time after the text appears."""
    text = next(received for received in record.markers if received.topic == '/text')
    text.marker.lifetime.sec, text.marker.lifetime.nanosec = 0, 50_000_000
    record.drops[0].end = text.published + round(seconds * NS_PER_SECOND)


def judge_early(record, seconds):
    text = next(received for received in record.markers if received.topic == '/text')
    record.markers.append(text._replace(published=at(seconds)))


FAULTS = (
    ('frames: world', lambda record, parent: add_transforms(
        record, 'lost', parent, [(0.0, Pose(CLOSE))]), ('odom',), ('nowhere',)),
    ('frames: odom', lambda record, dx: record.frames['odom'].add(at(0.5), 1, Sample(
        at(0.5), 'world', Pose((CENTER[0] + dx, CENTER[1], 0.0)))), (0.0,), (0.02,)),
    ('frames: odom', lambda record, dx: shift(record, 'odom', -0.5, dx),
     (0.005,), (0.02, -2.0 * CENTER[0])),
    ('frames: base_link', lambda record, dy: move(
        record.frames['base_link'], lambda sample: shifted(sample.pose, (0.0, dy, 0.0))),
     (0.005,), (0.3,)),
    ('frames: robot', lambda record, name: record.frames.pop(name), (), ('eyes',)),
    ('frames: robot', lambda record, dz: shift(record, 'odom', -0.5, dz, 2),
     (0.005,), (-1.0, 0.2)),
    ('rate: base_link', lambda record, lost: record.frames['base_link'].samples.__delitem__(
        slice(0, 40, lost)), (), (10,)),
    ('frames: brick', lambda record, parent: add_transforms(
        record, 'brick', parent, [(9.0, Pose(FAR))]), (), ('sky',)),
    ('frames: broadcasters', lambda record, numbers: setattr(
        record.frames['base_link'], 'sequence_numbers', numbers), ([0, 1, 2, 3],), ([7, 0] * 4,)),
    ('names: relative', lambda record, node: record.publishers.update({'/walls': {node}}),
     ('/elsewhere/arena', '/judged/rviz2'), ('/judged/arena',)),
    ('names: relative', lambda record, name: record.users.update({name: {'/judged/arena'}}),
     ('/judged/place', '/tf'), ('/place', '/turtle1/pose')),
    ('cmd_vel: at rest', lambda record, speed: change(
        record, 'cmd_vel', -0.3, 'angular.z', speed), (1e-9,), (5e-7, -5e-7)),
    ('odom: twist', lambda record, speed: [change(
        record, 'odom', number / 100.0, 'twist.twist.linear.x', speed) for number in range(50)],
     (), (0.1, -4.8)),
    ('odom: pose', lambda record, z: change(record, 'odom', 0.2, 'pose.pose.orientation.z', z),
     (0.005,), (0.05, -0.05)),
    ('odom: pose', delay_odometry, (0.09,), (0.15,)),
    ('joint_states: names', lambda record, name: setattr(
        record.topics['joint_states'][5].message, 'name', [name]),
     ('wheel_joint',), ('antenna_joint',)),
    ('drive: rolling', 'slip', (0.98,), (0.973, 1.027)),
    ('drive: rolling', lambda record, factor: scale_wheel(record, factor, 'position', 'velocity'),
     (1.0,), (-1.0,)),
    urdf('drive: rolling', "joint[@name='wheel_joint']/axis", 'xyz', '0 -1 0'),
    urdf('drive: stem', "joint[@name='stem_joint']/axis", 'xyz', '0 0 -1'),
    ('drive: stem', 'crooked', (radians(4.0),), (radians(-6.0),)),
    ('drive: stem first', turn_late, (-0.005, 0.005), (0.015,)),
    ('drive: straight', lambda record, dy: change(record, 'pose', 0.2, 'y', dy),
     (0.04,), (0.3, -0.3)),
    ('drive: overshoot', lambda record, dx: change(record, 'pose', 0.55, 'x', dx),
     (0.04,), (0.3,)),
    ('drive: goal', lambda record, dx: change_request(
        record, 'drives', goal=(CENTER[0] + 1.2 + dx, CENTER[1] + 0.9)), (0.04,), (0.22,)),
    ('drive: speed', lambda record, dy: change(record, 'cmd_vel', 0.2, 'linear.y', dy),
     (), (0.3,)),
    urdf('URDF: base_link', "link[@name='base_link']/visual/geometry/box", 'size', '0.3 0.3 0.27'),
    urdf('URDF: platform', "link[@name='platform']/visual/origin", 'rpy', '0.05 0 0', '0 -0.05 0'),
    urdf('URDF: platform', "joint[@name='eyes_joint']/origin", 'xyz', '0 0 3'),
    urdf('URDF: room to turn', "link[@name='base_link']/visual/origin", 'xyz', '0 0 1.1'),
    urdf('URDF: platform', "joint[@name='platform_joint']/axis", 'xyz', '0 0 1'),
    urdf('URDF: post', "link[@name='post']/visual/origin", 'xyz', '0.03 0 0', '0 0 -0.8'),
    urdf('URDF: stem', "link[@name='stem']/visual/origin", 'xyz', '0 0 0.9'),
    urdf('URDF: stem', "joint[@name='stem_joint']/axis", 'xyz', '0 1 0'),
    urdf('URDF: wheel', "joint[@name='wheel_joint']/parent", 'link', 'base_link'),
    urdf('URDF: wheel', "joint[@name='wheel_joint']/origin", 'rpy', '1.5708 0 0'),
    urdf('URDF: wheel', "link[@name='wheel']/visual/origin", 'rpy', '0 0 0'),
    urdf('URDF: wheel', "joint[@name='wheel_joint']", 'type', 'revolute'),
    urdf('URDF: colors', "link[@name='platform']/visual/material", 'name', 'green'),
    urdf('URDF: colors', "material[@name='blue']/color", 'rgba', '0.250 0.58 0.340 1.0'),
    urdf('URDF: numbers', "link[@name='wheel']/visual/geometry/cylinder", 'radius', '0.22'),
    urdf('URDF: numbers', "link[@name='platform']/visual/geometry/cylinder", 'radius', '0.15'),
    urdf('URDF: numbers', "link[@name='platform']/visual/origin", 'xyz', '0 0 0.1'),
    ('place', lambda record, x: change_request(record, 'places', value=(x, *FAR[1:])),
     (1.508,), (1.52,)),
    ('place', lambda record, accepted: change_request(record, 'places', accepted=accepted),
     (True,), (False,)),
    ('drop', move_response, (-0.45,), (-0.55,)),
    ('drop', partial(move_response, accepted=False), (), (-0.1,)),
    ('drop: answer first', move_response, (-0.0005, 0.0075), (0.0085,)),
    ('drop: answer first', partial(move_response, missing=1), (0.0075,), (0.0085,)),
    ('drop: answer first', move_early, (), (1e-4,)),
    ('brick: hovers', lambda record, dx: shift(record, 'brick', -0.4, dx), (0.0005,), (0.002,)),
    ('brick: rides', lambda record, dx: shift(record, 'brick', 6.4, dx), (0.15,), (0.3,)),
    ('brick: rides', lambda record, y: setattr(record.drops[1], 'place', (CLOSE[0], y, CLOSE[2])),
     (CLOSE[1] + 0.015,), (CLOSE[1] + 0.03,)),
    ('fall: acceleration', 'gravity', (9.63, 9.99), (9.59, 10.03)),
    ('fall: acceleration', 'step', (0.002, 0.02), ()),
    ('fall: course', 'aside', (0.002,), (0.05,)),
    # At 3.2 s, the brick falls 0.027 m in one step.
    ('fall: course', lambda record, dz: shift(record, 'brick', 3.2, dz, 2),
     (0.04, -0.04), (0.055, -0.055)),
    ('tilt', tilt_in_tf, (0.31,), (-0.3, 0.33)),
    ('fall: ground', 'below', (0.0,), (-0.06, 0.06)),
    ('fall: platform', 'above', (0.0,), (-0.06, 0.06)),
    ('brick: angle', 'lean', (0.018, -0.018), (0.022,)),
    ('slide: law', 'pull', (0.92, 1.08), (0.88, 1.12, 1e-6)),
    ('slide: law', 'late', (0.02, 0.04), ()),
    ('slide: law', 'kept', (1.0,), ()),
    ('slide: end', 'kept', (1.0,), ()),
    ('brick: angle', 'late', (0.02, 0.04), ()),
    ('slide: end', 'late', (0.02, 0.04), ()),
    ('slide: end', 'stop', (), (NUMBERS['platform_radius'], NUMBERS['platform_radius'] + LENGTH)),
    ('slide: end', lambda record, dz: shift(record, 'brick', (
        record.drops[1].floated - BEGIN) * SECONDS_PER_NS, dz, 2), (0.02,), (-0.06,)),
    ('brick: floats', 'drift', (0.002,), (0.006,)),
    ('carry', lambda record, dx: setattr(
        record.drops[1], 'carried_to', (CENTER[0] + dx, CENTER[1])), (0.08,), (0.22,)),
    ('walls: size', lambda record, z: setattr(
        record.markers[0].marker.pose.position, 'z', z), (0.25,), (-0.25,)),
    ('walls: size', lambda record, x: setattr(
        record.markers[0].marker.pose.position, 'x', x), (5.9,), (-5.5, 7.0)),
    ('walls: visible', publish_walls, (range(-1, 12),), ((0.0,), (0.0, 0.1))),
    ('brick marker: visible', lambda record, latched: record.latched.update(
        {'/brick_marker': latched}), (), (False,)),
    ('brick marker: place', lambda record, dx: setattr(
        record.markers[4].marker.pose.position, 'x', dx), (0.005,), (0.02,)),
    ('markers: frames', lambda record, alpha: setattr(
        record.markers[0].marker.color, 'a', alpha), (0.1,), (0.0,)),
    ('markers: frames', lambda record, w: setattr(
        record.markers[0].marker.pose.orientation, 'w', w), (0.0,), (0.5,)),
    ('verdict: in time', remove_verdict, (), (None,)),
    ('verdict: out of reach', partial(change_verdict, number=0, should_be_caught=False),
     (True,), (False,)),
    ('verdict: in reach', partial(change_verdict, number=1, should_be_caught=True),
     (False,), (True,)),
    ('verdict: kept', partial(change_verdict, number=1, should_be_caught=None), (False,), (True,)),
    ('text: time', change_text, (2.71, 3.29), (2.69, 3.31)),
    ('text: time', partial(remove_text, action=Marker.DELETE), (2.71,), (3.31,)),
    ('text: time', partial(remove_text, action=Marker.DELETEALL), (3.29,), (2.69,)),
    ('text: time', replace_text, (2.71, 3.29), (2.69, 3.31)),
    # Repeated text is visible from the first message until the last one expires.
    ('text: time', partial(change_text, again=(1.0, 2.0)), (1.0,), (3.0,)),
    ('text: kind', lambda record, text: change_text(record, 3.0, text), (),
     ('unreachable!', 'UNREACHABLE', 'Unachievable')),
    ('text: kind', lambda record, kind: change_text(record, 3.0, kind=kind), (), (Marker.ARROW,)),
    *(('walls: size', partial(show_walls, markers=markers), (0.0,), (0.6,)) for markers in WALLS),
    ('walls: size', partial(show_walls, markers=WALLS[6][::12]), (), (0.0,)),
    ('fall: course', partial(add_falls, speed=3.0), (), (1,)),
    ('fall: acceleration', partial(add_falls, factor=0.95), (2,), (3,)),
    ('fall: ground', lambda record, dz: shift(record, 'brick', (
        record.drops[0].down - BEGIN) * SECONDS_PER_NS - 0.01, dz, 2), (), (-0.125,)),
    *((rule, turn_brick_marker, ('y',), ()) for rule in (
        'fall: ground', 'fall: platform', 'slide: end')),
    ('fall: platform', change_height, (-0.04, 0.04), ()),
    ('URDF: numbers', change_height, (-0.04,), (0.04,)),
    ('URDF: numbers', show_wheel, ('sphere',), ()),
    ('config: numbers', lambda record, name: record.profile.numbers.pop(name), (),
     ('max_velocity',)),
    ('drive: rolling', roll_too_far, (0.9,), (3.0,)),
    ('drive: rolling', limit_wheel, (2.0 * pi,), ()),
    ('drive: rolling', turn_wheel_at_rest, (), (1.0,)),
    ('drive: rolling', turn_stem_in_tf, (2.0,), ()),
    ('cmd_vel: at rest', lambda record, rest: record.idle.append(tuple(map(at, rest))), (),
     ((20.0, 23.0),)),
    ('brick: hovers', lambda record, rest: record.idle.append(tuple(map(at, rest))),
     ((2.6, 3.0),), ()),
    ('slide: law', delay_tilting_brick, (1,), ()),
    ('slide: law', land_late, (0.1,), ()),
    ('slide: end', land_late, (0.1,), ()),
    ('cmd_vel: at rest', stop_commands, (2.0 * LEG,), (LEG + 0.55,)),
    ('verdict: in time', judge_early, (), (2.2, 2.4)))
"""Each row contains a rule, a change to a correct record, and accepted and rejected values."""


def test_a_correct_record_meets_all_requirements_and_an_empty_record_none():
    found = referee.RULES.judge(make_record())
    assert len(found) == 61
    assert [one for one in found if one.mark != MET] == []
    assert {one.mark for one in referee.RULES.judge(Record(Profile()))} == {FAILED, OPEN}


@pytest.mark.parametrize('rule, off, allowed, failed', FAULTS)
def test_allowed_values_meet_the_rule_and_faults_violate_it(rule, off, allowed, failed):
    parts, others, rate = ((drive,), ROBOT_RULES, 100.0) if rule in ROBOT_RULES else (
        PARTS, BRICK_RULES, 10.0)
    for value in (*allowed, *failed):
        if isinstance(off, str):
            record = make_record(parts, **{'rate': rate, off: value})
        else:
            record = pickle.loads(saved_record(parts, rate))
            off(record, value)
        if value in allowed:
            assert judge(record, rule)[0].mark == MET, value
        else:
            found = [one for one in judge(record, *others) if one.mark == FAILED]
            assert [one.name for one in found if not one.follows] == [rule], value


@pytest.mark.parametrize('rate, met', (
    (97.7, False), (98.3, True), (101.7, True), (102.3, False)))
def test_rates_are_measured_by_stamps(rate, met):
    names = {f'rate: {name}' for name in ('cmd_vel', 'odom', 'joint_states', 'base_link')}
    record = make_record((drive,), rate=rate)
    record.publishers['/judged/joint_states'] = {'/gui', '/judged/turtle_robot'}
    found = judge(record, *names)
    assert sum('published by /gui and /judged/turtle_robot' in one.measured for one in found) == 1
    assert {one.name for one in found if one.mark == FAILED} == (set() if met else names)


@pytest.mark.parametrize('rate, mark', ((100.0, MET), (40.0, OPEN), (120.0, FAILED)))
def test_a_brick_that_is_not_broadcast_in_every_step_does_not_show_their_rate(rate, mark):
    assert judge(make_record((drive, fall), rate=rate), 'rate: brick')[0].mark == mark


def add_load(record, begin, end):
    """Let other programs delay the graph between two times (s)."""
    record.windows.append(Window(at(begin), at(end), 0.3))


def mirror_odometry(record):
    for received in record.topics['odom']:
        received.message.pose.pose.position.x *= -1.0


def fix_joints(record):
    add_message(record, 'robot_description', SimpleNamespace(data=URDF.replace(
        'type="continuous"', 'type="fixed"')), -0.4)


def drive_often(record):
    record.drives = record.drives[:1] * 5


def test_what_load_can_change_is_judged_in_calm_trials():
    record = make_record((drive,))
    change_request(record, 'drives', goal=CENTER, start=(0.0, 0.0))
    for begin, expected in ((-3.0, FAILED), (0.1, MET), (0.9, FAILED)):
        record.windows = []
        add_load(record, begin, begin + 0.2)
        assert judge(record, 'drive: overshoot')[0].mark == expected
    add_load(record, 0.1, 0.3)
    found, = judge(record, 'drive: overshoot')
    assert (found.mark, found.measured) == (
        OPEN, 'not judged: other programs took processor time from the graph in 2 of 3 trials')


def sink(record, event):
    """Move the brick 2 m down at the time of an event (ns)."""
    shift(record, 'brick', (event(record) - BEGIN) * SECONDS_PER_NS, -2.0, 2)


def unchanged(record):
    pass


@pytest.mark.parametrize('rule, off, change_record, mark', (
    ('drive: rolling', {'slip': 1.5}, unchanged, OPEN),
    ('drive: rolling', {'slip': -1.0}, unchanged, FAILED),
    ('drive: stem first', {}, partial(turn_late, seconds=0.1), OPEN),
    ('drive: stem first', {}, fix_joints, FAILED),
    ('drive: stem', {'crooked': 0.5}, unchanged, FAILED),
    ('rate: odom', {'rate': 62.5}, unchanged, OPEN),
    ('rate: odom', {'rate': 62.5}, drive_often, FAILED),
    ('odom: pose', {}, partial(delay_odometry, seconds=0.3), OPEN),
    ('odom: pose', {}, mirror_odometry, FAILED),
    ('fall: acceleration', {'gravity': 15.0}, unchanged, OPEN),
    ('brick: floats', {'drift': 0.006}, unchanged, OPEN),
    ('text: time', {}, partial(remove_text, seconds=5.0, action=Marker.DELETE), OPEN),
    ('text: time', {}, partial(change_text, seconds=5.0), FAILED),
    ('text: time', {}, partial(change_text, seconds=0.0), FAILED),
    ('place', {}, partial(sink, event=lambda record: record.places[0].end - 2 * BEFORE_NS),
     FAILED),
    ('fall: ground', {}, partial(sink, event=lambda record: record.drops[0].down), FAILED),
    ('URDF: numbers', {}, lambda record: record.profile.numbers.update(wheel_radius=0.3),
     FAILED)))
def test_load_can_change_a_magnitude_but_no_sign_text_or_part(rule, off, change_record, mark):
    record = make_record(**off)
    change_record(record)
    assert judge(record, rule)[0].mark == FAILED
    add_load(record, -1.0, 20.0)
    assert judge(record, rule)[0].mark == mark


def test_a_faulty_verdict_is_open_if_its_drop_was_not_calm():
    for drop, mark in ((0, OPEN), (1, FAILED)):
        record = make_record(rate=10.0)
        unseen = record.drops[0]
        unseen.goal, unseen.caught = None, False
        unseen.refusals.clear()
        begin = (record.drops[drop].begin - BEGIN) * SECONDS_PER_NS
        add_load(record, begin, begin + 0.1)
        assert judge(record, 'verdict: in time')[0].mark == mark


@pytest.mark.parametrize('seconds, mark', ((0.02, OPEN), (1.0, FAILED)))
def test_a_text_is_open_if_the_record_ends_before_it(seconds, mark):
    record = make_record((drive, fall))
    interrupt(record, seconds)
    assert judge(record, 'text: time')[0].mark == mark


def test_a_text_in_a_drop_that_is_not_calm_does_not_belong_to_another_drop():
    record = make_record(rate=10.0)
    text = next(received for received in record.markers if received.topic == '/text')
    record.markers.append(text._replace(published=record.drops[1].begin + 1))
    add_load(record, (record.drops[1].begin - BEGIN) * SECONDS_PER_NS, 20.0)
    assert judge(record, 'text: time')[0].mark == MET


def test_a_saved_record_is_judged_in_the_same_way(tmp_path):
    path, record = tmp_path / 'record.gz', make_record(gravity=12.0)
    save(record, path)
    before, after = ([(one.name, one.mark, one.measured) for one in referee.RULES.judge(known)]
                     for known in (record, load_record(path)))
    assert before == after


def test_a_slide_without_poses_is_open():
    record = make_record(rate=10.0)
    record.frames['brick'].samples.clear()
    assert judge(record, 'slide: law')[0].mark == OPEN


def test_the_frame_of_the_brick_may_be_at_its_base():
    record, half = make_record(rate=10.0), HEIGHT / 2.0
    brick = record.frames['brick']
    # From LEVEL on, the floating brick turns about its base.
    last = brick.between(0, at(LEVEL))[-1].pose

    def lowered(sample):
        pose = sample.pose if sample.stamp < at(LEVEL) else last
        return sample.pose._replace(position=shifted(pose, -half * pose.upright).position)

    move(brick, lowered)
    record.markers[4].marker.pose.position.z = half
    record.places = [one._replace(value=(*one.value[:2], one.value[2] - half))
                     for one in record.places]
    for watch in record.drops:
        watch.place, watch.landed = ((*one[:2], one[2] - half) for one in (
            watch.place, watch.landed))
    assert [one.name for one in judge(record, *BRICK_RULES) if one.mark != MET] == []


def test_a_marker_that_moves_with_the_brick_is_its_marker():
    rules = ('brick marker: place', 'brick marker: visible', 'fall: ground', 'walls: size')
    for seconds in ((-0.5, 2.0, 4.0, 5.1, 6.0), (-0.5,)):
        record = make_record()
        del record.markers[4]
        record.latched['/visualization_marker'] = True
        for now in seconds:
            marker = box('world')
            place = marker.pose.position
            place.x, place.y, place.z = record.pose('brick', at(now)).position
            record.markers.append(ReceivedMarker(at(now), '/visualization_marker', marker))
        found = {one.name: one.mark for one in judge(record, *rules)}
        failed = [] if len(seconds) > 1 else ['brick marker: place']
        assert [name for name, mark in found.items() if mark != MET] == failed


def test_a_marker_in_the_frame_of_the_brick_is_its_marker():
    record = make_record()
    record.profile.frames['brick'] = 'block'
    record.frames['block'] = record.frames.pop('brick')
    record.markers[4] = ReceivedMarker(at(-0.5), '/visualization_marker', box('block'))
    record.latched['/visualization_marker'] = True
    assert {one.mark for one in referee.RULES.judge(record)} == {MET}


def test_a_link_is_where_its_visual_is():
    record, robot = make_record((drive,)), ElementTree.fromstring(URDF)
    for link in robot.findall('link'):
        # Move the visual of each link to a new link that is fixed to it, 0.4 m higher.
        name = link.get('name')
        other, joint = (ElementTree.SubElement(robot, tag, {'name': f'{name}_{tag}'})
                        for tag in ('link', 'joint'))
        joint.set('type', 'fixed')
        for tag, key, value in (('parent', 'link', name), ('child', 'link', f'{name}_link'),
                                ('origin', 'xyz', '0 0 0.4')):
            ElementTree.SubElement(joint, tag, {key: value})
        for visual in link.findall('visual'):
            link.remove(visual)
            other.append(visual)
            origin = visual.find('origin')
            if origin is None:
                origin = ElementTree.SubElement(visual, 'origin', {'xyz': '0 0 0'})
            x, y, z = map(float, origin.get('xyz', '0 0 0').split())
            origin.set('xyz', f'{x} {y} {z - 0.4}')
    add_description(record, robot)
    names = [name for name in NAMES if name.startswith('URDF')]
    assert [one.name for one in judge(record, *names) if one.mark != MET] == []


def test_the_wheel_is_judged_when_its_pose_is_known():
    record = make_record((drive,))
    record.idle.insert(0, (at(-9.0), at(-8.0)))
    assert judge(record, 'frames: robot')[0].mark == MET
    move(record.frames['odom'], lambda sample: shifted(sample.pose, (0.0, 0.0, 0.05)))
    assert judge(record, 'frames: robot')[0].mark == FAILED
    del record.frames['odom']
    assert judge(record, 'frames: robot')[0].mark == OPEN


def test_a_wheel_is_on_the_ground_if_its_visual_is():
    record = make_record((drive,))
    _, edit, *_ = urdf('', "link[@name='wheel']/visual/origin", 'xyz')
    edit(record, '0 0 0.3')
    assert judge(record, 'frames: robot')[0].mark == FAILED
    wheel = record.frames.pop('wheel').samples[0].pose
    add_transforms(record, 'wheel', 'stem', [(-0.5, shifted(wheel, (0.0, 0.0, -0.3)))], True)
    assert judge(record, 'frames: robot')[0].mark == MET


def test_a_wrong_timestamp_fails_one_rule():
    record = make_record((drive, fall))
    for number, sample in enumerate(record.frames.pop('brick').samples):
        transform = TransformStamped(child_frame_id='brick')
        transform.header.frame_id, place = sample.parent, transform.transform.translation
        place.x, place.y, place.z = map(float, sample.pose.position)
        record.add_transform(sample.stamp, number, transform, False)
    for received in record.topics['odom']:
        received.message.header.stamp = Time()
    found, = (one for one in referee.RULES.judge(record) if one.mark == FAILED)
    assert found.name == 'frames: timestamps'
    assert found.measured.endswith('far from the current time: brick, messages on odom')


def test_the_size_of_the_brick_is_the_usual_size_of_its_markers():
    record = make_record(rate=10.0)
    for lag in (0.0, 0.0, -1.0):  # The last marker shows where the brick was before.
        marker = box('world')
        marker.type, stamp = Marker.CUBE, record.drops[0].end - 1
        place = marker.pose.position
        place.x, place.y, place.z = record.pose('brick', stamp).position
        place.z += lag
        record.markers.append(ReceivedMarker(stamp, '/brick_marker', marker))
    found = judge(record, 'fall: ground', 'fall: platform')
    assert {one.mark for one in found} == {MET}


@pytest.mark.parametrize('gravity, mark', ((9.81, MET), (12.0, FAILED)))
def test_late_steps_of_a_fall_have_the_right_acceleration(gravity, mark):
    record = make_record((drive, fall), step=0.004, gravity=gravity)
    samples = record.frames['brick'].samples
    for number, sample in enumerate(samples):
        if sample.stamp > at(2.5):  # The timer becomes slower.
            stamp = at(2.5) + round(1.3 * (sample.stamp - at(2.5)))
            samples[number] = sample._replace(stamp=stamp)
    record.drops[0].down = at(2.5) + round(1.3 * (record.drops[0].down - at(2.5)))
    assert {one.mark for one in judge(record, 'fall: acceleration', 'fall: course')} == {
        mark, MET}


@pytest.mark.parametrize('rule, change_record', (
    ('drive: goal', lambda record: change_request(
        record, 'drives', goal=(CENTER[0] + 1.33, CENTER[1] + 0.9))),
    ('drive: overshoot', lambda record: change(record, 'pose', 0.55, 'x', 0.13)),
    ('drive: straight', lambda record: change(record, 'pose', 0.2, 'y', 0.13))))
def test_an_accuracy_that_the_assignment_does_not_require_is_open(rule, change_record):
    record = make_record((drive,))
    change_record(record)
    found, = judge(record, rule)
    assert found.mark == OPEN and found.measured.endswith('the assignment requires no accuracy')


@pytest.mark.parametrize('angle, mark', ((0.0, MET), (0.2, FAILED)))
def test_the_last_message_on_tilt_counts_whoever_sent_it(angle, mark):
    record = make_record((drive,))
    tilt_in_tf(record, 0.0)
    record.topics['joint_states'][-1].message.position = [0.0]
    for seconds, sent in ((9.0, 0.3), (9.05, angle)):
        record.topics['tilt'].append(Received(at(seconds), sent))
    found, = judge(record, 'tilt')
    assert found.mark == mark
    assert '0.3 rad from the referee was replaced by another node' in found.measured


def test_a_brick_that_is_not_where_it_was_placed_is_not_dropped():
    record = make_record(rate=10.0)
    record.drops = record.drops[:1]
    record.drops[0].place = (5.0, 5.0, 8.0)
    found = judge(record, 'fall: ground', 'fall: acceleration', 'verdict: in time')
    assert {one.measured for one in found} == {'no brick fell from the place where it was put'}


def test_a_catcher_may_be_busy_with_the_previous_brick():
    record = make_record(rate=10.0)
    record.drops.reverse()
    for leveled, mark in ((record.drops[0].leveled, FAILED), (None, OPEN)):
        record.drops[0].leveled = leveled
        record.drops[1].refusals.clear()
        assert judge(record, 'verdict: in time')[0].mark == mark


def test_only_requirements_that_are_not_met_are_causes():
    rules = Rules()
    for name, depends_on, met in (('a', (), False), ('b', 'a', True), ('c', 'b', False),
                                  ('d', 'a', False)):
        rules.rule(name, '', '', depends_on)(lambda record, met=met: Finding(met, ''))
    found = {one.name: one.follows for one in rules.judge(Record(Profile())) if one.mark == FAILED}
    assert found == {'a': [], 'c': [], 'd': ['a']}


def test_a_robot_that_drives_elsewhere_fails_one_rule():
    record = make_record((drive,))
    record.drives = [one._replace(goal=(1.0, 9.0)) for one in record.drives]
    found = judge(record, 'drive: goal', 'drive: straight', 'drive: overshoot')
    assert [(one.name, one.mark) for one in found if one.mark != OPEN] == [('drive: goal', FAILED)]


@pytest.mark.parametrize('begin, mark', ((7.5, FAILED), (8.3, MET)))
def test_the_platform_may_be_leveled_when_the_next_brick_is_dropped(begin, mark):
    record = make_record(rate=10.0)
    record.drops[1].leveled = None
    record.drops.append(DropWatch(record, at(begin), FAR))
    assert judge(record, 'again')[0].mark == mark


@pytest.mark.parametrize('rule, change_record', (
    ('frames: base_link', lambda record: shift(record, 'base_link', LEG - 0.05, 0.1, 1)),
    ('carry', lambda record: setattr(
        record.drops[1], 'carried_to', (CENTER[0] + 0.13, CENTER[1]))),
    ('again', lambda record: setattr(record.drops[1], 'leveled', None)),
    ('text: time', lambda record: change_text(record, 3.0, again=(0.1, 0.2, 0.3, 0.4)))))
def test_what_the_assignment_does_not_forbid_is_open(rule, change_record):
    record = make_record()
    change_record(record)
    assert judge(record, rule)[0].mark == OPEN


def test_where_a_brick_that_was_not_dropped_ends_may_follow_from_that():
    record = make_record(rate=10.0, below=-0.5)
    record.drops[1].released = None
    found = judge(record, 'drop', 'fall: course', 'fall: ground')
    assert {one.name: one.follows for one in found} == {
        'drop': [], 'fall: course': (), 'fall: ground': ['drop']}


def test_what_an_unobserved_stem_does_first_is_open():
    record = make_record((drive,))
    for received in record.topics['joint_states']:
        received.message.name[0] = 'other_joint'
    found = judge(record, 'joint_states: names', 'drive: stem', 'drive: stem first')
    assert [one.mark for one in found] == [FAILED, OPEN, OPEN]


def test_the_stem_is_not_judged_where_the_robot_turns():
    for crooked, mark in ((0.0, MET), (radians(6.0), FAILED)):
        record = make_record((drive,), crooked=crooked)
        base = record.frames['base_link']
        corner = base.at(at(0.25)).pose._replace(orientation=turn(Z, pi / 2.0))
        move(base, lambda sample: sample.pose._replace(position=tuple(
            corner.transform(numpy.subtract(sample.pose.position, corner.position)))),
            at(0.25), at(LEG))
        for received in record.messages('joint_states', at(0.25), at(LEG)):
            received.message.position[0] += pi / 2.0
        assert judge(record, 'drive: stem')[0].mark == mark


@pytest.mark.parametrize('lag, mark', ((0.03, MET), (0.2, FAILED)))
def test_a_brick_may_lag_when_it_lands_on_a_moving_platform(lag, mark):
    record, stop = make_record(), 6.3
    watch, down = record.drops[1], (record.drops[1].down - BEGIN) * SECONDS_PER_NS

    def driving(sample, late, begin):
        seconds = max((sample.stamp - BEGIN) * SECONDS_PER_NS, begin) - late
        return shifted(sample.pose, (SPEED * (min(seconds, stop) - stop), 0.0, 0.0))

    for frame, late, begin in (('base_link', 0.0, 0.0), ('brick', lag, down)):
        move(record.frames[frame], partial(driving, late=late, begin=begin),
             at(4.9), at(stop + lag))
    watch.landed = record.pose('brick', watch.down).position
    watch.place = (*watch.landed[:2], watch.place[2])
    assert judge(record, 'brick: rides')[0].mark == mark


def test_a_repeated_text_is_visible_until_it_is_deleted():
    record = make_record((drive, fall))
    text = next(received for received in record.markers if received.topic == '/text')
    text.marker.lifetime.sec = 0
    later = [text._replace(published=text.published + number * NS_PER_SECOND // 10)
             for number in range(1, 31)]
    for received, visible in ((text, True), (later[-1], True), (text._replace(
            published=later[-1].published + 1, marker=Marker(action=Marker.DELETE)), False)):
        record.markers.append(received)
        assert is_text_visible(record, received.published + 1) == visible
    assert judge(record, 'text: time')[0].mark == MET


def test_parameters_that_only_limit_errors_may_be_unknown():
    record = make_record()
    for name in ('max_velocity', 'gravity_accel', 'wheel_radius'):
        del record.profile.numbers[name]
    found = judge(record, 'odom: pose', 'brick: rides', 'fall: ground', 'drive: rolling')
    assert [one.name for one in found if one.mark != MET] == []


def test_the_marker_of_a_moving_brick_is_not_compared_with_the_brick():
    record = make_record(rate=10.0)
    record.markers[4].marker.pose.position.x = 0.02
    for request in record.places:
        shift(record, 'brick', (request.end - BEGIN) * SECONDS_PER_NS - 0.02, 0.01)
    assert judge(record, 'brick marker: place')[0].mark == OPEN


def test_a_fall_may_be_integrated_in_steps():
    record, step = make_record((drive, fall), step=0.004), 0.004
    watch, gravity = record.drops[0], NUMBERS['gravity_accel']

    def fallen(sample):
        time = (sample.stamp - watch.released) * SECONDS_PER_NS
        return Pose((*FAR[:2], FAR[2] - gravity * time * (time + step) / 2.0))

    move(record.frames['brick'], fallen, watch.released + 1, watch.down)
    move_response(record, 0.0035)
    found = judge(record, 'drop: answer first', 'fall: acceleration', 'fall: course')
    assert {one.mark for one in found} == {MET}


def test_the_brick_may_lead_a_platform_that_tf_contains_at_a_low_rate():
    record = make_record(rate=10.0)
    frame = record.frames['platform']
    frame.samples = [*frame.samples[:50], *frame.samples[51::3]]
    assert [one.name for one in judge(record, *BRICK_RULES) if one.mark != MET] == []


@pytest.mark.parametrize('gravity, mark', ((9.81, MET), (15.0, FAILED)))
def test_a_brick_that_falls_through_the_ground_is_judged(gravity, mark):
    record = make_record((drive, fall), below=inf, gravity=gravity)
    assert record.drops[0].down is None
    assert judge(record, 'fall: acceleration')[0].mark == mark


def test_the_angle_of_the_brick_is_open_if_nothing_was_inclined():
    assert judge(make_record((drive, fall)), 'brick: angle')[0].mark == OPEN


def test_dependencies_are_rules_without_circles():
    for name in NAMES:
        assert all_dependencies(name) <= NAMES - {name}


def test_an_absent_topic_breaks_many_rules_with_one_cause():
    record = make_record()
    record.topics['robot_description'].clear()
    found = [one for one in referee.RULES.judge(record) if one.mark == FAILED]
    assert {one.measured for one in found} == {'there is no robot_description'}
    assert [one.follows for one in found] == [[], *[['frames: robot']] * (len(found) - 1)]
    crash = 'publisher crashed: exit status 1'
    record.crashes = [crash]
    found = [one for one in referee.RULES.judge(record) if one.mark == FAILED]
    assert {tuple(one.follows) for one in found} == {(crash,)}


def record_of_crash(crash):
    """Return a record without the messages and transforms of a robot that crashed."""
    record = make_record()
    for name in ('cmd_vel', 'odom', 'joint_states'):
        record.topics[name].clear()
    for name in ('odom', 'base_link', 'stem', 'wheel', 'platform'):
        del record.frames[name]
    record.drives.clear()
    record.drops.pop()
    record.crashes = [crash]
    return referee.RULES.judge(record)


def test_what_a_crash_causes_is_said_once():
    crash = "turtle_robot crashed: LookupException: 'odom' does not exist"
    judgments = record_of_crash(crash)
    found = [one for one in judgments if one.mark == FAILED]
    assert {tuple(one.follows) for one in found} == {(crash,)}
    assert {'frames: world', 'frames: robot', 'rate: odom'} <= {one.name for one in found}


def test_what_the_environment_lacks_fails_no_rule():
    crash = explain_missing('turtle_robot crashed: This environment does not contain tf2_kdl')
    found = record_of_crash(crash)
    assert {one.mark for one in found} == {OPEN, MET}
    assert {one.measured for one in found if one.name == 'frames: world'} == {crash}
    later = explain_missing("robot crashed: ModuleNotFoundError: No module named 'turtlesim_msgs'")
    assert later.endswith('another release: Jazzy does not contain turtlesim_msgs)')
    ours = explain_missing("robot crashed: ModuleNotFoundError: No module named 'nothing'")
    assert ours.endswith('(the workspace and this installation of ROS do not contain nothing)')
    assert {one.mark for one in record_of_crash(later)} == {OPEN, MET}
    python = explain_missing("robot crashed: ModuleNotFoundError: No module named 'rclpy'")
    assert python.endswith('(it is here, but the program was started with another Python)')
    assert FAILED in {one.mark for one in record_of_crash(ours)}


def test_what_the_environment_lacks_opens_no_requirement_for_an_earlier_node():
    record = make_record(slip=-1.0)
    for drop in record.drops:
        drop.refusals.clear()
    record.crashes = [explain_missing('catcher crashed: This environment lacks a module')]
    judgments = {one.name: one for one in referee.RULES.judge(record)}
    assert [name for name, one in judgments.items() if one.mark == FAILED] == ['drive: rolling']
    assert judgments['verdict: in time'].measured == record.crashes[0]

    del record.frames['brick']
    record.markers.clear()
    record.drops.clear()
    judgments = {one.name: one for one in referee.RULES.judge(record)}
    assert [name for name, one in judgments.items() if one.mark == FAILED] == ['drive: rolling']
    assert judgments['frames: brick'].measured == record.crashes[0]


def test_a_part_of_the_interface_that_cannot_be_used_is_open():
    record = make_record()
    record.unclear = dict.fromkeys(('tilt', 'place', 'goal_pose', 'wheel'), 'unclear')
    found = {one.name: one.measured for one in referee.RULES.judge(record) if one.mark != MET}
    assert set(found.values()) == {'unclear'}
    assert {'tilt', 'place', 'drop', 'drive: goal', 'URDF: wheel', 'carry'} <= found.keys()


def test_frames_may_have_other_names():
    record = make_record()
    for name, other in (('brick', 'brick_1'), ('platform', 'tray')):
        record.profile.frames[name] = other
        record.frames[other] = record.frames.pop(name)
    record.markers[4].marker.header.frame_id = 'brick_1'
    description = record.topics['robot_description'][0].message
    description.data = description.data.replace('"platform"', '"tray"')
    assert {one.mark for one in referee.RULES.judge(record)} == {MET}


@pytest.mark.filterwarnings('ignore:invalid value')
@pytest.mark.parametrize('odd', (nan, inf, 0.0))
def test_nan_and_infinity_are_judged(odd):
    record = make_record()
    for frame in record.frames.values():
        move(frame, lambda _: Pose((odd,) * 3, (odd,) * 4))
    for received in record.topics['pose']:
        received.message.x = odd
    for received in record.markers:
        received.marker.pose.position.x = received.marker.scale.x = odd
    found = {one.name: one.mark for one in referee.RULES.judge(record)}
    assert len(found) == len(referee.RULES)
    assert MET not in {found[name] for name in (
        'walls: size', 'drive: goal', 'odom: pose', 'slide: law', 'place')}


def test_a_record_can_be_limited_to_the_newest_messages():
    record = make_record()
    latest = record.frames['brick'].samples[-1]
    forget_old_messages(record)
    assert record.frames['brick'].samples[-1] is latest
    assert max(len(frame.samples) for frame in record.frames.values()) == KEPT_MESSAGES
