# SPDX-License-Identifier: Apache-2.0

from itertools import permutations
from math import cos, dist, hypot, isnan, nan, pi, sin
from unittest.mock import Mock

from geometry_msgs.msg import PoseStamped
from hypothesis import given
from hypothesis import strategies as st
from laws import law
import pytest
from rclpy.time import Time
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer
from turtle_brick.arena import brick_marker
from turtle_brick.core.catch_logic import State
from turtle_brick.core.geometry import from_pitch, from_yaw, IDENTITY, Pose, rotate
from turtle_brick.core.parameters import default_path
from turtle_brick.core.time_steps import NS_PER_SECOND
from turtle_brick.physics import BrickState
from turtle_brick.ros.tf import transform_message
from turtle_graph.client.geometry import ORIGIN
from turtle_graph.view.page import Page
from turtle_graph.view.replay import Replay, Snapshot
from turtle_graph.view.settings import read_settings, Settings
from turtle_graph.view.shapes import SceneObject
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

CONFIG = """
Visualization Manager:
  Displays:
  - {Class: rviz_default_plugins/TF}
  - {Class: rviz_default_plugins/RobotModel, Description Source: File, Description File: %s}
  Global Options: {Fixed Frame: map}
"""

CATCHER_STATES = {state.value for state in State}
WAITING = 'Waiting for a brick to fall'
FALLING = 'The brick is falling'
DRIVING = 'Reachable: driving under the brick'
REASON = 'the robot needs 1 s, 0.009 s too long'
GROUNDED = f'The unreachable brick fell to the ground: {REASON}'
MISSED = 'Missed: the brick fell to the ground'


class PageBench:
    """A page with a mock scene and a mock panel."""

    def __init__(self, settings=Settings()):
        self.now = START
        self.scene, self.panel, self.warn = Mock(), Mock(**{'frames.value': False}), Mock()
        self.has_robot = False
        self.page = Page(self.scene, self.panel, Buffer(), settings, self.warn,
                         lambda: (False, self.has_robot, False), lambda: self.now)

    def send_transform(self, parent, child, position=(0.0, 0.0, 0.0), rotation=IDENTITY,
                       static=False):
        self.page.on_transforms(static, TFMessage(transforms=[transform_message(
            parent, child, Pose(position, rotation), Time(nanoseconds=self.now).to_msg())]))

    def send_brick(self, state):
        self.page.on_markers('brick_marker', brick_marker(state, (0.4, 0.2, 0.12)))
        self.page.on_text('brick_state', String(data=state.value))

    def status_after(self, *events):
        """Send events to the page, and return the displayed status and whether it is an alarm."""
        for event in events:
            topic = 'catcher_state' if event in CATCHER_STATES else 'brick_state'
            self.page.on_text('catcher_decision' if ': ' in event else topic, String(data=event))
        self.draw(after=NS_PER_SECOND)
        return self.panel.show_status.call_args.args

    def send_goal(self, x, y=0.0, frame='world'):
        goal = PoseStamped()
        goal.header.frame_id = frame
        goal.pose.position.x, goal.pose.position.y = x, y
        self.page.on_goal(goal)

    def draw(self, after=0):
        """Advance the time by `after` (ns), draw the page and return the poses of all objects."""
        self.now += after
        self.page.draw()
        objects = self.last_argument(self.scene.show)
        return {name: scene_object.pose for name, scene_object in objects.items()}

    def last_argument(self, method):
        return method.call_args.args[0]


@pytest.fixture
def bench():
    bench = PageBench()
    bench.page.on_description(String(data=ROBOT))
    return bench


def test_moving_frames_can_be_shown_and_a_configuration_adds_static_frames(bench):
    configured = PageBench(Settings(
        'odom', shows_frames=True, hidden_frames=frozenset({'brick'})))
    for one in (bench, configured):
        one.send_transform('world', 'odom', (1.0, 2.0, 0.0), static=True)
        one.send_transform('world', 'brick', (7.0, 7.0, 7.0))
        one.panel.frames.value = True
    assert {name: pose.position for name, pose in bench.draw().items()} == {
        'frames/world': (0.0, 0.0, 0.0), 'frames/brick': (7.0, 7.0, 7.0)}
    assert {name: pose.position for name, pose in configured.draw().items()} == {
        'frames/world': (-1.0, -2.0, 0.0), 'frames/odom': (0.0, 0.0, 0.0)}
    configured.panel.show_fixed_frame.assert_called_with('odom', True)


def test_panel_names_the_links_that_are_hidden_and_the_reason(bench):
    empty = PageBench()
    for one in (empty, bench):
        one.draw()
    assert empty.last_argument(empty.panel.show_hidden_links) == []
    bench.panel.show_hidden_links.assert_called_with(
        ['platform'], 'no joint_states are received')
    bench.page.record_arrival('joint_states')
    bench.page.record_arrival('joint_states')
    bench.send_transform('base_link', 'platform')
    bench.draw(after=NS_PER_SECOND)
    assert bench.last_argument(bench.panel.show_hidden_links) == []


def test_curves_show_height_distance_and_speed(bench):
    bench.draw()
    bench.send_transform('world', 'odom', (5.0, 5.0, 0.0), static=True)
    bench.now += NS_PER_SECOND
    for step in range(61):
        bench.send_transform('odom', 'base_link', (0.03 * step, -0.01 * step, 0.0))
        bench.send_transform('world', 'brick', (5.0, 7.0, 9.0 - 0.02 * step))
        bench.draw()
        bench.now += NS_PER_SECOND // 100
    (*before, last, now), = bench.panel.show_curves.call_args.args
    assert last[1:] == pytest.approx((8.0, hypot(1.5, 2.5), hypot(3.0, 1.0)))
    assert now[1:] == pytest.approx((7.8, hypot(1.8, 2.6), hypot(3.0, 1.0)))
    assert now[0] - last[0] == pytest.approx(0.1)
    assert all(map(isnan, before[0][1:3])), 'the values before the first transform are unknown'
    rates = dict(bench.last_argument(bench.panel.show_rates))
    assert rates['brick (TF)'] == pytest.approx(100.0)


def test_panel_shows_state_and_height_of_the_brick(bench):
    bench.draw()
    assert bench.last_argument(bench.panel.show_brick) == 'height unknown'
    bench.send_transform('world', 'brick', (7.5, 7.0, 8.0))
    bench.draw(after=NS_PER_SECOND)
    assert bench.last_argument(bench.panel.show_brick) == 'height 8.00 m'
    for state in BrickState:
        bench.send_brick(state)
        bench.send_transform('world', 'brick', (7.5, 7.0, 8.0))
        bench.draw(after=NS_PER_SECOND)
        assert bench.last_argument(bench.panel.show_brick) == f'{state.value}, height 8.00 m'
        assert bench.panel.suggest_position.called == (state is BrickState.HOVERING)
        bench.panel.suggest_position.reset_mock()


def test_speed_is_constant_although_turtlesim_moves_in_ticks_of_16_ms(bench):
    bench.send_transform('world', 'odom', static=True)
    for cycle in range(200):
        bench.send_transform('odom', 'base_link', (3.0 * 0.016 * (10 * cycle // 16), 0.0, 0.0))
        bench.draw()
        bench.now += NS_PER_SECOND // 100
    *_, speeds = zip(*bench.last_argument(bench.panel.show_curves))
    assert speeds[-14:] == pytest.approx([3.0] * 14)


@pytest.mark.parametrize('story', [
    (('hovering', WAITING), ('falling', FALLING), ('reachable: 0.2 s to spare', DRIVING),
     ('approaching', DRIVING), ('riding', 'Caught'), ('carrying', 'Caught: carrying'),
     ('tilting', 'Caught: tilting'), ('leveling', 'Caught'), ('floating', WAITING),
     ('falling', FALLING), ('grounded', WAITING)),
    (('hovering', WAITING), ('falling', FALLING),
     (f'unreachable: {REASON}', f'Unreachable: {REASON}'), ('grounded', GROUNDED),
     ('', WAITING), ('hovering', WAITING), ('falling', FALLING))],
    ids=['caught', 'unreachable'])
def test_panel_shows_the_status_of_the_catch(bench, story):
    for event, text in story:
        assert bench.status_after(event) == (text, 'nreachable' in text)


@pytest.mark.parametrize(('topics', 'last', 'text'), [
    ((['falling', 'grounded'], [f'unreachable: {REASON}'], ['waiting']), [], GROUNDED),
    ((['falling'], ['reachable: 0.2 s to spare'], ['approaching']), ['grounded'], MISSED),
    ((['falling', 'riding'], ['reachable: 0.2 s to spare'], ['approaching', 'carrying']),
     [], 'Caught: carrying')],
    ids=['unreachable', 'missed', 'caught'])
def test_final_status_does_not_depend_on_the_order_of_topics(bench, topics, last, text):
    """The previous brick was unreachable."""
    numbers = [number for number, events in enumerate(topics) for _ in events]
    for order in set(permutations(numbers)):
        queues = [iter(events) for events in topics]
        status, _ = bench.status_after(
            'falling', 'unreachable: too high', 'grounded', 'hovering',
            *(next(queues[number]) for number in order), *last)
        assert status == text
        assert bench.status_after('hovering', 'falling') == (FALLING, False)


def test_replay_shows_the_last_drop_at_a_fraction_of_its_speed():
    replay = Replay()
    assert not replay.toggle(0, 1.0), 'no drop has been recorded'
    for step, state in enumerate(('hovering', 'falling', 'falling', 'riding', 'floating')):
        brick = SceneObject((), Pose((0.0, 0.0, 9.0 - step), from_yaw(0.2 * step)))
        replay.record(Snapshot(100 * step, {'brick': brick}, [brick.pose.position]), state)
    assert replay.toggle(1000, 0.125)
    for now, step in ((1000, 1.0), (1400, 1.5), (2000, 2.25)):
        brick = replay.snapshot(now).objects['brick']
        assert brick.pose.position == pytest.approx((0.0, 0.0, 9.0 - step))
        assert brick.pose.orientation == pytest.approx(from_yaw(0.2 * step), abs=1e-4)
    assert replay.snapshot(2600) is None and replay.snapshot(1400) is None, 'the replay has ended'


def test_page_shows_the_replay_until_a_second_click_or_a_new_drop(bench):
    bench.page.toggle_replay(1.0)
    bench.panel.show_response.assert_called_with('replay: no drop has been recorded', False)
    for state, height in ((BrickState.FALLING, 5.0), (BrickState.RIDING, 3.0),
                          (BrickState.HOVERING, 8.0)):
        bench.send_brick(state)
        bench.send_transform('world', 'brick', (0.0, 0.0, height))
        bench.draw(after=NS_PER_SECOND)
    for end in (lambda: bench.page.toggle_replay(1.0),
                lambda: bench.send_brick(BrickState.FALLING)):
        bench.page.toggle_replay(1.0)
        assert bench.draw(NS_PER_SECOND // 2)['brick_marker/brick/0'].position == (0.0, 0.0, 4.0)
        assert bench.last_argument(bench.scene.keep_in_view) == [(0.0, 0.0, 5.0), (0.0,) * 3]
        assert bench.last_argument(bench.panel.show_brick) == 'Replay of the last drop'
        end()
        assert bench.draw()['brick_marker/brick/0'].position == (0.0, 0.0, 8.0)


def test_goal_in_any_frame_is_marked_until_the_robot_arrives(bench):
    bench.send_transform('world', 'odom', (5.0, 5.0, 0.0), from_yaw(pi / 2.0), static=True)
    bench.send_transform('odom', 'base_link')
    bench.send_goal(2.0, frame='odom')
    assert bench.draw()['goal'].position == pytest.approx((5.0, 7.0, 0.0))
    bench.send_transform('odom', 'base_link', (1.94, 0.0, 0.0))
    assert 'goal' in bench.draw()
    bench.send_transform('odom', 'base_link', (1.96, 0.0, 0.0))
    assert 'goal' not in bench.draw()
    bench.send_goal(3.0, frame='')
    assert bench.draw()['goal'].position == (3.0, 0.0, 0.0), 'an empty frame means the world'


def test_panel_shows_message_rates_and_sections_of_running_nodes(bench):
    bench.has_robot = True
    bench.draw()
    bench.panel.show_sections.assert_called_with(False, True, False)
    for period, count in ((NS_PER_SECOND // 10, 30), (NS_PER_SECOND // 100, 201)):
        for _ in range(count):
            bench.page.record_arrival('cmd_vel')
            bench.now += period
    bench.page.record_arrival('odom')
    bench.draw()
    assert bench.last_argument(bench.panel.show_rates) == [
        ('cmd_vel', pytest.approx(100.0, abs=0.1)), ('odom', 0.0), ('joint_states', 0.0),
        ('brick (TF)', 0.0)]


def test_invalid_messages_are_ignored_with_one_warning_each(bench):
    bench.send_transform('world', 'base_link')
    bench.page.on_tilt(0.5)
    bench.page.on_tilt(nan)
    bench.send_goal(1.0, frame='nowhere')
    bench.send_goal(nan)
    for _ in range(2):
        bench.page.on_description(String(data='no robot'))
        bench.page.on_description(String(data=ROBOT.replace('<sphere radius="1"/>', '<mesh/>')))
        bench.page.on_markers('walls', MarkerArray(
            markers=[Marker(type=-1), Marker(type=Marker.POINTS)]))
    robot, mesh, *walls = (call.args[0] for call in bench.warn.call_args_list)
    assert robot.startswith('The robot is not shown: robot_description is not valid XML')
    assert mesh == 'The page cannot draw <mesh> in robot_description'
    assert walls == [
        'A marker on walls is not shown: the page cannot draw markers of type unknown',
        'A marker on walls is not shown: the page cannot draw markers of type POINTS']
    assert set(bench.draw()) == {'robot/base_link'}
    bench.panel.show_tilt.assert_called_with(0.5)


def test_objects_that_move_together_are_drawn_at_the_same_time(bench):
    """Transforms of the robot and platform (100 Hz) and the brick (250 Hz) arrive separately."""
    bench.send_transform('world', 'odom', (1.0, 1.0, 0.0), static=True)
    bench.send_brick(BrickState.RIDING)
    position = (0.3, -0.2, 0.1)
    for step in range(200):
        bench.now += NS_PER_SECOND // 1000
        if step % 10 == 0:
            bench.send_transform(
                'odom', 'base_link', (0.003 * step, 0.0, 0.0), from_yaw(0.01 * step))
        if step % 10 == 4:
            bench.send_transform(
                'base_link', 'platform', (0.0, 0.0, 1.5), from_pitch(0.002 * step))
        if step % 4 == 3:
            bench.send_transform('platform', 'brick', position)
        poses = bench.draw()
        if step > 50:
            platform = poses['robot/platform']
            brick = poses['brick_marker/brick/0']
            assert dist(platform.transform(position), brick.position) < 1e-9
            assert dist(poses['robot/base_link'].position, platform.position) == (
                pytest.approx(1.5))


def test_object_without_new_transforms_stays_and_does_not_delay_others(bench):
    bench.send_brick(BrickState.HOVERING)
    bench.send_transform('world', 'brick', (0.0, 0.0, 3.0))
    for step in range(1, 101):
        bench.now += NS_PER_SECOND // 50
        bench.send_transform('world', 'base_link', (0.1 * step, 0.0, 0.0))
        bench.send_transform('base_link', 'platform', (0.0, 0.0, 2.0))
        poses = bench.draw()
    assert poses['brick_marker/brick/0'].position == (0.0, 0.0, 3.0)
    assert poses['robot/base_link'].position[0] == pytest.approx(10.0)
    assert poses['robot/platform'].position[0] == pytest.approx(10.0)
    assert dict(bench.last_argument(bench.panel.show_rates))['brick (TF)'] == 0.0


@law(20)
@given(st.tuples(*[st.floats(-9.0, 9.0)] * 3), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_every_link_is_drawn_at_its_transform(position, yaw, pitch):
    bench = PageBench()
    bench.page.on_description(String(data=ROBOT))
    assert bench.draw() == {'robot/base_link': ORIGIN}, 'a robot alone is drawn in its root frame'
    assert not bench.scene.keep_in_view.call_args.args[1], 'the arena is unknown'
    bench.send_transform('world', 'brick', (7.0, 8.0, 9.0))
    assert bench.draw() == {}, 'the pose of the robot in the world is unknown'
    bench.send_transform('base_link', 'platform', (0.0, 0.0, 2.0), from_pitch(pitch))
    bench.send_transform('world', 'odom', (1.0, 1.0, 0.0), static=True)
    bench.send_transform('odom', 'base_link', position, from_yaw(yaw))
    poses = bench.draw()
    x, y, z = position
    assert poses['robot/base_link'].position == pytest.approx((x + 1.0, y + 1.0, z))
    assert poses['robot/platform'].position == pytest.approx((x + 1.0, y + 1.0, z + 2.0))
    assert rotate(poses['robot/platform'].orientation, (1.0, 0.0, 0.0)) == pytest.approx(
        (cos(yaw) * cos(pitch), sin(yaw) * cos(pitch), -sin(pitch)), abs=1e-9)
    assert bench.last_argument(bench.scene.keep_in_view) == [
        *(pose.position for pose in poses.values()), (7.0, 8.0, 9.0), (7.0, 8.0, 0.0)]
    assert bench.scene.keep_in_view.call_args.args[1], 'the arena is known'


def test_settings_are_read_from_the_configuration_files():
    directory = default_path().parent
    assert read_settings(str(directory / 'turtle_arena.rviz')) == Settings('world')
    run_turtle = read_settings(str(directory / 'run_turtle.rviz'))
    assert run_turtle.shows_frames and 'spokes' in run_turtle.hidden_frames
    assert 'odom' not in run_turtle.hidden_frames


def test_robot_description_is_read_from_a_file_and_unreadable_files_are_named(tmp_path):
    robot, path = tmp_path / 'robot.urdf', tmp_path / 'a.rviz'
    for content, named in (('[', f'{path} is not an'), (CONFIG % robot, f'{robot}: No such file')):
        path.write_text(content)
        with pytest.raises(ValueError, match=named):
            read_settings(str(path))
    robot.write_text('<robot/>')
    assert read_settings(str(path)) == Settings('map', shows_frames=True, description='<robot/>')
