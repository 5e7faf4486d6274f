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
from importlib.util import find_spec
from math import isnan
import re
from types import SimpleNamespace

import numpy
import pytest
from turtle_brick.core.geometry import from_yaw, Pose
from turtle_brick.view.camera import ABOVE, NEAR
from turtle_brick.view.measures import Curves
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
    server.close()


def test_things_are_drawn_moved_changed_and_removed(page):
    def node(path=''):
        return page.viser.scene.get_handle_by_name(f'/things/a%2Fb{path}')

    shapes = tuple(Shape(kind, (1.0, 2.0, 3.0), RED, Pose((1.0, 0.0, 0.0), from_yaw(1.0)))
                   for kind in ('box', 'cylinder', 'sphere'))
    shapes += (Shape('text', (0.5, 0.5, 0.25), RED, text='<b>text</b>'),)
    for position, yaw in (((0.0, 0.0, 0.0), 0.0), ((1.0, 2.0, 3.0), 0.5)):
        page.scene.show({'a/b': Thing(shapes, Pose(position, from_yaw(yaw)))})
        first = node()
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


def test_what_has_not_changed_is_not_sent(page, monkeypatch):
    sent = []
    monkeypatch.setattr(page.viser._websock_server, 'queue_message', sent.append)
    columns = Curves(3).columns()
    columns[1][-1] = 5.0
    for wanted in (True, False):
        page.scene.show({'box': Thing((BOX,), ORIGIN)})
        page.scene.keep_in_sight({NEAR: [(1.0, 2.0, 3.0)]})
        page.panel.suggest_place((1.0, 2.0, 3.0))
        page.panel.show_parts(True, False, True)
        page.panel.show_brick('falling', RED)
        page.panel.show_rates([('odom', 99.96)])
        page.panel.show_tilt(0.25)
        page.panel.show_curves(columns)
        assert bool(sent) is wanted
        sent.clear()


class Browser:
    """A browser, as viser's client and camera, that tells only later where its camera is."""

    client_id = 1
    image_width, image_height = 800, 600
    position = look_at = fov = None

    def __init__(self):
        """Be both."""
        self.camera = self

    def on_update(self, listener):
        """Note who is to hear where the camera is."""
        self.listener = listener

    def tell(self, position):
        """Tell where the camera is."""
        asyncio.run(self.listener(SimpleNamespace(position=numpy.array(position))))


def test_robot_and_brick_are_kept_in_sight_until_somebody_turns_the_view(page, monkeypatch):
    browser, clients = Browser(), {}
    monkeypatch.setattr(page.viser, 'get_clients', lambda: clients)
    scene = Scene(page.viser)

    def order(x):
        """Return where the camera is set once the brick is at x, None if it is not."""
        browser.position = None
        scene.keep_in_sight({NEAR: [(0.0, 0.0, 0.0), (x, 0.0, 0.0)] if x else [],
                             ABOVE: [(0.0, 0.0, 0.0)]})
        return browser.position

    clients[1] = browser
    assert order(0.0) is None
    orders = [order(1.0)]
    browser.tell((4.0, 5.0, 6.0))  # where it was before
    orders += [order(5.0), order(9.0)]
    assert None not in orders and order(9.0) is None
    for late in orders:
        browser.tell(late)
    assert order(12.0) is not None and browser.fov == NEAR.field_of_view
    browser.tell((4.0, 5.0, 6.0))
    assert order(15.0) is None, 'somebody has turned it'
    scene.look(browser, ABOVE)
    assert order(15.0)[:2] == pytest.approx((0.0, 0.0), abs=0.1) and order(20.0) is None


def test_the_curves_are_plotted_as_they_are(page):
    curves, plot = Curves(3), page.panel._plot
    for number, (highest, top) in enumerate(((3.0, 10.0), (25.0, 30.0), (10.0, 30.0))):
        curves.add(number * Curves.PERIOD, highest, None, 1.0)
        page.panel.show_curves(curves.columns())
        assert plot.scales['y']['range'] == (0.0, top)
        assert [[None if isnan(value) else value for value in column]
                for column in plot.data] == curves.columns()


def test_texts_are_no_html_and_alarms_are_red(page):
    panel = page.panel
    panel.show_answer('place: <script>alert(1)</script>', False)
    assert '&lt;script&gt;' in panel._answer.content and '#c92a2a' in panel._answer.content
    panel.show_answer('place: done', True)
    assert '#c92a2a' not in panel._answer.content
    panel.show_account('Unreachable', True)
    assert '#c92a2a' in panel._account.content
    panel.show_rates([('odom', 99.96), ('cmd_vel', None)])
    assert re.search('odom.*100.0 Hz.*cmd_vel.*no messages', panel._rates.content)
    panel.show_brick('falling', (0.2, 0.0, 1.0, 1.0))
    assert 'color:rgb(51,0,255)">&#9632;</span> falling<' in panel._brick.content
    panel.show_parts(True, False, False)
    assert panel._arena_part.visible and not panel._robot_part.visible


def test_the_slider_follows_the_platform_and_tilts_it_within_its_range(page):
    for angle, shown in ((0.7, 0.7), (9.0, 1.57), (-9.0, -1.57), (0.0, 0.0)):
        page.panel.show_tilt(angle)
        assert page.panel._tilt.value == pytest.approx(shown)
        assert page.panel._beyond.visible == (angle != shown)
        assert f'{angle:g} rad, beyond' in page.panel._beyond.content
    assert page.orders == [], 'nobody has moved it'
    for angle, name in ((0.3, 'tilt'), (-1.57, 'tilt'), (1.58, 'refuse'), (-9.0, 'refuse')):
        page.panel._on_tilt(angle)
        order, said = page.orders.pop()
        assert order == name and (said == angle or f'{angle:g} rad is beyond' in said)


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
    assert given_by('Drop') == ('drop',)
    assert given_by('Place') == ('place', 6.0, 5.0, 1.6)
    assert given_by('Drop', '6, 5.0, 1.66') == ('drop_from', 6.0, 5.0, 1.66)
    panel.suggest_place((1.0, 2.0, 3.0))
    assert panel._place.value == '6, 5.0, 1.66', 'what somebody writes stays'
    panel.suggest_place((6.0, 5.0, 1.66))
    assert given_by('Drop') == ('drop',), 'it is there'
    for name in ('Place', 'Drop'):
        order, reason = given_by(name, '')
        assert order == 'refuse' and "'' is no place" in reason
    assert given_by('Drop at random') == ('drop_at_random',) and orders == []
