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
from time import monotonic

from browser import Chromium, find_chromium
from geometry_msgs.msg import PoseStamped
from live_graph import graph, process
import numpy
from perspective import seen_from
import pytest
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.parameters import load

# Not skipped as a whole, which launch_testing's plugin would take for all files beside it as well.
if find_spec('viser') is not None:
    from turtle_brick.view.scene import ABOVE, NEAR

pytestmark = [
    pytest.mark.skipif(find_chromium() is None,
                       reason='Chromium is not installed here: apt-get install chromium'),
    pytest.mark.skipif(find_spec('viser') is None,
                       reason='viser, which draws the page, is not installed here')]

TIMEOUT = 120.0
WIDTH, HEIGHT = 960, 480

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

    def pixel_of(self, point, camera):
        """Return where in the scene a point of the world (m) is."""
        width, height = self.evaluate(f'[{CANVAS}.width, {CANVAS}.height]')
        right, up = seen_from(*camera, point)
        return width / 2.0 + height * right, height / 2.0 - height * up

    def click_on(self, point, camera):
        """Click on a point of the world (m)."""
        left, top = self.evaluate(f'[{CANVAS}.x, {CANVAS}.y]')
        x, y = self.pixel_of(point, camera)
        self.click(left + x, top + y)

    def place_at_height(self, text, answer):
        """Write a height (m) into the last field of the place and push the button until it is."""
        deadline = monotonic() + TIMEOUT
        while not self.comes(self.says('answer', answer)):
            assert monotonic() < deadline, answer
            left, middle = self.center_of(
                '[...document.querySelectorAll("input")].filter(one => one.inputMode)[2]')
            self.click(left - 8.0, middle, times=3)
            self.write(text)
            # The page may send what was written later than that the button was pushed.
            self.push('button', 'Place')

    def see(self, camera, *sights):
        """Wait until points (m) have colors (shares of red, green and blue) as they should."""
        from PIL import Image
        pixels = [tuple(map(round, self.pixel_of(point, camera))) for point, _ in sights]
        deadline = monotonic() + TIMEOUT
        while monotonic() < deadline:
            picture = numpy.asarray(Image.open(BytesIO(self.scene())).convert('RGB'), float)
            colors = [picture[y - 1:y + 2, x - 1:x + 2].mean(axis=(0, 1)) for x, y in pixels]
            if all(looks(color / color.sum()) for (_, looks), color in zip(sights, colors)):
                return
        raise AssertionError(f'the colors at {[point for point, _ in sights]} are {colors}')


def is_red(color):
    """Return whether a color is the hovering brick's."""
    return color[0] > 0.5


def is_blue(color):
    """Return whether a color is the platform's."""
    return color[2] > 0.36 and color[2] > color[1] > color[0]


def is_wall(color):
    """Return whether a color is a wall's."""
    return color[2] > color[0] + 0.03


def is_gray(color):
    """Return whether a color is the ground's."""
    return numpy.ptp(color) < 0.04


def test_a_brick_is_seen_placed_and_caught_on_the_page(domain_id):
    x, y, z = brick = load().brick_start
    platform = (*CENTER, load().platform_height)
    command = ['ros2', 'launch', 'turtle_brick', 'turtle_arena.launch.py', 'view:=web']
    with graph(domain_id) as live, process(command, domain_id) as launched, \
            Page(WIDTH, HEIGHT) as page:
        goals = live.record('goal_pose', PoseStamped)
        url = launched.wait_for_output(r'Viewer: (http\S+)', TIMEOUT).group(1)
        page.open_page(url)
        page.wait_for_text('brick', f'hovering, {z:.2f} m up')
        page.see(NEAR, (brick, is_red), ((x, y, z - 0.5), lambda color: not is_red(color)),
                 (platform, is_blue), (GROUND, is_gray), ((5.5, 11.14, 0.25), is_wall))

        page.push('button', 'From above')
        page.see(ABOVE, *(((x, y, 0.5), is_wall) for x, y in (
            (-0.05, 5.5), (11.14, 5.5), (5.5, -0.05), (5.5, 11.14))))
        page.push('button', 'Near')

        page.place_at_height('-1', 'under the ground')
        page.wait_for_text('brick', f'hovering, {z:.2f} m up')

        page.wait_for('[...document.querySelectorAll(\'[data-turtle-brick="rates"] '
                      'td:last-child\')].every(cell => cell.textContent.endsWith(" Hz"))')
        page.click_on(GROUND, NEAR)
        live.wait_for(lambda: goals.messages, TIMEOUT, 'a goal')
        point = goals.last.pose.position
        assert (point.x, point.y) == pytest.approx(GROUND[:2], abs=0.1)
        page.see(NEAR, (brick, is_red), (platform, lambda color: not is_blue(color)))
        page.push('label', 'follow robot')
        page.see(NEAR, (platform, is_blue))

        # From so high that a busy machine has the time to catch it.
        page.place_at_height('30', 'the brick hovers at (7.5, 7, 30)')
        page.push('button', 'Drop')
        page.wait_for_text('answer', 'drop: the brick falls from')
        page.wait_for_text('brick', 'floating')
        page.wait_for_text('account', 'Waiting for a brick to fall')
