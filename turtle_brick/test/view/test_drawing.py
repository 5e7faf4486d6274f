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

from importlib.util import find_spec
from itertools import product
from math import isnan, nan
import re
from types import SimpleNamespace

from hypothesis import given
from hypothesis import strategies as st
from perspective import seen_from
import pytest
from turtle_brick.core.catch_logic import CENTER
from turtle_brick.core.geometry import from_yaw, Pose
from turtle_brick.core.parameters import load
from turtle_brick.core.turtlesim_kinematics import ARENA_CENTER, ARENA_SIZE
from turtle_brick.physics import Phase
from turtle_brick.view.measures import Curves
from turtle_brick.view.shapes import ORIGIN, Shape, Thing

# Not skipped as a whole, which launch_testing's plugin would take for all files beside it as well.
if find_spec('viser') is not None:
    from turtle_brick.view import panel as panels
    from turtle_brick.view.scene import ABOVE, ground_under, NEAR, Scene
    from turtle_brick.view.server import PageServer

pytestmark = pytest.mark.skipif(
    find_spec('viser') is None,
    reason='viser, which draws the page, is not installed here')

RED = (1.0, 0.0, 0.0, 1.0)
BOX = Shape('box', (1.0, 2.0, 3.0), RED)
COORDINATES = st.floats(-50.0, 50.0)


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


@given(st.tuples(COORDINATES, COORDINATES, st.floats(0.1, 50.0)), COORDINATES, COORDINATES)
def test_a_click_is_on_the_ground_that_it_points_at(eye, x, y):
    ray = (x - eye[0], y - eye[1], -eye[2])
    assert ground_under(eye, ray) == pytest.approx((x, y), abs=1e-9)
    assert ground_under(eye, (ray[0], ray[1], eye[2])) is None
    assert ground_under((eye[0], eye[1], -eye[2]), ray) is None


def test_a_click_at_the_horizon_is_no_goal():
    assert ground_under((0.0, 0.0, 1.0), (1.0, 0.0, -1.0 / 199.0)) == pytest.approx((199.0, 0.0))
    assert ground_under((0.0, 0.0, 1.0), (1.0, 0.0, -1.0 / 201.0)) is None
    assert ground_under((0.0, 0.0, 1.0), (0.0, -1.0, -1.0 / 201.0)) is None


def test_things_are_drawn_moved_changed_and_removed(page):
    def node(path=''):
        return page.viser.scene.get_handle_by_name(f'/world/things/a%2Fb{path}')

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
    page.scene.show({'a/b': Thing((BOX._replace(color=(0.0, 2.0, 0.5, 0.25)),), ORIGIN, 'b')})
    assert node() is not first and node('/1') is None and node('/name').text == 'b'
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
        page.scene.focus_on(1.0, 2.0)
        page.panel.show_brick('falling', RED)
        page.panel.show_rates([('odom', 99.96)])
        page.panel.show_tilt(0.25)
        page.panel.show_curves(columns)
        assert bool(sent) is wanted
        sent.clear()


def test_what_is_followed_stays_where_it_is_before_the_cameras(page):
    world = page.viser.scene.get_handle_by_name('/world')
    click = SimpleNamespace(ray_origin=(ARENA_CENTER + 1.0, ARENA_CENTER, 5.0),
                            ray_direction=(0.0, 0.0, -1.0))
    for x, y in ((1.0, 2.0), (9.0, -3.5), (ARENA_CENTER, ARENA_CENTER)):
        page.scene.focus_on(x, y)
        assert tuple(world.position) == pytest.approx((ARENA_CENTER - x, ARENA_CENTER - y, 0.0))
        # A click is in the world.
        assert page.scene.ground_at(click) == pytest.approx((x + 1.0, y))


def test_the_robot_is_near_and_the_brick_in_sight_in_the_first_view():
    parameters = load()
    foot = seen_from(*NEAR, (*CENTER, 0.0))[1]
    top = seen_from(*NEAR, (*CENTER, parameters.platform_height))[1]
    assert top - foot >= 0.25 and foot > -0.5
    across, up = seen_from(*NEAR, parameters.brick_start)
    assert up < 0.48 and abs(across) < 0.48, 'even where the page is as wide as it is high'
    for corner in product((0.0, ARENA_SIZE), repeat=2):
        across, up = seen_from(*ABOVE, (*corner, 0.0))
        assert 0.4 < abs(across) < 0.48 and 0.4 < abs(up) < 0.48


def test_the_curves_are_plotted_as_they_are(page):
    curves, plot = Curves(3), page.panel._plot
    for number, (highest, top) in enumerate(((3.0, 10.0), (25.0, 30.0), (10.0, 30.0))):
        curves.add(number * Curves.PERIOD, highest, None, 1.0)
        page.panel.show_curves(curves.columns())
        assert plot.scales['y']['range'] == (0.0, top)
        assert [[None if isnan(value) else value for value in column]
                for column in plot.data] == curves.columns()
    assert isnan(plot.data[2][-1]) and not isnan(plot.data[1][-1]) and nan != 0


def test_texts_are_no_html_and_alarms_are_red(page):
    panel = page.panel
    panel.show_answer('place: <script>alert(1)</script>', False)
    assert '&lt;script&gt;' in panel._answer.content and '#c92a2a' in panel._answer.content
    panel.show_answer('place: done', True)
    assert '#c92a2a' not in panel._answer.content
    for alarm in (True, False):
        panel.show_account('<Waiting>', alarm)
        assert '&lt;Waiting&gt;' in panel._account.content
        assert ('#c92a2a' in panel._account.content) is alarm
    panel.show_rates([('<odom>', 99.96), ('cmd_vel', None)])
    assert re.search('&lt;odom&gt;.*100.0 Hz.*cmd_vel.*no messages', panel._rates.content)
    panel.show_legend({phase: (number / 255.0, 0.0, 1.0, 1.0)
                       for number, phase in enumerate(Phase)})
    assert re.findall(r'color:rgb\((\d+),0,255\)">&#9632;</span> ([a-z ]+)<',
                      panel._legend.content) == [
        (str(number), phase.value) for number, phase in enumerate(Phase)]


def test_the_slider_follows_the_platform_within_its_range(page):
    for angle, shown in ((0.7, 0.7), (9.0, 1.57), (-9.0, -1.57), (0.0, 0.0)):
        page.panel.show_tilt(angle)
        assert page.panel._tilt.value == pytest.approx(shown)
    assert page.orders == [], 'nobody has moved it'
