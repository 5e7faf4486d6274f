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

from math import cos, dist, hypot, nan, pi, sin

from geometry_msgs.msg import PoseStamped
from hypothesis import given
from hypothesis import strategies as st
from laws import law
import pytest
from rclpy.time import Time
from std_msgs.msg import String
from tf2_ros import Buffer
from turtle_brick.arena import BRICK_COLORS, brick_marker
from turtle_brick.core.geometry import from_pitch, from_yaw, IDENTITY, Pose, rotate
from turtle_brick.core.time_steps import NANOSECONDS
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, ARENA_SIZE
from turtle_brick.physics import Phase
from turtle_brick.ros.tf import transform_message
from turtle_brick.view.camera import ABOVE, NEAR
from turtle_brick.view.page import Page
from turtle_brick.view.shapes import ORIGIN
from turtle_brick_interfaces.msg import Tilt
from visualization_msgs.msg import Marker

START = 1_700_000_000 * NANOSECONDS
ROBOT = """
<robot name="small">
  <link name="base_link">
    <visual><geometry><box size="1 1 1"/></geometry></visual>
  </link>
  <link name="platform">
    <visual><geometry><sphere radius="1"/></geometry></visual>
  </link>
  <joint name="j" type="continuous"><parent link="base_link"/><child link="platform"/></joint>
</robot>
"""


class Paper:
    """A scene and a panel without a browser."""

    def __init__(self):
        """Begin with an empty one."""
        self.frames = False
        self.things = {}
        self.points = {}
        self.texts = {}

    def show(self, things):
        """Note all that is in the scene."""
        self.things = things

    def keep_in_sight(self, points):
        """Note what the cameras see."""
        self.points = points

    def suggest_place(self, position):
        """Note the suggestion."""
        self.texts['place'] = position

    def __getattr__(self, name):
        """Note what the panel shows."""
        if not name.startswith('show_'):
            raise AttributeError(name)
        return lambda *values: self.texts.__setitem__(name.removeprefix('show_'), values)


class Bench:
    """A page that is drawn on paper, and the messages for it."""

    def __init__(self):
        """Begin with an empty page."""
        self.now = START
        self.paper = Paper()
        self.warnings = []
        self.buffer = Buffer()
        self.publishers = {}
        self.page = Page(self.paper, self.paper, self.buffer,
                         lambda topic, sentence: self.warnings.append((topic, sentence)),
                         lambda topic: self.publishers.get(topic, 0))

    def robot(self, description=ROBOT):
        """Send a robot's description."""
        self.page.hear_description(String(data=description))

    def transform(self, parent, child, place=(0.0, 0.0, 0.0), turn=IDENTITY, static=False):
        """Send a transform."""
        message = transform_message(
            parent, child, Pose(place, turn), Time(nanoseconds=self.now).to_msg())
        if static:
            self.buffer.set_transform_static(message, 'test')
        else:
            self.buffer.set_transform(message, 'test')
            self.page.hear_transform(message, self.now)

    def marker(self, topic, message=None, **fields):
        """Send a marker."""
        message = message or Marker(**fields)
        message.header.frame_id = message.header.frame_id or 'world'
        self.page.hear_marker(topic, message, self.now)

    def brick(self, phase):
        """Send the brick's marker."""
        self.marker('brick_marker', brick_marker(phase, (0.4, 0.2, 0.12)))

    def goal(self, x, y=0.0, frame='world'):
        """Send a goal."""
        goal = PoseStamped()
        goal.header.frame_id = frame
        goal.pose.position.x, goal.pose.position.y = x, y
        self.page.hear_goal(goal)

    def draw(self, after=0):
        """Draw, some time (ns) later; return the poses of all things."""
        self.now += after
        self.page.draw(self.now)
        return {name: thing.pose for name, thing in self.paper.things.items()}


def corners(bench):
    """Return the least and greatest coordinate (m) of what is seen from above."""
    points = bench.paper.points[ABOVE]
    least, greatest = min(points)[0], max(points)[0]
    assert set(points) == {(x, y, 0.0) for x in (least, greatest) for y in (least, greatest)}
    return pytest.approx(least), pytest.approx(greatest)


@pytest.fixture
def bench():
    """Return an empty page."""
    return Bench()


@law(20)
@given(st.tuples(*[st.floats(-9.0, 9.0)] * 3), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_every_link_is_where_tf_says(place, yaw, pitch):
    bench = Bench()
    bench.robot()
    assert bench.draw() == {'robot/base_link': ORIGIN}, 'alone it is where its root is'
    bench.transform('base_link', 'platform', (0.0, 0.0, 2.0), from_pitch(pitch))
    assert bench.draw()['robot/platform'].position == (0.0, 0.0, 2.0)
    assert corners(bench) == (-ARENA_CENTER, ARENA_CENTER)
    bench.transform('world', 'odom', (1.0, 1.0, 0.0), static=True)
    bench.transform('odom', 'base_link', place, from_yaw(yaw))
    poses = bench.draw()
    x, y, z = place
    assert poses['robot/base_link'].position == pytest.approx((x + 1.0, y + 1.0, z))
    assert poses['robot/platform'].position == pytest.approx((x + 1.0, y + 1.0, z + 2.0))
    assert rotate(poses['robot/platform'].orientation, (1.0, 0.0, 0.0)) == pytest.approx(
        (cos(yaw) * cos(pitch), sin(yaw) * cos(pitch), -sin(pitch)), abs=1e-9)
    assert corners(bench) == (0.0, ARENA_SIZE)


def test_a_robot_that_is_nowhere_yet_is_not_drawn_beside_a_brick(bench):
    bench.robot()
    bench.transform('world', 'brick', (7.0, 7.0, 7.0))
    assert bench.draw() == {} and corners(bench) == (0.0, ARENA_SIZE)


def test_another_robot_takes_the_place_of_the_first(bench):
    bench.robot()
    bench.robot('<robot name="x"><link name="one"><visual><geometry><box size="1 1 1"/>'
                '</geometry></visual></link></robot>')
    assert set(bench.draw()) == {'robot/one'}
    bench.robot('no robot')
    assert bench.warnings[-1][1].startswith(
        'The robot is not shown: robot_description is not XML')
    assert set(bench.draw()) == {'robot/one'}


@law(20)
@given(st.tuples(*[st.floats(-3.0, 3.0)] * 2), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0),
       st.tuples(*[st.floats(-0.4, 0.4)] * 3), st.tuples(*[st.integers(0, 20_000_000)] * 3))
def test_a_brick_on_the_platform_is_drawn_there_whatever_comes_when(
        velocity, turning, tilting, place, delays):
    """Robot (100 Hz), platform (100 Hz) and brick (250 Hz) have different delays."""
    links = (
        ('odom', 'base_link', 10_000_000, lambda time: (
            (5.0 + velocity[0] * time, 5.0 + velocity[1] * time, 0.0), from_yaw(turning * time))),
        ('base_link', 'platform', 10_000_000, lambda time: (
            (0.0, 0.0, 1.5), from_pitch(tilting * time))),
        ('platform', 'brick', 4_000_000, lambda time: (place, from_yaw(0.3))))
    bench = Bench()
    bench.robot()
    bench.transform('world', 'odom', (1.0, 1.0, 0.0), static=True)
    coming = [(stamp + delay, stamp, parent, child, *pose(stamp / NANOSECONDS))
              for (parent, child, period, pose), delay in zip(links, delays)
              for stamp in range(delay % period, NANOSECONDS // 4, period)]
    coming.sort(key=lambda entry: entry[0])
    bench.brick(Phase.RIDING)
    for now in range(NANOSECONDS // 15, NANOSECONDS // 4, NANOSECONDS // 30):
        while coming and coming[0][0] <= now:
            _, stamp, *transform = coming.pop(0)
            bench.now = START + stamp
            bench.transform(*transform)
        bench.now = START + now
        poses = bench.draw()
        plate, box = poses['robot/platform'], poses['brick_marker/brick/0']
        assert dist(plate.transform(place), box.position) < 1e-9
        assert dist(rotate(box.orientation, (1.0, 0.0, 0.0)), rotate(
            plate.orientation, rotate(from_yaw(0.3), (1.0, 0.0, 0.0)))) < 1e-9
        assert dist(poses['robot/base_link'].position, plate.position) == pytest.approx(1.5)


def test_what_has_stopped_coming_is_where_it_was_last_and_holds_nothing_up(bench):
    bench.robot()
    bench.brick(Phase.HOVERING)
    bench.transform('world', 'brick', (0.0, 0.0, 3.0))
    for step in range(1, 101):
        bench.now += NANOSECONDS // 50
        bench.transform('world', 'base_link', (0.1 * step, 0.0, 0.0))
        bench.transform('base_link', 'platform', (0.0, 0.0, 2.0))
        poses = bench.draw()
    assert poses['brick_marker/brick/0'].position == (0.0, 0.0, 3.0)
    assert poses['robot/base_link'].position[0] == pytest.approx(10.0)
    assert poses['robot/platform'].position[0] == pytest.approx(10.0)
    assert dict(bench.page.rates(bench.now))['brick (TF)'] is None


def test_the_frames_can_be_switched_on(bench):
    bench.transform('world', 'odom', (1.0, 2.0, 0.0), static=True)
    bench.transform('world', 'brick', (7.0, 7.0, 7.0))
    assert bench.draw() == {}
    bench.paper.frames = True
    assert {name: pose.position for name, pose in bench.draw().items()} == {
        'frames/world': (0.0, 0.0, 0.0), 'frames/odom': (1.0, 2.0, 0.0),
        'frames/brick': (7.0, 7.0, 7.0)}
    assert {thing.label for thing in bench.paper.things.values()} == {'world', 'odom', 'brick'}


def test_the_curves_are_what_was_heard(bench):
    bench.transform('world', 'odom', (5.0, 5.0, 0.0), static=True)
    for step in range(31):
        bench.transform('odom', 'base_link', (0.03 * step, -0.01 * step, 0.0))
        bench.transform('world', 'brick', (5.0, 7.0, 9.0 - 0.02 * step))
        bench.draw()
        bench.now += NANOSECONDS // 100
    ((times, heights, distances, speeds),) = bench.paper.texts['curves']
    assert (times[-2:], heights[-2:]) == ([-0.1, 0.0], [8.6, 8.4])
    assert distances[-2:] == pytest.approx([hypot(0.6, 2.2), hypot(0.9, 2.3)], abs=1e-3)
    assert speeds[-2:] == pytest.approx([hypot(3.0, 1.0)] * 2, abs=1e-3)
    assert {heights[0], distances[0], speeds[0]} == {None}, 'before anything was in sight'
    assert dict(bench.page.rates(bench.now))['brick (TF)'] == pytest.approx(100.0)


def test_robot_brick_and_the_ground_below_it_are_what_is_seen_from_near(bench):
    bench.draw()
    assert bench.paper.points[NEAR] == []
    bench.robot()
    bench.transform('world', 'base_link', (1.0, 2.0, 0.0))
    bench.transform('base_link', 'platform', (0.0, 0.0, 1.5))
    bench.draw()
    assert bench.paper.points[NEAR] == [(1.0, 2.0, 0.0), (1.0, 2.0, 1.5)]
    bench.transform('world', 'brick', (7.0, 8.0, 9.0))
    bench.draw()
    assert bench.paper.points[NEAR][2:] == [(7.0, 8.0, 9.0), (7.0, 8.0, 0.0)]


def test_the_brick_is_told_by_its_marker_and_its_frame(bench):
    bench.draw()
    assert bench.paper.texts['brick'] == ('no brick in sight', None)
    for phase in Phase:
        bench.brick(phase)
        bench.transform('world', 'brick', (7.5, 7.0, 8.0))
        bench.draw(after=NANOSECONDS)
        text, color = bench.paper.texts['brick']
        assert text == f'{phase.value}, 8.00 m up'
        assert color == pytest.approx(BRICK_COLORS[phase])
        assert bench.paper.texts.pop('place', None) == (
            (7.5, 7.0, 8.0) if phase is Phase.HOVERING else None)
    assert len(set(BRICK_COLORS.values())) == len(Phase), 'each has its own'
    bench.marker('brick_marker', type=Marker.CUBE)
    bench.draw(after=NANOSECONDS)
    assert bench.paper.texts['brick'] == ('brick, 8.00 m up', None)


def test_a_goal_in_any_frame_is_marked_until_the_robot_is_there_and_tells_what_it_is_for(bench):
    bench.transform('world', 'odom', (5.0, 5.0, 0.0), from_yaw(pi / 2.0), static=True)
    bench.transform('odom', 'base_link')
    bench.transform('world', 'brick', (5.0, 7.0, 8.0))
    bench.brick(Phase.FALLING)
    bench.goal(2.0, frame='odom')
    assert bench.draw()['goal'].position == pytest.approx((5.0, 7.0, 0.0))
    assert bench.paper.texts['account'] == ('Reachable: driving under the brick', False)
    bench.transform('odom', 'base_link', (1.94, 0.0, 0.0))
    assert 'goal' in bench.draw()
    bench.transform('odom', 'base_link', (1.96, 0.0, 0.0))
    assert 'goal' not in bench.draw()
    bench.goal(3.0, frame='')
    assert bench.draw()['goal'].position == (3.0, 0.0, 0.0), 'without a frame it is in the world'


def test_only_the_text_unreachable_calls_a_brick_unreachable(bench):
    bench.brick(Phase.FALLING)
    for fields, account in (
            ({'text': 'unreachable'}, ('The brick falls', False)),
            ({'text': 'Unreachable', 'action': Marker.DELETE}, ('The brick falls', False)),
            ({'text': 'Unreachable'}, ('Unreachable', True))):
        bench.marker('catcher_marker', type=Marker.TEXT_VIEW_FACING, **fields)
        bench.draw(after=NANOSECONDS)
        assert bench.paper.texts['account'] == account
    bench.page.hear_state(String(data='unreachable: it is 0.009 s too early'))
    bench.draw(after=NANOSECONDS)
    assert bench.paper.texts['account'] == ('Unreachable: it is 0.009 s too early', True)


def test_rates_are_those_of_what_comes_and_parts_those_of_nodes(bench):
    bench.publishers = {'odom': 1}
    bench.draw()
    assert bench.paper.texts['parts'] == (False, True, False)
    assert bench.paper.texts['rates'] == (
        [('cmd_vel', None), ('odom', None), ('joint_states', None), ('brick (TF)', None)],)
    for _ in range(201):
        bench.page.count('cmd_vel', bench.now)
        bench.now += NANOSECONDS // 100
    bench.draw()
    assert bench.paper.texts['rates'][0][:2] == [
        ('cmd_vel', pytest.approx(100.0)), ('odom', None)]


def test_nonsense_changes_nothing_and_is_told(bench):
    bench.transform('world', 'base_link')
    bench.page.hear_tilt(Tilt(angle=0.5))
    bench.page.hear_tilt(Tilt(angle=nan))
    bench.goal(1.0, frame='nowhere')
    bench.goal(nan)
    bench.marker('walls', type=-1)
    assert bench.warnings == [('walls', 'A marker on walls is left out: its type is -1')]
    assert bench.draw() == {}
    assert bench.paper.texts['tilt'] == (0.5,)
