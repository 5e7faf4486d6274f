# SPDX-License-Identifier: Apache-2.0
"""Test the pages of the viewer and of joint_state_publisher_gui in a real browser."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib.util import find_spec
from io import BytesIO
from math import inf
from queue import Queue
from threading import Event
from time import monotonic

from browser import Chromium, find_chromium, TIMEOUT
from geometry_msgs.msg import PoseStamped
from installed import is_standin
from live_graph import add_nodes, LATCHED, LiveGraph, process
import numpy
import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from turtle_brick.core.parameters import load
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, ARENA_SIZE
from turtle_brick_tools.graph import executable
from turtle_graph.view.camera import MARGIN
from turtle_graph.view.viewer import Viewer

pytestmark = [
    pytest.mark.skipif(find_chromium() is None,
                       reason='Chromium is not installed. Run: apt-get install chromium'),
    pytest.mark.skipif(find_spec('viser') is None, reason='viser is not installed')]

CANVAS = 'document.querySelector("canvas[data-engine]")'
"""JavaScript expression for the canvas of the scene."""

CHART = 'Object.values(window.__viserTestpoints.uplots)[0].chart'
"""JavaScript expression for the chart with the plotted curves."""


ROBOT = """
<robot name="two_wheels">
  <link name="base"/><link name="left"/><link name="right"/>
  <joint name="left_joint" type="continuous"><parent link="base"/><child link="left"/></joint>
  <joint name="right_joint" type="continuous"><parent link="base"/><child link="right"/></joint>
</robot>
"""


def attempts(what: str) -> Iterator[None]:
    deadline = monotonic() + TIMEOUT
    while monotonic() < deadline:
        yield
    pytest.fail(f'{what} within {TIMEOUT:g} s')


class Page(Chromium):

    def has_text(self, name, text):
        """Return JavaScript code that checks whether a panel element contains a string."""
        return (f'(document.querySelector(\'[data-turtle-brick="{name}"]\') || '
                f'{{textContent: ""}}).textContent.includes({text!r})')

    def wait_for_text(self, name, text):
        self.wait_for(self.has_text(name, text))

    def wait_for_picture(self):
        from PIL import Image
        for _ in attempts('the colors of the brick, the robot and the platform did not appear'):
            picture = Image.open(BytesIO(self.screenshot(CANVAS))).convert('RGB')
            pixels = numpy.asarray(picture, float)
            red, green, blue = numpy.moveaxis(
                pixels / (pixels.sum(axis=2)[..., None] + 1.0), 2, 0)
            if all(mask.sum() > 20 for mask in (red > 0.5, green > 0.4, blue > 0.4)):
                return

    def enter_position(self, text, response, button=None):
        # The page sometimes sends the input late or not at all.
        for _ in attempts(f'{response!r} did not appear'):
            self.click(*self.center_of('document.querySelector("form input")'), times=3)
            self.insert_text(text)
            self.click_element('button', button) if button else self.press_enter()
            if self.becomes_true(self.has_text('response', response)):
                return

    def catch_brick(self, position):
        # On a busy machine, the catcher may refuse reachable bricks, or the robot may be late.
        for _ in attempts('the robot caught no brick'):
            self.enter_position(position, 'the brick hovers at', button='Place')
            # Wait until the robot is below the brick.
            self.wait_for(f'{CHART}.data[2].at(-1) < 0.2')
            self.click_element('button', 'Drop')
            self.wait_for_text('response', 'drop: the brick falls from')
            self.wait_for(f'{self.has_text("brick", "floating")} || '
                          f'{self.has_text("brick", "grounded")}')
            if self.evaluate(self.has_text('brick', 'floating')):
                return

    def click_ground(self, x, y, goals):
        left, top, width, height = self.box_of(CANVAS)
        scale = height / (ARENA_SIZE + 2.0 * MARGIN)
        for _ in attempts(f'({x}, {y}) did not become the goal'):
            self.click_element('button', 'From above')
            self.click(left + width / 2.0 + scale * (x - ARENA_CENTER),
                       top + height / 2.0 - scale * (y - ARENA_CENTER))
            point = goals.get(timeout=TIMEOUT).pose.position
            if (point.x, point.y) == pytest.approx((x, y), abs=0.1):
                return


@contextmanager
def running_graph(domain_id):
    goals, end = Queue(), Event()
    with LiveGraph(domain_id, quiet=True) as live, ThreadPoolExecutor() as pool:
        add_nodes(live)
        live.listener.create_subscription(PoseStamped, 'goal_pose', goals.put, 10)
        viewer = live.add(Viewer, '-p', 'port:=0', parameters=False)
        spinning = pool.submit(live.spin_until, end.is_set, inf, 'the end of the test')
        try:
            yield viewer.server.url, goals
        finally:
            end.set()
            spinning.result()


@pytest.fixture(scope='module')
def page():
    with Page(720, 400) as page:
        yield page


@pytest.mark.skipif(not is_standin('joint_state_publisher'),
                    reason='the installed joint_state_publisher_gui is the real one')
def test_buttons_on_the_page_move_the_joints(page, domain_id):
    command = [executable('joint_state_publisher_gui', 'joint_state_publisher_gui')]
    with LiveGraph(domain_id) as live, process(command, domain_id) as sliders:
        live.publisher('robot_description', String, LATCHED).publish(String(data=ROBOT))
        states = live.record('joint_states', JointState)
        page.go_to(sliders.wait_for_output(r'Joint State Publisher: (\S+)', TIMEOUT)[1])
        # The page has no 3D scene.
        page.wait_for(f'{CANVAS} && {CANVAS}.getBoundingClientRect().width < innerWidth / 4')
        for name, moved in (('Randomize', True), ('Center', False)):
            button = f'[...document.querySelectorAll("button")].find(b => b.innerText == {name!r})'
            page.wait_for(button)
            page.evaluate(f'{button}.click()')  # A mouse click could miss a moving button.
            live.wait_for(lambda: states.last and states.last.position and all(
                (position != 0.0) is moved for position in states.last.position), TIMEOUT, name)
        assert states.last.name == ['left_joint', 'right_joint']


def test_brick_is_shown_placed_and_caught_on_the_page(page, domain_id):
    x, y, z = load().brick_start
    with running_graph(domain_id) as (url, goals):
        page.go_to(f'{url}/?fixedDpr=0.5')  # Draw only a quarter of the pixels.
        # The scene becomes narrower when the panel appears.
        page.wait_for(f'{CANVAS} && {CANVAS}.getBoundingClientRect().width < innerWidth')
        page.wait_for_text('brick', f'hovering, height {z:.2f} m')
        page.wait_for('[...document.querySelectorAll(\'[data-turtle-brick="rate"]\')]'
                      '.filter(rate => rate.textContent.endsWith(" Hz")).length === 4')
        page.wait_for_picture()

        page.enter_position(f'{x}, {y}, -1', 'below the ground')
        page.wait_for_text('brick', f'hovering, height {z:.2f} m')

        goal = (ARENA_CENTER + 1.0, ARENA_CENTER)
        page.click_ground(*goal, goals)

        page.catch_brick(f'{goal[0]:.2f}, {goal[1]:.2f}, 6')
        page.wait_for_text('status', 'Waiting for a brick to fall')
        page.wait_for(f'{CHART}.scales.y.max > 1')

        page.click_element('button', 'Replay at 1/8')
        page.wait_for_text('brick', 'Replay of the last drop')
        page.click_element('button', 'Replay')
        page.wait_for_text('brick', 'floating')
