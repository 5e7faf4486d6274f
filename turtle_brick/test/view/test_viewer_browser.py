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
"""The page in a real browser: what is seen on it, and what a click does in the graph."""

from importlib.util import find_spec
from io import BytesIO
from math import dist, tan
import re
from threading import Event, Thread
from time import monotonic

from browser import Chromium, find_chromium
from geometry_msgs.msg import PoseStamped
from live_graph import process
import numpy
import pytest
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.parameters import load
from turtle_brick.physics import Phase
from turtle_brick.tools.graph import executable, Graph
from turtle_referee.domains import reserved_domain
from witness import Witness

# Not skipped as a whole, which launch_testing's plugin would take for all files beside it as well.
if find_spec('viser') is not None:
    from turtle_brick.view import web_scene

pytestmark = [
    pytest.mark.skipif(find_chromium() is None,
                       reason='Chromium is not installed here: apt-get install chromium'),
    pytest.mark.skipif(find_spec('viser') is None,
                       reason='viser, which draws the page, is not installed here')]

TIMEOUT = 60.0
WIDTH, HEIGHT = 960, 480

BRICK = (7.0, 6.0, 6.0)
GROUND = (7.0, 4.5, 0.0)
"""A point of the ground that nothing hides."""

CANVAS = 'document.querySelector("canvas").getBoundingClientRect()'
"""A JavaScript expression for the part of the page with the scene."""


class Stage:
    """The graph, spinning in a thread."""

    def __init__(self, domain_id):
        """Start the graph."""
        self.graph = Graph(domain_id, overrides={'brick_start': list(BRICK)}, quiet=True)
        self.graph.add_turtlesim()
        self.graph.add_robot_state_publisher()
        self.graph.add_robot()
        self.arena = self.graph.add_arena()
        witness = self.graph.add(Witness, parameters=False)
        self.goals = witness.record(PoseStamped, 'goal_pose')
        self.graph.spin_until(lambda: self.arena.world.platform is not None, TIMEOUT, 'a robot')
        self.end, self.turned = Event(), Event()
        self.thread = Thread(target=self.spin)
        self.thread.start()

    def spin(self):
        """Spin the graph, while the test waits for the browser."""
        while not self.end.is_set():
            self.graph.executor.spin_once(timeout_sec=0.1)
            self.turned.set()
            self.turned.clear()

    def wait_for(self, condition, what):
        """Wait until a condition holds, while the graph spins."""
        deadline = monotonic() + TIMEOUT
        while not condition():
            assert monotonic() < deadline, f'{what}: not within {TIMEOUT:g} s'
            self.turned.wait(0.1)

    def close(self):
        """End the graph."""
        self.end.set()
        self.thread.join()
        self.graph.close()


@pytest.fixture(scope='module')
def domain():
    """Reserve a ROS domain for all tests of this file."""
    with reserved_domain() as domain:
        yield domain


@pytest.fixture(scope='module')
def stage(domain):
    """Return the graph."""
    patch = pytest.MonkeyPatch()
    patch.setenv('ROS_DOMAIN_ID', str(domain))
    stage = Stage(domain)
    yield stage
    stage.close()
    patch.undo()


@pytest.fixture(scope='module')
def url(stage, domain):
    """Return the address of the viewer's page."""
    command = [executable('turtle_brick', 'viewer'), '--ros-args', '-p', 'port:=0']
    with process(command, domain) as viewer:
        yield viewer.wait_for_output(r'Viewer: (\S+)', TIMEOUT).group(1)


@pytest.fixture(scope='module')
def browser(url):
    """Return a browser that shows the complete page."""
    with Chromium(WIDTH, HEIGHT) as browser:
        browser.go_to(f'{url}/?fixedDpr=1')
        browser.wait_for('document.querySelector("canvas")')
        browser.wait_for(shown('brick', 'hovering, 6.00 m up'))
        browser.wait_for(f'{CANVAS}.width < innerWidth')  # the panel is docked beside it
        yield browser


def shown(name, text):
    """Return a JavaScript expression that is true if an element of the panel has a text."""
    return (f'(document.querySelector(\'[data-turtle-brick="{name}"]\') || {{textContent: ""}})'
            f'.textContent.includes({text!r})')


def button(text):
    """Return a JavaScript expression for the button with a text."""
    return f'[...document.querySelectorAll("button")].find(one => one.innerText === {text!r})'


def pixel_of(browser, point, view=None):
    """Return where on the page a point of the world (m) is, by the rules of perspective."""
    view = view or web_scene.NEAR
    left, top, width, height = browser.evaluate(
        f'(box => [box.x, box.y, box.width, box.height])({CANVAS})')
    eye = numpy.array(view.position)
    forward = numpy.subtract(view.look_at, eye)
    forward /= numpy.linalg.norm(forward)
    right = numpy.cross(forward, (0.0, 0.0, 1.0))
    right /= numpy.linalg.norm(right)
    up = numpy.cross(right, forward)
    ray = numpy.subtract(point, eye)
    scale = height / 2.0 / tan(view.field_of_view / 2.0) / (ray @ forward)
    return (left + width / 2.0 + scale * (ray @ right), top + height / 2.0 - scale * (ray @ up))


def color_at(browser, picture, point, view=None):
    """Return the color of a picture of the page, as shares of red, green and blue, at a point."""
    x, y = map(round, pixel_of(browser, point, view))
    color = picture[y - 1:y + 2, x - 1:x + 2].mean(axis=(0, 1))
    return color / color.sum()


def picture_with(browser, point, looks, view=None):
    """Return a picture of the page once the color at a point looks as it should."""
    from PIL import Image
    for _ in range(20):
        picture = numpy.asarray(Image.open(BytesIO(browser.screenshot())).convert('RGB'), float)
        if looks(color_at(browser, picture, point, view)):
            return picture
    raise AssertionError(f'the color at {point} is {color_at(browser, picture, point, view)}')


def is_red(color):
    """Return whether a color is the brick's."""
    return color[0] > 0.5


def is_blue(color):
    """Return whether a color is the platform's."""
    return color[2] > 0.36 and color[2] > color[1] > color[0]


def test_robot_walls_and_brick_are_seen_where_they_are(browser, stage):
    def is_gray(color):
        return numpy.ptp(color) < 0.04

    x, y, z = BRICK
    picture = picture_with(browser, BRICK, is_red)
    assert not is_red(color_at(browser, picture, (x, y, z - 0.5)))
    assert is_blue(color_at(browser, picture, (*CENTER, load().platform_height))), 'the platform'
    assert is_gray(color_at(browser, picture, GROUND)), 'the ground'
    for point in ((3.0, 11.14, 0.25), (11.14, 6.0, 0.25)):
        wall = color_at(browser, picture, point)
        assert wall[2] > wall[0] + 0.03, 'the walls behind it'


def test_the_arena_is_seen_from_above_and_from_near_again(browser):
    browser.click(*browser.center_of(button('From above')))
    picture = picture_with(browser, (*CENTER, load().platform_height), is_blue, web_scene.ABOVE)
    for point in ((-0.05, 5.5, 0.5), (11.14, 5.5, 0.5), (5.5, -0.05, 0.5), (5.5, 11.14, 0.5)):
        wall = color_at(browser, picture, point, web_scene.ABOVE)
        assert wall[2] > wall[0] + 0.03, 'the walls around it'
    browser.click(*browser.center_of(button('Near')))
    picture_with(browser, BRICK, is_red)


def test_the_rates_are_shown(browser):
    browser.wait_for(
        '[...document.querySelectorAll(\'[data-turtle-brick="rates"] td:last-child\')]'
        '.every(cell => cell.textContent.endsWith(" Hz"))')
    text = browser.evaluate('document.querySelector(\'[data-turtle-brick="rates"]\').innerText')
    rates = dict(re.findall(r'(\S.*?)\s+([\d.]+) Hz', text))
    assert set(rates) == {'turtle1/cmd_vel', 'odom', 'joint_states', 'brick (TF)'}
    assert float(rates.pop('brick (TF)')) == pytest.approx(250.0, rel=0.08)
    assert all(float(rate) == pytest.approx(100.0, rel=0.08) for rate in rates.values())


def test_a_refused_place_shows_its_reason(browser, stage):
    field = '[...document.querySelectorAll("input")].filter(one => one.inputMode)[2]'
    x, y = browser.center_of(field)
    browser.click(x - 8.0, y, times=3)
    browser.write('-1')
    browser.click(*browser.center_of(button('Place')))
    browser.wait_for(shown('answer', 'place: '))
    answer = browser.evaluate(
        'document.querySelector(\'[data-turtle-brick="answer"]\').textContent')
    assert 'under the ground' in answer and '-1' in answer
    assert stage.arena.world.brick == BRICK


def test_a_click_on_the_ground_sends_the_robot(browser, stage):
    stage.goals.clear()
    browser.click(*pixel_of(browser, GROUND))
    stage.wait_for(lambda: stage.goals, 'a goal')
    ((_, goal),) = stage.goals
    assert goal.header.frame_id == 'world'
    assert goal.pose.position.x == pytest.approx(GROUND[0], abs=0.1)
    assert goal.pose.position.y == pytest.approx(GROUND[1], abs=0.1)


def test_a_robot_that_is_followed_is_seen_in_the_middle_and_sent_by_clicks(browser, stage):
    def has_arrived():
        platform = stage.arena.world.platform  # None while its transforms are late
        return platform and dist(platform.pose.position[:2], GROUND[:2]) < 0.1

    platform = (*CENTER, load().platform_height)
    stage.wait_for(has_arrived, 'the robot has arrived')
    box = ('document.getElementById([...document.querySelectorAll("label")]'
           '.find(one => one.innerText === "follow robot").htmlFor)')
    picture_with(browser, platform, lambda color: not is_blue(color))
    browser.click(*browser.center_of(box))
    picture_with(browser, platform, is_blue)
    stage.goals.clear()
    browser.click(*pixel_of(browser, GROUND))
    stage.wait_for(lambda: stage.goals, 'a goal')
    ((_, goal),) = stage.goals
    assert goal.pose.position.x == pytest.approx(2.0 * GROUND[0] - CENTER[0], abs=0.1)
    assert goal.pose.position.y == pytest.approx(2.0 * GROUND[1] - CENTER[1], abs=0.1)
    browser.click(*browser.center_of(box))
    picture_with(browser, BRICK, is_red)


def test_a_click_on_drop_makes_the_brick_fall(browser, stage):
    assert stage.arena.world.phase is Phase.HOVERING
    browser.click(*browser.center_of(button('Drop')))
    browser.wait_for(shown('answer', 'drop: the brick falls from (7, 6, 6)'))
    browser.wait_for(shown('brick', 'on the ground, 0.06 m up'))
    assert stage.arena.world.phase is Phase.GROUNDED
    assert stage.arena.world.brick == pytest.approx((7.0, 6.0, 0.06))


def test_a_browser_that_comes_later_sees_the_same(browser, url):
    browser.go_to(f'{url}/?fixedDpr=1')
    browser.wait_for(shown('brick', 'on the ground, 0.06 m up'))
    picture_with(browser, (7.0, 6.0, 0.12), lambda color: color[0] > color[2] + 0.04)
