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

from math import cos, dist, hypot, isnan, nan, pi, sin
from unittest.mock import Mock

from geometry_msgs.msg import PoseStamped
from hypothesis import given
from hypothesis import strategies as st
from laws import law
import pytest
from rclpy.time import Time
from std_msgs.msg import String
from tf2_ros import Buffer
from turtle_brick.arena import brick_marker
from turtle_brick.core.geometry import from_pitch, from_yaw, IDENTITY, Pose, rotate
from turtle_brick.core.time_steps import NS_PER_SECOND
from turtle_brick.physics import Phase
from turtle_brick.ros.tf import transform_message
from turtle_brick.view.page import Page
from turtle_brick.view.shapes import ORIGIN
from turtle_brick_interfaces.msg import Tilt
from visualization_msgs.msg import Marker, MarkerArray

START = 1_700_000_000 * NS_PER_SECOND
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


class Bench:
    """A page without a browser, and the messages for it."""

    def __init__(self):
        """Begin with an empty page."""
        self.now = START
        self.scene, self.panel, self.warn = Mock(), Mock(**{'frames.value': False}), Mock()
        self.buffer = Buffer()
        self.publishers = {}
        self.page = Page(self.scene, self.panel, self.buffer, self.warn,
                         lambda topic: self.publishers.get(topic, 0), lambda: self.now)

    def transform(self, parent, child, place=(0.0, 0.0, 0.0), turn=IDENTITY, static=False):
        """Send a transform."""
        message = transform_message(
            parent, child, Pose(place, turn), Time(nanoseconds=self.now).to_msg())
        if static:
            self.buffer.set_transform_static(message, 'test')
        else:
            self.buffer.set_transform(message, 'test')
            self.page.hear_transform(message)

    def brick(self, phase):
        """Send the brick's marker."""
        self.page.hear_marker('brick_marker', brick_marker(phase, (0.4, 0.2, 0.12)))

    def goal(self, x, y=0.0, frame='world'):
        """Send a goal."""
        goal = PoseStamped()
        goal.header.frame_id = frame
        goal.pose.position.x, goal.pose.position.y = x, y
        self.page.hear_goal(goal)

    def draw(self, after=0):
        """Draw, some time (ns) later; return the poses of all things."""
        self.now += after
        self.page.draw()
        return {name: thing.pose for name, thing in self.shown(self.scene.show).items()}

    def shown(self, how):
        """Return what was shown last in one of the ways of scene and panel."""
        return how.call_args.args[0]


@pytest.fixture
def bench():
    """Return a page with a robot."""
    bench = Bench()
    bench.page.hear_description(String(data=ROBOT))
    return bench


@law(20)
@given(st.tuples(*[st.floats(-9.0, 9.0)] * 3), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_every_link_is_where_tf_says(place, yaw, pitch):
    bench = Bench()
    bench.page.hear_description(String(data=ROBOT))
    assert bench.draw() == {'robot/base_link': ORIGIN}, 'alone it is where its root is'
    bench.transform('world', 'brick', (7.0, 8.0, 9.0))
    assert bench.draw() == {}, 'beside a brick it is not known where it is'
    bench.transform('base_link', 'platform', (0.0, 0.0, 2.0), from_pitch(pitch))
    bench.transform('world', 'odom', (1.0, 1.0, 0.0), static=True)
    bench.transform('odom', 'base_link', place, from_yaw(yaw))
    poses = bench.draw()
    x, y, z = place
    assert poses['robot/base_link'].position == pytest.approx((x + 1.0, y + 1.0, z))
    assert poses['robot/platform'].position == pytest.approx((x + 1.0, y + 1.0, z + 2.0))
    assert rotate(poses['robot/platform'].orientation, (1.0, 0.0, 0.0)) == pytest.approx(
        (cos(yaw) * cos(pitch), sin(yaw) * cos(pitch), -sin(pitch)), abs=1e-9)
    assert bench.shown(bench.scene.keep_in_sight) == [
        *(pose.position for pose in poses.values()), (7.0, 8.0, 9.0), (7.0, 8.0, 0.0)]


def test_what_moves_together_is_drawn_at_one_instant(bench):
    """Robot (100 Hz), platform (100 Hz) and brick (250 Hz) have different delays."""
    bench.transform('world', 'odom', (1.0, 1.0, 0.0), static=True)
    bench.brick(Phase.RIDING)
    place = (0.3, -0.2, 0.1)
    for step in range(200):
        bench.now += NS_PER_SECOND // 1000
        if step % 10 == 0:
            bench.transform('odom', 'base_link', (0.003 * step, 0.0, 0.0), from_yaw(0.01 * step))
        if step % 10 == 4:
            bench.transform('base_link', 'platform', (0.0, 0.0, 1.5), from_pitch(0.002 * step))
        if step % 4 == 3:
            bench.transform('platform', 'brick', place)
        if step > 50:
            poses = bench.draw()
            platform = poses['robot/platform']
            assert dist(platform.transform(place), poses['brick_marker/brick/0'].position) < 1e-9
            assert dist(poses['robot/base_link'].position, platform.position) == (
                pytest.approx(1.5))


def test_what_has_stopped_coming_is_where_it_was_last_and_holds_nothing_up(bench):
    bench.brick(Phase.HOVERING)
    bench.transform('world', 'brick', (0.0, 0.0, 3.0))
    for step in range(1, 101):
        bench.now += NS_PER_SECOND // 50
        bench.transform('world', 'base_link', (0.1 * step, 0.0, 0.0))
        bench.transform('base_link', 'platform', (0.0, 0.0, 2.0))
        poses = bench.draw()
    assert poses['brick_marker/brick/0'].position == (0.0, 0.0, 3.0)
    assert poses['robot/base_link'].position[0] == pytest.approx(10.0)
    assert poses['robot/platform'].position[0] == pytest.approx(10.0)
    assert dict(bench.shown(bench.panel.show_rates))['brick (TF)'] is None


def test_the_frames_can_be_switched_on(bench):
    bench.transform('world', 'odom', (1.0, 2.0, 0.0), static=True)
    bench.transform('world', 'brick', (7.0, 7.0, 7.0))
    bench.panel.frames.value = True
    assert {name: pose.position for name, pose in bench.draw().items()} == {
        'frames/world': (0.0, 0.0, 0.0), 'frames/odom': (1.0, 2.0, 0.0),
        'frames/brick': (7.0, 7.0, 7.0)}


def test_the_curves_are_what_was_heard(bench):
    bench.draw()
    bench.transform('world', 'odom', (5.0, 5.0, 0.0), static=True)
    bench.now += NS_PER_SECOND
    for step in range(31):
        bench.transform('odom', 'base_link', (0.03 * step, -0.01 * step, 0.0))
        bench.transform('world', 'brick', (5.0, 7.0, 9.0 - 0.02 * step))
        bench.draw()
        bench.now += NS_PER_SECOND // 100
    (*before, last, now), = bench.panel.show_curves.call_args.args
    assert last[1:] == pytest.approx((8.6, hypot(0.6, 2.2), hypot(3.0, 1.0)))
    assert now[1:] == pytest.approx((8.4, hypot(0.9, 2.3), hypot(3.0, 1.0)))
    assert now[0] - last[0] == pytest.approx(0.1)
    assert all(map(isnan, before[0][1:3])), 'before anything was in sight'
    assert dict(bench.shown(bench.panel.show_rates))['brick (TF)'] == pytest.approx(100.0)


def test_the_brick_is_told_by_its_marker_and_its_frame(bench):
    bench.draw()
    assert bench.shown(bench.panel.show_brick) == 'no brick in sight'
    for phase in Phase:
        bench.brick(phase)
        bench.transform('world', 'brick', (7.5, 7.0, 8.0))
        bench.draw(after=NS_PER_SECOND)
        assert bench.shown(bench.panel.show_brick) == f'{phase.value}, 8.00 m up'
        assert bench.panel.suggest_place.called == (phase is Phase.HOVERING)
        bench.panel.suggest_place.reset_mock()


def test_a_goal_in_any_frame_is_marked_until_the_robot_is_there(bench):
    bench.transform('world', 'odom', (5.0, 5.0, 0.0), from_yaw(pi / 2.0), static=True)
    bench.transform('odom', 'base_link')
    bench.goal(2.0, frame='odom')
    assert bench.draw()['goal'].position == pytest.approx((5.0, 7.0, 0.0))
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
        bench.page.hear_marker('catcher_marker', Marker(type=Marker.TEXT_VIEW_FACING, **fields))
        bench.draw(after=NS_PER_SECOND)
        assert bench.panel.show_account.call_args.args == account
    bench.page.hear_state(String(data='unreachable: it is 0.009 s too early'))
    bench.draw(after=NS_PER_SECOND)
    bench.panel.show_account.assert_called_with('Unreachable: it is 0.009 s too early', True)


def test_rates_are_those_of_what_comes_and_parts_those_of_nodes(bench):
    bench.publishers = {'odom': 1}
    bench.draw()
    bench.panel.show_parts.assert_called_with(False, True, False)
    for period, count in ((NS_PER_SECOND // 10, 30), (NS_PER_SECOND // 100, 201)):
        for _ in range(count):
            bench.page.count('cmd_vel')
            bench.now += period
    bench.page.count('odom')
    bench.draw()
    assert bench.shown(bench.panel.show_rates) == [
        ('cmd_vel', pytest.approx(100.0, abs=0.1)), ('odom', None), ('joint_states', None),
        ('brick (TF)', None)]


def test_nonsense_changes_nothing_and_is_told(bench):
    bench.page.hear_description(String(data='no robot'))
    bench.transform('world', 'base_link')
    bench.page.hear_tilt(Tilt(angle=0.5))
    bench.page.hear_tilt(Tilt(angle=nan))
    bench.goal(1.0, frame='nowhere')
    bench.goal(nan)
    bench.page.hear_walls(MarkerArray(markers=[Marker(type=-1)]))
    (_, robot), wall = (call.args for call in bench.warn.call_args_list)
    assert robot.startswith('The robot is not shown: robot_description is not XML')
    assert wall == ('walls', 'A marker on walls is left out: its type is -1')
    assert set(bench.draw()) == {'robot/base_link'}
    bench.panel.show_tilt.assert_called_with(0.5)
