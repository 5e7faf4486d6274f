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

from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib.util import find_spec
from io import BytesIO
from math import inf
from queue import Queue
from threading import Event
from time import monotonic

from browser import Chromium, find_chromium
from geometry_msgs.msg import PoseStamped
from live_graph import graph
import numpy
from perspective import seen_from
import pytest
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.parameters import load
from turtle_brick.core.turtlesim_kinematics import ARENA_SIZE
from turtle_brick.view.camera import NEAR

# Not skipped as a whole, which launch_testing's plugin would take for all files beside it as well.
if find_spec('viser') is not None:
    from turtle_brick.view.panel import VIEWS

pytestmark = [
    pytest.mark.skipif(find_chromium() is None,
                       reason='Chromium is not installed here: apt-get install chromium'),
    pytest.mark.skipif(find_spec('viser') is None,
                       reason='viser, which draws the page, is not installed here')]

TIMEOUT = 120.0
WIDTH, HEIGHT = 960, 480

SIDES = (0.0, ARENA_SIZE)

GROUND = (7.0, 4.5, 0.0)
"""A point of the ground that nothing hides."""

CANVAS = 'document.querySelector("canvas[data-engine]").getBoundingClientRect()'
"""A JavaScript expression for the part of the page with the scene."""


class Page(Chromium):
    """The page in a browser."""

    def open_page(self, url):
        """Go to the page, and wait until it is complete."""
        self.go_to(f'{url}/?fixedDpr=1')
        self.wait_for('document.querySelector("canvas[data-engine]")')
        self.wait_for(f'{CANVAS}.width < innerWidth')  # the panel is docked beside it

    def says(self, name, text):
        """Return the JavaScript expression that an element of the panel has a text."""
        return (f'(document.querySelector(\'[data-turtle-brick="{name}"]\') || '
                f'{{textContent: ""}}).textContent.includes({text!r})')

    def wait_for_text(self, name, text):
        """Wait until an element of the panel has a text."""
        self.wait_for(self.says(name, text))

    def pixels_of(self, view, points, *sights):
        """Return where a view that has some points (m) in sight shows other points."""
        width, height = self.evaluate(f'[{CANVAS}.width, {CANVAS}.height]')
        camera = view.camera(points, width / height)
        seen = [seen_from(*camera, point) for point in sights]
        return [(width / 2.0 + height * right, height / 2.0 - height * up) for right, up in seen]

    def write_place(self, text, answer, button=None):
        """Write a place (m) and push Enter or a button until the answer comes."""
        deadline = monotonic() + TIMEOUT
        while True:
            self.click(*self.center_of('document.querySelector("form input")'), times=3)
            self.write(text)
            self.push('button', button) if button else self.press_enter()
            # The page may send what was written later than that, or not at all.
            if self.comes(self.says('answer', answer)):
                return
            assert monotonic() < deadline, answer

    def see(self, button, points, *sights):
        """Push a view's button until there is at points (m) what is one of LOOKS."""
        from PIL import Image
        pixels = self.pixels_of(VIEWS[button], points, *(point for point, _ in sights))
        deadline = monotonic() + TIMEOUT
        while monotonic() < deadline:
            self.push('button', button)
            picture = numpy.asarray(Image.open(BytesIO(self.scene())).convert('RGB'), float)
            colors = [picture[y - 1:y + 2, x - 1:x + 2].mean(axis=(0, 1))
                      for x, y in ((round(x), round(y)) for x, y in pixels)]
            if all(LOOKS[what](color / color.sum())
                   for (_, what), color in zip(sights, colors)):
                return
        raise AssertionError(f'the colors at {[point for point, _ in sights]} are {colors}')


def near(x, y, brick):
    """Return the points (m) that are in sight from near, with the robot at x and y."""
    parameters = load()
    hinge = parameters.platform_height - parameters.platform_thickness
    return [(x, y, 0.0), (x, y, hinge), brick, (*brick[:2], 0.0)]


LOOKS = {
    'brick': lambda color: color[0] > 0.5, 'not brick': lambda color: color[0] < 0.5,
    'platform': lambda color: color[2] > 0.36 and color[2] > color[1] > color[0],
    'wall': lambda color: color[2] > color[0] + 0.015,
    'ground': lambda color: numpy.ptp(color) < 0.04}
"""Whether a color (shares of red, green and blue) is that of a hovering brick and so on."""


@contextmanager
def shown(domain_id):
    """Run the graph in a thread, and its page; yield the page's address, and the goals to come."""
    goals, end = Queue(), Event()
    with graph(domain_id, quiet=True) as live, ThreadPoolExecutor() as pool:
        live.add_turtlesim()
        live.add_robot_state_publisher()
        live.add_robot()
        live.add_arena()
        live.add_catcher()
        live.listener.create_subscription(PoseStamped, 'goal_pose', goals.put, 10)
        viewer = live.add_process('turtle_brick', 'viewer', '--ros-args', '-p', 'port:=0')
        spinning = pool.submit(live.spin_until, end.is_set, inf, 'the end')
        try:
            yield viewer.wait_for_output(r'Viewer: (http\S+)', TIMEOUT)[1], goals
        finally:
            end.set()
            spinning.result()


def test_a_brick_is_seen_placed_and_caught_on_the_page(domain_id):
    x, y, z = brick = load().brick_start
    platform = (*CENTER, load().platform_height)
    with Page(WIDTH, HEIGHT) as page, shown(domain_id) as (url, goals):
        page.open_page(url)
        page.wait_for_text('brick', f'hovering, {z:.2f} m up')
        page.see('From above', [(x, y, 0.0) for x in SIDES for y in SIDES],
                 *(((x, y, 0.5), 'wall') for x, y in (
                     (-0.05, 5.5), (11.14, 5.5), (5.5, -0.05), (5.5, 11.14))))
        page.see('Near', near(*CENTER, brick), (brick, 'brick'), ((x, y, z - 0.5), 'not brick'),
                 (platform, 'platform'), (GROUND, 'ground'), ((5.5, 11.14, 0.25), 'wall'))

        page.write_place(f'{x}, {y}, -1', 'under the ground')
        page.write_place('', "place: '' is no place")
        page.wait_for_text('brick', f'hovering, {z:.2f} m up')

        page.wait_for('[...document.querySelectorAll(\'[data-turtle-brick="rates"] '
                      'td:last-child\')].every(cell => cell.textContent.endsWith(" Hz"))')
        (across, down), = page.pixels_of(NEAR, near(*CENTER, brick), GROUND)
        left, top = page.evaluate(f'[{CANVAS}.x, {CANVAS}.y]')
        page.click(left + across, top + down)
        point = goals.get(timeout=TIMEOUT).pose.position
        assert (point.x, point.y) == pytest.approx(GROUND[:2], abs=0.1)
        page.see('Near', near(point.x, point.y, brick), (brick, 'brick'), (platform, 'ground'),
                 ((point.x, point.y, platform[2]), 'platform'))

        # Above the robot, and so high that a machine that stands still for a while catches it.
        page.write_place('7, 4.5, 30', 'the brick hovers at (7, 4.5, 30)', button='Place')
        page.push('button', 'Drop')
        page.wait_for_text('answer', 'drop: the brick falls from')
        page.wait_for_text('brick', 'floating')
        page.wait_for_text('account', 'Waiting for a brick to fall')
