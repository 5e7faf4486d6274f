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
"""Scene and panel, with the server that draws them, and no browser."""

import asyncio
from html import unescape
from importlib.util import find_spec
from types import SimpleNamespace

import numpy
import pytest
from turtle_brick.core.geometry import from_yaw, Pose
from turtle_brick.view.camera import ABOVE, NEAR
from turtle_brick.view.shapes import ORIGIN, Shape, Thing

# Not skipped as a whole, which launch_testing's plugin would take for all files beside it as well.
if find_spec('viser') is not None:
    from turtle_brick.view import panel as panels
    from turtle_brick.view.scene import Scene
    from turtle_brick.view.server import PageServer

pytestmark = pytest.mark.skipif(
    find_spec('viser') is None,
    reason='viser, which draws the page, is not installed here')

RED = (1.0, 0.0, 0.0, 1.0)
BOX = Shape('box', (1.0, 2.0, 3.0), RED)


@pytest.fixture(scope='module')
def page():
    """Return a scene, a panel and the orders that are given on them."""
    server = PageServer('127.0.0.1', 0, 'test')
    scene = Scene(server.viser)
    orders = []
    panel = panels.Panel(server.viser, scene, panels.Orders(*(
        lambda *values, name=name: orders.append((name, *values))
        for name in panels.Orders._fields)))
    yield SimpleNamespace(scene=scene, panel=panel, orders=orders, viser=server.viser)
    server.viser.stop()


def test_things_are_drawn_moved_changed_and_removed(page):
    def node(path=''):
        return page.viser.scene.get_handle_by_name(f'/things/a%2Fb{path}')

    shapes = tuple(Shape(kind, (1.0, 2.0, 3.0), RED, Pose((1.0, 0.0, 0.0), from_yaw(1.0)))
                   for kind in ('box', 'cylinder', 'sphere'))
    shapes += (Shape('text', (0.5, 0.5, 0.25), RED, text='<b>text</b>'),)
    for position, yaw in (((0.0, 0.0, 0.0), 0.0), ((1.0, 2.0, 3.0), 0.5)):
        before = node()
        page.scene.show({'a/b': Thing(shapes, Pose(position, from_yaw(yaw)))})
        first = node()
        assert before in (None, first), 'it is moved, not drawn anew'
        x, y, z, w = from_yaw(yaw)
        assert tuple(first.position) == position and tuple(first.wxyz) == (w, x, y, z)
    parts = [node(f'/{number}') for number in range(4)]
    assert (parts[3].text, parts[3].font_scene_height) == ('<b>text</b>', 0.25)
    assert all(part.scale == (1.0, 2.0, 3.0) for part in parts[:3])
    x, y, z, w = from_yaw(1.0)
    assert all(tuple(part.wxyz) == pytest.approx((w, x, y, z)) for part in parts[:3])
    assert parts[0].color == (255, 0, 0) and parts[0].opacity is None
    page.scene.show({'a/b': Thing((BOX._replace(color=(0.0, 2.0, 0.5, 0.25)),), ORIGIN, 'odom')})
    assert node() is not first and node('/1') is None and node('/name').text == 'odom'
    assert (node('/0').color, node('/0').opacity) == ((0, 255, 128), 0.25)
    assert tuple(node().position) == (0.0, 0.0, 0.0) and node().show_axes
    page.scene.show({})
    assert node() is None


def test_robot_and_brick_are_kept_in_sight_until_somebody_turns_the_view(page, monkeypatch):
    """The browser, which is viser's client and camera, tells only later where its camera is."""
    browser = SimpleNamespace(client_id=1, image_width=800, image_height=600)
    browser.camera, browser.on_update = browser, lambda listener: setattr(
        browser, 'tell', lambda place: asyncio.run(listener(SimpleNamespace(position=place))))
    monkeypatch.setattr(page.viser, 'get_clients', lambda: {1: browser})
    scene = Scene(page.viser)

    def order(x):
        """Return where the camera is set once the brick is at x, None if it is not."""
        browser.position = None
        scene.keep_in_sight([(0.0, 0.0, 0.0), (x, 0.0, 0.0)] if x else [])
        return browser.position

    assert order(0.0) is None
    orders = [order(1.0)]
    browser.tell((4.0, 5.0, 6.0))  # where it was before
    orders += [order(5.0), order(9.0)]
    assert None not in orders and order(9.0) is None
    for late in orders:
        browser.tell(late)
    assert order(12.0) is not None
    browser.tell((4.0, 5.0, 6.0))
    assert order(15.0) is None, 'somebody has turned it'
    scene.look(browser, ABOVE)
    above, _ = ABOVE.camera(ABOVE.sights, 800 / 600)
    assert order(15.0) == pytest.approx(above) and order(20.0) is None
    scene.look(browser, NEAR)
    assert order(15.0) == pytest.approx(NEAR.camera([(0.0,) * 3, (15.0, 0.0, 0.0)], 800 / 600)[0])


def test_the_curves_are_plotted_as_they_are(page):
    page.panel.show_curves([(100.0, 3.0, numpy.nan, 1.0), (100.5, 2.0, 4.0, 0.5)])
    assert [list(row) for row in page.panel._plot.data] == [
        [-0.5, 0.0], [3.0, 2.0], pytest.approx([numpy.nan, 4.0], nan_ok=True), [1.0, 0.5]]


def test_texts_are_no_html_alarms_are_red_and_parts_those_of_nodes(page):
    panel = page.panel
    panel.show_answer('place: <script>alert(1)</script>', False)
    assert '&lt;script&gt;' in panel._answer.content and '#c92a2a' in panel._answer.content
    panel.show_account('Unreachable', True)
    assert '#c92a2a' in panel._account.content
    panel.show_account('Caught', False)
    assert '#c92a2a' not in panel._account.content
    panel.show_rates([('odom', 99.96), ('cmd_vel', None)])
    assert '>odom: 100.0 Hz<' in panel._rates.content
    assert '>cmd_vel: no messages<' in panel._rates.content
    panel.show_parts(True, False, False)
    assert panel._arena_part.visible and not panel._robot_part.visible


def test_the_slider_follows_the_platform_and_says_what_is_beyond_it(page):
    for angle, shown in ((0.7, 0.7), (9.0, 1.57), (-9.0, -1.57), (0.0, 0.0)):
        page.panel.show_tilt(angle)
        assert page.panel._tilt.value == pytest.approx(shown)
        assert page.panel._beyond.visible == (angle != shown)


def test_a_place_is_what_is_written_or_refused():
    for text, place in (('7.5, 7, 1.66', (7.5, 7.0, 1.66)), ('(-1,2e1,.5) ', (-1.0, 20.0, 0.5))):
        assert panels.place_of(text) == place
    for text in ('', '7.5, 7', '7.5, , 8', '7,5, 7, 8'):
        with pytest.raises(ValueError, match=f'{text!r} is no place: write x, y and z'):
            panels.place_of(text)


def test_drop_places_first_what_is_written_and_not_yet_placed(page):
    panel, orders = page.panel, page.orders

    def given_by(name, text=None):
        """Return the order that a button gives, once a text is in the field."""
        panel._place.value = panel._place.value if text is None else text
        panel._on_button(name)
        assert text is None or panel._place.value == text
        return orders.pop()

    panel.suggest_place((6.0, 5.0, 1.6))
    assert given_by('Drop') == ('drop', None)
    assert given_by('Place') == ('place', (6.0, 5.0, 1.6))
    assert given_by('Drop', '6, 5.0, 1.66') == ('drop', (6.0, 5.0, 1.66))
    panel.suggest_place((1.0, 2.0, 3.0))
    assert panel._place.value == '6, 5.0, 1.66', 'what somebody writes stays'
    panel.suggest_place((6.0, 5.0, 1.66))
    assert given_by('Drop') == ('drop', None), 'it is there'
    for name in ('Place', 'Drop'):
        panel._place.value = ''
        panel._on_button(name)
        assert orders == [] and "'' is no place" in unescape(panel._answer.content)
    name, (x, y, z) = given_by('Drop at random')
    assert name == 'drop' and 0.4 < x < 10.7 and 0.4 < y < 10.7 and 2.9 < z < 9.1
