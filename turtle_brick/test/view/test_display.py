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
"""What the viewer shows: robot, markers, frames, curves and texts, on a page that is a mock."""

from contextlib import nullcontext
from itertools import chain
from math import cos, dist, hypot, inf, nan, pi, sin

from builtin_interfaces.msg import Duration
from builtin_interfaces.msg import Time as TimeMessage
from faulty_markers import changed, FAULTS, harmless
from geometry_msgs.msg import Point, PoseStamped, Quaternion, TransformStamped, Vector3
from hypothesis import given
from hypothesis import strategies as st
import pytest
from rclpy.time import Time
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer
from turtle_brick.arena import BRICK_COLORS, brick_marker, walls
from turtle_brick.core.geometry import from_pitch, from_yaw, IDENTITY, multiply, Pose, rotate
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER
from turtle_brick.physics import Phase
from turtle_brick.ros.tf import transform_message
from turtle_brick.view.display import Display, LONGEST_WARNING, MOST_MARKERS, shape_of
from turtle_brick.view.urdf_scene import LARGEST
from turtle_brick.view.viewing import NANOSECONDS
from turtle_brick_interfaces.msg import Tilt
from visualization_msgs.msg import Marker

COORDINATES = st.floats(-5.0, 5.0)
START = 1_700_000_000 * NANOSECONDS

ROBOT = """
<robot name="small">
  <link name="base_link">
    <visual><geometry><box size="1 1 1"/></geometry></visual>
  </link>
  <link name="arm">
    <visual><geometry><sphere radius="1"/></geometry></visual>
    <visual><geometry><mesh filename="a.stl"/></geometry></visual>
  </link>
  <joint name="j" type="continuous"><parent link="base_link"/><child link="arm"/></joint>
</robot>
"""


class Paper:
    """A page, scene and panel without a browser."""

    def __init__(self):
        """Begin with an empty one."""
        self.scene = self.panel = self
        self.things = {}
        self.poses = {}
        self.axes = set()
        self.frames = self.follow = False
        self.focus = None
        self.texts = {}
        self.place = None

    def together(self):
        """Draw one after the other."""
        return nullcontext()

    def put(self, name, shapes, axes=False):
        """Make or change a thing."""
        self.things[name] = tuple(shapes)
        self.poses.setdefault(name, None)
        if axes:
            self.axes.add(name)

    def move(self, name, pose):
        """Move a thing."""
        assert name in self.things
        self.poses[name] = pose

    def focus_on(self, x, y):
        """Note what the cameras see."""
        self.focus = (x, y)

    def remove(self, name):
        """Remove a thing."""
        self.things.pop(name, None)
        self.poses.pop(name, None)
        self.axes.discard(name)

    def names(self):
        """Return the names of all things."""
        return list(self.things)

    def suggest_place(self, position):
        """Note a place."""
        assert self.place is None
        self.place = position

    def __getattr__(self, name):
        """Note what is shown."""
        def show(*values):
            self.texts[name] = values
        if name.startswith('show_'):
            return show
        raise AttributeError(name)


class Bench:
    """A display that draws on paper, and the messages for it."""

    def __init__(self):
        """Begin with an empty page."""
        self.now = START
        self.paper = Paper()
        self.warnings = []
        self.topics = set()
        self.display = Display(self.paper, Buffer(), self.warn)

    def warn(self, topic, sentence):
        """Note a warning about a topic."""
        self.warnings.append(sentence)
        self.topics.add(topic)

    def transform(self, parent, child, pose, static=False):
        """Send a transform."""
        message = transform_message(parent, child, pose, Time(nanoseconds=self.now).to_msg())
        self.display.hear_transforms(
            TFMessage(transforms=[message]), static, self.now, self.now)

    def marker(self, topic='catcher_marker', frame='world', **fields):
        """Send the marker of a box."""
        message = Marker(ns='n', type=Marker.CUBE)
        message.header.frame_id = frame
        message.scale.x = message.scale.y = message.scale.z = 1.0
        message.pose.orientation.w = 1.0
        for name, value in fields.items():
            setattr(message, name, value)
        self.display.hear_marker(topic, message, self.now)

    def brick(self, phase):
        """Send the brick's marker."""
        message = brick_marker(phase, (0.4, 0.2, 0.12))
        self.display.hear_marker('brick_marker', message, self.now)

    def draw(self, after=0):
        """Draw, some time (ns) later."""
        self.now += after
        self.display.draw(self.now)
        return self.paper.poses


@pytest.fixture
def bench():
    """Return an empty display."""
    return Bench()


@given(st.tuples(*[st.floats(-9.0, 9.0)] * 3), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_every_link_is_where_tf_says(place, yaw, pitch):
    bench = Bench()
    bench.display.hear_description(String(data=ROBOT), bench.now)
    assert bench.draw() == {'robot/base_link': bench.display.pose('base_link'),
                            'robot/arm': None, 'goal': None}
    base = Pose(place, from_yaw(yaw))
    arm = Pose((0.0, 0.0, 2.0), from_pitch(pitch))
    bench.transform('world', 'odom', Pose((1.0, 1.0, 0.0), IDENTITY), static=True)
    bench.transform('odom', 'base_link', base)
    bench.transform('base_link', 'arm', arm)
    poses = bench.draw()
    x, y, z = place
    assert poses['robot/base_link'].position == pytest.approx((x + 1.0, y + 1.0, z))
    assert poses['robot/arm'].position == pytest.approx((x + 1.0, y + 1.0, z + 2.0))
    turned = rotate(poses['robot/arm'].orientation, (1.0, 0.0, 0.0))
    assert turned == pytest.approx(
        (cos(yaw) * cos(pitch), sin(yaw) * cos(pitch), -sin(pitch)), abs=1e-9)


def test_a_robot_alone_is_seen_without_a_world(bench):
    bench.display.hear_description(String(data=ROBOT), bench.now)
    bench.transform('base_link', 'arm', Pose((0.0, 0.0, 2.0), IDENTITY))
    poses = bench.draw()
    assert poses['robot/base_link'].position == (0.0, 0.0, 0.0)
    assert poses['robot/arm'].position == (0.0, 0.0, 2.0)
    bench.transform('world', 'base_link', Pose((5.0, 0.0, 0.0), IDENTITY))
    assert bench.draw()['robot/arm'].position == pytest.approx((5.0, 0.0, 2.0))


def test_another_robot_takes_the_place_of_the_first(bench):
    bench.display.hear_description(String(data=ROBOT), bench.now)
    assert bench.warnings == [
        'The viewer draws boxes, cylinders and spheres, not the mesh of link arm']
    bench.display.hear_description(
        String(data='<robot name="x"><link name="one"><visual><geometry><box size="1 1 1"/>'
                    '</geometry></visual></link></robot>'), bench.now)
    assert [name for name in bench.paper.things if name.startswith('robot/')] == ['robot/one']
    bench.display.hear_description(String(data='no robot'), bench.now)
    assert bench.warnings[-1].startswith('The robot is not shown: robot_description is not XML')
    assert 'robot/one' in bench.paper.things


def test_markers_vanish_when_their_lifetime_is_over(bench):
    message = Marker(ns='catcher', type=Marker.TEXT_VIEW_FACING, text='Unreachable')
    message.header.frame_id = 'world'
    message.lifetime.sec = 3
    message.scale.z = 0.6
    bench.display.hear_marker('catcher_marker', message, bench.now)
    name = 'markers/catcher_marker/catcher/0'
    (shape,) = (bench.draw(), bench.paper.things[name])[1]
    assert (shape.kind, shape.text, shape.size[2]) == ('text', 'Unreachable', 0.6)
    assert name in bench.draw(after=3 * NANOSECONDS - 1)
    assert name not in bench.draw(after=1)


def test_a_marker_that_comes_again_lives_again(bench):
    lifetime = Marker().lifetime
    lifetime.sec = 1
    for _ in range(3):
        bench.marker(lifetime=lifetime)
        assert 'markers/catcher_marker/n/0' in bench.draw(after=NANOSECONDS - 1)
    assert 'markers/catcher_marker/n/0' not in bench.draw(after=1)


def test_markers_are_deleted(bench):
    for number in range(3):
        bench.marker(id=number)
        bench.marker('walls', id=number)
    bench.marker(id=1, action=Marker.DELETE)
    bench.marker(id=9, action=Marker.DELETE)
    assert len(bench.draw()) == 1 + 5
    bench.marker(action=Marker.DELETEALL)
    assert set(bench.draw()) == {'goal', *(f'markers/walls/n/{number}' for number in range(3))}


def test_a_locked_marker_goes_with_its_frame_and_another_stays(bench):
    bench.marker(id=1, frame='brick', frame_locked=True)
    bench.marker(id=2, frame='brick')
    poses = bench.draw()
    assert poses['markers/catcher_marker/n/1'] is None
    assert poses['markers/catcher_marker/n/2'] is None
    for height in (3.0, 2.0):
        bench.transform('world', 'brick', Pose((0.0, 0.0, height), IDENTITY))
        poses = bench.draw(after=NANOSECONDS)
        assert poses['markers/catcher_marker/n/1'].position[2] == height
        assert poses['markers/catcher_marker/n/2'].position[2] == 3.0


def test_a_stamped_marker_is_where_its_frame_was_then(bench):
    for height in (3.0, 2.0, 1.0):
        bench.transform('world', 'brick', Pose((0.0, 0.0, height), IDENTITY))
        bench.now += NANOSECONDS
    message = Marker(type=Marker.SPHERE)
    message.header.frame_id = 'brick'
    message.header.stamp = Time(nanoseconds=START + NANOSECONDS).to_msg()
    bench.display.hear_marker('catcher_marker', message, bench.now)
    assert bench.draw()['markers/catcher_marker//0'].position[2] == pytest.approx(2.0)


def test_marker_types():
    points = [Point(x=float(number)) for number in range(5)]
    marker = Marker(type=Marker.LINE_STRIP, points=points)
    marker.scale.x = 0.1
    assert [point[0] for point in shape_of(marker).points] == [0, 1, 1, 2, 2, 3, 3, 4]
    marker.type = Marker.LINE_LIST
    assert [point[0] for point in shape_of(marker).points] == [0, 1, 2, 3]
    assert shape_of(marker).pose.orientation == IDENTITY
    for kind, name in ((Marker.CUBE, 'box'), (Marker.SPHERE, 'sphere'),
                       (Marker.CYLINDER, 'cylinder')):
        marker.type = kind
        assert shape_of(marker).kind == name


@pytest.mark.parametrize(('changes', 'fault'), FAULTS)
@pytest.mark.parametrize('topic', ['walls', 'brick_marker', 'catcher_marker'])
def test_a_marker_that_cannot_be_is_left_out_in_a_sentence(bench, topic, changes, fault):
    bench.display.hear_marker(topic, harmless(), bench.now)
    before = set(bench.draw())
    for number in range(1, 4):
        marker = changed(harmless(), changes)
        marker.id = number
        bench.display.hear_marker(topic, marker, bench.now)
        assert set(bench.draw(after=NANOSECONDS)) == before
    assert bench.warnings == 3 * [f'A marker on {topic} is left out: {fault}']
    assert bench.topics == {topic}


def test_there_are_only_so_many_markers_of_a_topic(bench):
    for number in range(MOST_MARKERS + 1):
        bench.marker(id=number)
    bench.marker(id=0, frame='brick')
    bench.marker('walls')
    assert len(bench.draw()) == 1 + MOST_MARKERS + 1
    assert bench.warnings == ['A marker on catcher_marker is left out: '
                              f'there are {MOST_MARKERS} of them already']


def test_a_lifetime_is_over_too_when_time_goes_back(bench):
    bench.marker(lifetime=Duration(sec=3))
    assert 'markers/catcher_marker/n/0' in bench.draw()
    assert 'markers/catcher_marker/n/0' not in bench.draw(after=-3600 * NANOSECONDS)


EXTREMES = st.sampled_from([0.0, 1.0, -1.0, nan, inf, -inf, 1e308, -1e308, 1e9, 5e-324, 0.7])
SECONDS = st.sampled_from([0, 1, -1, -2**31, 2**31 - 1, 1_700_000_000])
NAMES = st.sampled_from(['', '/', 'world', 'brick', 'base_link', 'arm', 'odom', 'nowhere',
                         '/world', 'a b', '\x1b[2J', 'n' * 2000])
POINTS = st.builds(Point, x=EXTREMES, y=EXTREMES, z=EXTREMES)
VECTORS = st.builds(Vector3, x=EXTREMES, y=EXTREMES, z=EXTREMES)
ROTATIONS = st.builds(Quaternion, x=EXTREMES, y=EXTREMES, z=EXTREMES, w=EXTREMES)
STAMPS = st.builds(TimeMessage, sec=SECONDS, nanosec=st.integers(0, 2**32 - 1))
MARKERS = st.builds(
    changed, st.builds(
        Marker, ns=NAMES, id=st.integers(-1, 1), text=NAMES, frame_locked=st.booleans(),
        type=st.integers(-1, 12), action=st.sampled_from([0, 0, 0, 0, 1, 2, 3, -9]), scale=VECTORS,
        lifetime=st.builds(Duration, sec=SECONDS, nanosec=st.integers(0, 2**32 - 1)),
        points=st.lists(POINTS, max_size=3)),
    st.fixed_dictionaries({'header.frame_id': NAMES, 'header.stamp': STAMPS, 'color.a': EXTREMES,
                           'pose.position': POINTS, 'pose.orientation': ROTATIONS}))
GOALS = st.builds(changed, st.builds(PoseStamped), st.fixed_dictionaries(
    {'header.frame_id': NAMES, 'header.stamp': STAMPS, 'pose.position': POINTS}))
TRANSFORMS = st.builds(
    changed, st.builds(TransformStamped, child_frame_id=NAMES), st.fixed_dictionaries(
        {'header.frame_id': NAMES, 'header.stamp': STAMPS, 'transform.translation': VECTORS,
         'transform.rotation': ROTATIONS}))
TOPICS = ('walls', 'brick_marker', 'catcher_marker')
MESSAGES = st.one_of(
    st.tuples(st.just('hear_marker'), st.sampled_from(TOPICS), MARKERS),
    st.tuples(st.just('hear_goal'), GOALS),
    st.tuples(st.just('hear_tilt'), st.builds(Tilt, angle=EXTREMES)),
    st.tuples(st.just('hear_transforms'), st.builds(
        TFMessage, transforms=st.lists(TRANSFORMS, max_size=3)), st.booleans()),
    st.tuples(st.just('hear_description'), st.builds(
        String, data=st.sampled_from([ROBOT, '', '<robot/>', ROBOT.replace('"1"', '"1e999"')]))))


@given(st.lists(st.tuples(MESSAGES, st.sampled_from([0, 1, 10**7, -10**12])), max_size=25))
def test_no_message_ends_it_or_gets_what_cannot_be_drawn_on_the_page(messages):
    bench = Bench()
    bench.paper.frames = True
    bench.display.hear_description(String(data=ROBOT), bench.now)
    bench.transform('world', 'base_link', Pose((1.0, 2.0, 0.0), IDENTITY))
    bench.transform('world', 'brick', Pose((1.0, 2.0, 3.0), IDENTITY))
    for (method, *arguments), after in messages:
        if method == 'hear_transforms':
            arguments.append(bench.now)
        getattr(bench.display, method)(*arguments, bench.now)
        for pose in filter(None, bench.draw(after).values()):
            assert all(abs(part) <= LARGEST for part in chain(*pose))
        for shape in chain(*bench.paper.things.values()):
            assert shape.undrawable() is None
        assert all(abs(value) <= LARGEST for value in bench.paper.texts['show_tilt'])
        walls = bench.display.walls()
        assert walls is None or all(abs(part) <= 4.0 * LARGEST for part in walls)
    assert bench.topics <= {*TOPICS, 'goal_pose', 'tilt', '/tf', '/tf_static',
                            'robot_description'}, 'no more kinds of warnings than topics'
    assert all(len(warning) <= LONGEST_WARNING and warning.isprintable()
               for warning in bench.warnings)


@given(st.tuples(*[st.floats(-3.0, 3.0)] * 2), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0),
       st.tuples(*[st.floats(-0.4, 0.4)] * 3), st.tuples(*[st.integers(0, 20_000_000)] * 3))
def test_a_brick_on_the_platform_is_drawn_there_whatever_comes_when(
        velocity, turning, tilting, place, delays):
    """Robot (100 Hz), platform (100 Hz) and brick (250 Hz) have different delays."""
    def robot(time):
        return Pose((5.0 + velocity[0] * time, 5.0 + velocity[1] * time, 0.0),
                    from_yaw(turning * time))

    def platform(time):
        return Pose((0.0, 0.0, 1.5), from_pitch(tilting * time))

    def brick(time):
        return Pose(place, from_yaw(0.3))

    bench = Bench()
    bench.display.hear_description(
        String(data=ROBOT.replace('arm', 'platform')), bench.now)
    bench.transform('world', 'odom', Pose((1.0, 1.0, 0.0), IDENTITY), static=True)
    coming = []
    for parent, child, where, period, delay in (
            ('odom', 'base_link', robot, 10_000_000, delays[0]),
            ('base_link', 'platform', platform, 10_000_000, delays[1]),
            ('platform', 'brick', brick, 4_000_000, delays[2])):
        coming += [(stamp + delay, stamp, parent, child, where(stamp / NANOSECONDS))
                   for stamp in range(delay % period, NANOSECONDS // 2, period)]
    coming.sort(key=lambda entry: entry[0])
    bench.brick(Phase.RIDING)
    pictures = 0
    for now in range(NANOSECONDS // 15, NANOSECONDS // 2, NANOSECONDS // 30):
        while coming and coming[0][0] <= now:
            _, stamp, parent, child, pose = coming.pop(0)
            bench.now = START + stamp
            bench.transform(parent, child, pose)
        bench.now = START + now
        poses = bench.draw()
        plate, box = poses['robot/platform'], poses['markers/brick_marker/brick/0']
        expected = rotate(plate.orientation, place)
        assert dist([a + b for a, b in zip(plate.position, expected)], box.position) < 1e-9
        assert dist(rotate(box.orientation, (1.0, 0.0, 0.0)), rotate(
            plate.orientation, rotate(from_yaw(0.3), (1.0, 0.0, 0.0)))) < 1e-9
        base = poses['robot/base_link']
        assert dist(base.position, plate.position) == pytest.approx(1.5, abs=1e-9)
        assert bench.paper.poses['robot/platform'] == bench.display.drawn('platform')
        pictures += 1
    assert pictures == 14


def test_a_brick_that_changes_its_parent_is_drawn_all_the_time(bench):
    for step in range(100):
        bench.now += NANOSECONDS // 250
        height = 3.0 - step / 100.0
        bench.transform('world', 'base_link', Pose((0.0, 0.0, 1.0), IDENTITY))
        if step % 40 < 20:
            bench.transform('world', 'brick', Pose((0.0, 0.0, height), IDENTITY))
        else:
            bench.transform('base_link', 'brick', Pose((0.0, 0.0, height - 1.0), IDENTITY))
        bench.brick(Phase.RIDING)
        assert bench.draw()['markers/brick_marker/brick/0'].position[2] == pytest.approx(height)
    assert dict(bench.display.rates(bench.now))['brick (TF)'] == pytest.approx(250.0)


def test_a_transform_that_could_spoil_the_others_is_left_out(bench):
    bench.transform('world', 'brick', Pose((0.0, 0.0, 3.0), IDENTITY))
    bench.brick(Phase.HOVERING)
    for parent, child, pose in (
            ('world', 'brick', Pose((0.0, nan, 3.0), IDENTITY)),
            ('world', 'brick', Pose((0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 0.0))),
            ('nowhere', 'brick', Pose((0.0, 0.0, 1.0), IDENTITY))):
        bench.transform(parent, child, pose)
    bench.now += 6 * NANOSECONDS
    bench.transform('world', 'odom', Pose((0.0, 0.0, 0.0), IDENTITY))
    bench.now -= 6 * NANOSECONDS
    assert bench.draw()['markers/brick_marker/brick/0'].position == (0.0, 0.0, 3.0)
    assert len(bench.warnings) == 3
    assert all('"brick"' in warning for warning in bench.warnings)


def test_the_clock_may_go_back(bench):
    bench.transform('world', 'brick', Pose((0.0, 0.0, 3.0), IDENTITY))
    bench.now -= 3600 * NANOSECONDS
    bench.transform('world', 'brick', Pose((0.0, 0.0, 2.0), IDENTITY))
    bench.brick(Phase.HOVERING)
    assert bench.draw()['markers/brick_marker/brick/0'].position == (0.0, 0.0, 2.0)
    assert not bench.warnings


def test_what_has_stopped_coming_is_where_it_was_last_and_holds_nothing_up(bench):
    bench.display.hear_description(String(data=ROBOT), bench.now)
    bench.brick(Phase.HOVERING)
    bench.transform('world', 'brick', Pose((0.0, 0.0, 3.0), IDENTITY))
    for step in range(1, 101):
        bench.now += NANOSECONDS // 50
        bench.transform('world', 'base_link', Pose((0.1 * step, 0.0, 0.0), IDENTITY))
        bench.transform('base_link', 'arm', Pose((0.0, 0.0, 2.0), IDENTITY))
        poses = bench.draw()
    assert poses['markers/brick_marker/brick/0'].position == (0.0, 0.0, 3.0)
    assert poses['robot/base_link'].position[0] == pytest.approx(10.0)
    assert poses['robot/arm'].position[0] == pytest.approx(10.0)


def test_the_four_frames_can_be_switched_on_and_off(bench):
    bench.transform('world', 'odom', Pose((1.0, 2.0, 0.0), IDENTITY), static=True)
    bench.draw()
    assert not bench.paper.axes
    bench.paper.frames = True
    poses = bench.draw()
    assert bench.paper.axes == {f'frames/{name}' for name in (
        'world', 'odom', 'base_link', 'brick')}
    assert poses['frames/odom'].position == pytest.approx((1.0, 2.0, 0.0))
    assert poses['frames/base_link'] is None
    bench.paper.frames = False
    bench.draw()
    assert not bench.paper.axes


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(0.0, 3.0))
def test_the_curves_are_what_was_heard(speed_x, speed_y, falling):
    bench = Bench()
    bench.transform('world', 'odom', Pose((5.0, 5.0, 0.0), IDENTITY), static=True)
    for step in range(300):
        bench.now = START + step * NANOSECONDS // 100
        time = step / 100.0
        bench.transform('odom', 'base_link', Pose((speed_x * time, speed_y * time, 0.0), IDENTITY))
        bench.transform('world', 'brick', Pose((5.0, 7.0, 9.0 - falling * time), IDENTITY))
        if step % 3 == 0:
            bench.draw()
    (history,) = bench.paper.texts['show_history']
    times, heights, distances, speeds = history.columns()
    assert [round(-10.0 * time) for time, height in zip(times, heights)
            if height is not None] == list(range(29, -1, -1)), 'one per period'
    # A sample is that of the first picture in its period.
    pictures = [min(step for step in range(0, 300, 3) if step >= 10 * number) / 100.0
                for number in range(30)]
    samples = list(zip(heights, distances, speeds))[-30:]
    for number, (height, distance, speed) in enumerate(samples):
        time = pictures[number]
        assert height == pytest.approx(9.0 - falling * time, abs=1e-3)
        assert distance == pytest.approx(
            dist((speed_x * time, speed_y * time), (0.0, 2.0)), abs=1e-3)
        assert speed == (None if number == 0 else
                         pytest.approx(hypot(speed_x, speed_y), abs=1e-3))


def test_of_what_is_not_in_sight_there_is_no_curve(bench):
    bench.draw()
    columns = bench.paper.texts['show_history'][0].columns()
    assert all(set(column) == {None} for column in columns[1:])
    bench.transform('world', 'brick', Pose((5.0, 7.0, 9.0), IDENTITY))
    bench.draw(after=NANOSECONDS)
    _, heights, distances, speeds = bench.paper.texts['show_history'][0].columns()
    assert (heights[-1], distances[-1], speeds[-1]) == (9.0, None, None)


@given(st.lists(st.tuples(COORDINATES, COORDINATES, st.booleans()), min_size=1, max_size=5))
def test_a_robot_that_is_followed_stays_where_it_is_in_the_picture(steps):
    bench = Bench()
    bench.transform('world', 'odom', Pose((5.0, 5.0, 0.0), IDENTITY), static=True)
    for x, y, bench.paper.follow in steps:
        bench.now += NANOSECONDS
        bench.transform('odom', 'base_link', Pose((x, y, 0.0), from_yaw(x)))
        bench.draw()
        robot = bench.display.drawn('base_link').position
        expected = robot[:2] if bench.paper.follow else (ARENA_CENTER, ARENA_CENTER)
        assert bench.paper.focus == expected


def test_a_robot_without_an_arena_is_in_the_middle_of_the_picture(bench):
    bench.draw()
    assert bench.paper.focus == (ARENA_CENTER, ARENA_CENTER)
    bench.display.hear_description(String(data=ROBOT), bench.now)
    bench.draw()
    assert bench.paper.focus == (0.0, 0.0)
    bench.transform('world', 'base_link', Pose((1.0, 1.0, 0.0), IDENTITY))
    bench.draw()
    assert bench.paper.focus == (ARENA_CENTER, ARENA_CENTER)


def test_the_legend_has_the_colors_of_the_markers(bench):
    bench.draw()
    assert bench.paper.texts['show_legend'] == (BRICK_COLORS,)
    for phase in Phase:
        bench.brick(phase)
        bench.draw(after=NANOSECONDS)
        (legend,) = bench.paper.texts['show_legend']
        assert legend[phase] == pytest.approx(BRICK_COLORS[phase])
    marker = Marker(type=Marker.CUBE, text=Phase.FALLING.value)
    marker.header.frame_id = 'brick'
    marker.color.b = marker.color.a = 1.0
    bench.display.hear_marker('brick_marker', marker, bench.now)
    bench.draw(after=NANOSECONDS)
    (legend,) = bench.paper.texts['show_legend']
    assert legend[Phase.FALLING] == (0.0, 0.0, 1.0, 1.0), 'another arena may have its own colors'


def test_the_walls_tell_where_the_arena_is(bench):
    assert bench.display.walls() is None
    for marker in walls(10.0, 0.5).markers:
        bench.display.hear_marker('walls', marker, bench.now)
    bench.draw()
    assert bench.display.walls() == pytest.approx((0.0, 10.0, 0.0, 10.0), abs=0.1)


def test_the_brick_is_told_by_its_marker_and_its_frame(bench):
    bench.draw()
    assert bench.paper.texts['show_brick'] == ('no brick in sight', None)
    for phase in Phase:
        bench.brick(phase)
        bench.transform('world', 'brick', Pose((7.5, 7.0, 8.0), IDENTITY))
        bench.draw(after=NANOSECONDS)
        text, color = bench.paper.texts['show_brick']
        assert text == f'{phase.value}, 8.00 m up'
        assert color == pytest.approx(BRICK_COLORS[phase])
    assert bench.paper.place == (7.5, 7.0, 8.0)
    bench.marker('brick_marker', frame='brick')
    bench.draw(after=NANOSECONDS)
    assert bench.paper.texts['show_brick'] == ('brick, 8.00 m up', None)


def test_the_account_goes_with_the_goal_in_any_frame(bench):
    bench.transform('world', 'odom', Pose((5.0, 5.0, 0.0), from_yaw(pi / 2.0)), static=True)
    bench.transform('odom', 'base_link', Pose((0.0, 0.0, 0.0), IDENTITY))
    bench.transform('world', 'brick', Pose((5.0, 7.0, 8.0), IDENTITY))
    bench.brick(Phase.FALLING)
    goal = PoseStamped()
    goal.header.frame_id = 'odom'
    goal.pose.position.x = 2.0
    bench.display.hear_goal(goal, bench.now)
    assert bench.draw()['goal'].position == pytest.approx((5.0, 7.0, 0.0))
    assert bench.paper.texts['show_account'] == ('Reachable: driving under the brick', False)
    bench.transform('odom', 'base_link', Pose((2.0, 0.0, 0.0), IDENTITY))
    assert bench.draw()['goal'] is None
    bench.marker(type=Marker.TEXT_VIEW_FACING, text='Unreachable')
    bench.draw(after=NANOSECONDS)
    assert bench.paper.texts['show_account'][1] is True


def test_nonsense_changes_nothing(bench):
    bench.display.hear_tilt(Tilt(angle=0.5), bench.now)
    bench.display.hear_tilt(Tilt(angle=nan), bench.now)
    goal = PoseStamped()
    goal.header.frame_id = 'nowhere'
    bench.display.hear_goal(goal, bench.now)
    goal.header.frame_id = 'world'
    goal.pose.position.x = nan
    bench.display.hear_goal(goal, bench.now)
    assert bench.warnings == [
        'A tilt is not shown: it is nan rad',
        "A goal is not shown: its frame 'nowhere' is unknown",
        'A goal is not shown: a coordinate is nan']
    bench.transform('world', 'base_link', Pose((0.0, 0.0, 0.0), IDENTITY))
    assert bench.draw()['goal'] is None
    assert bench.paper.texts['show_tilt'] == (0.5,)


@pytest.mark.parametrize(('changes', 'refused'), [
    ({}, True), ({'text': 'unreachable'}, False), ({'text': 'Hello'}, False),
    ({'text': ''}, False), ({'action': 1}, False), ({'action': Marker.DELETE}, False),
    ({'type': Marker.CUBE}, False), ({'lifetime': Duration(sec=-1)}, False)])
def test_only_the_text_unreachable_calls_a_brick_unreachable(bench, changes, refused):
    bench.brick(Phase.FALLING)
    bench.marker(**{'type': Marker.TEXT_VIEW_FACING, 'text': 'Unreachable', **changes})
    bench.draw()
    assert bench.paper.texts['show_account'] == (
        ('Unreachable', True) if refused else ('The brick falls', False))


def test_a_goal_without_a_frame_is_in_the_world(bench):
    bench.transform('world', 'base_link', Pose((0.0, 0.0, 0.0), IDENTITY))
    goal = PoseStamped()
    goal.pose.position.x = 3.0
    bench.display.hear_goal(goal, bench.now)
    assert bench.draw()['goal'].position == (3.0, 0.0, 0.0)


def test_rates_are_told_by_the_name_that_is_heard(bench):
    bench.draw()
    assert bench.paper.texts['show_rates'] == (
        [('cmd_vel', None), ('odom', None), ('joint_states', None), ('brick (TF)', None)],)
    for step in range(400):
        bench.now += NANOSECONDS // 100
        bench.display.hear_of('turtle1/cmd_vel', bench.now)
        bench.transform('world', 'brick', Pose((0.0, 0.0, 1.0), IDENTITY))
    bench.draw()
    (rates,) = bench.paper.texts['show_rates']
    assert [name for name, _ in rates] == ['turtle1/cmd_vel', 'odom', 'joint_states', 'brick (TF)']
    assert rates[0][1] == pytest.approx(100.0)
    assert rates[3][1] == pytest.approx(100.0)


def test_the_texts_change_no_more_than_five_times_per_second(bench):
    changes = []
    bench.paper.show_tilt = changes.append
    for _ in range(31):
        bench.draw(after=NANOSECONDS // 30)
    assert 4 <= len(changes) <= 6


def test_the_arena_tells_every_phase_by_a_color_of_its_own():
    assert set(BRICK_COLORS) == set(Phase)
    assert len(set(BRICK_COLORS.values())) == len(Phase)


def test_the_orientation_of_a_marker_is_kept(bench):
    pose = Marker().pose
    quaternion = multiply(from_yaw(0.3), from_pitch(0.4))
    (pose.orientation.x, pose.orientation.y, pose.orientation.z,
     pose.orientation.w) = quaternion
    bench.marker(pose=pose)
    bench.draw()
    (shape,) = bench.paper.things['markers/catcher_marker/n/0']
    assert shape.pose.orientation == pytest.approx(quaternion)
