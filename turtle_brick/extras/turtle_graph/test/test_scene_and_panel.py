# SPDX-License-Identifier: Apache-2.0
"""Test the scene and the panel on a real server without a browser."""

import asyncio
from html import unescape
from importlib.util import find_spec
from types import SimpleNamespace

import numpy
import pytest
from turtle_graph.client.geometry import from_rpy, ORIGIN, Pose
from turtle_graph.view.camera import ARENA_VIEW, CORNERS, NEAR_VIEW, TOP_VIEW
from turtle_graph.view.shapes import SceneObject, Shape

# A module-level skip would make the launch_testing plugin skip other modules too.
if find_spec('viser') is not None:
    from turtle_graph.view.panel import Panel, parse_position
    from turtle_graph.view.scene import Scene
    from turtle_graph.view.server import PageServer

pytestmark = pytest.mark.skipif(find_spec('viser') is None, reason='viser is not installed')

RED = (1.0, 0.0, 0.0, 1.0)


@pytest.fixture(scope='module')
def page():
    server = PageServer('127.0.0.1', 0, 'test')
    calls = []
    panel = Panel(server.viser, Scene(server.viser), lambda *command: calls.append(command))
    yield SimpleNamespace(panel=panel, calls=calls, viser=server.viser)
    server.stop()


def test_objects_are_added_moved_changed_and_removed(page):
    def node(path):
        return page.viser.scene.get_handle_by_name(f'/objects/{path}')

    scene = Scene(page.viser)
    turned = Pose((1.0, 0.0, 0.0), from_rpy(0.0, 0.0, 1.0))
    shapes = tuple(Shape(kind, (1.0, 2.0, 3.0), RED, turned)
                   for kind in ('box', 'cylinder', 'sphere'))
    points = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 2.0, 0.0))
    shapes += (Shape('text', (0.5, 0.5, 0.25), RED, text='<b>text</b>'),
               Shape('line', (0.05, 0.0, 0.0), RED, points=points), Shape('line', points[0], RED))
    for position, yaw in (((0.0, 0.0, 0.0), 0.0), ((1.0, 2.0, 3.0), 0.5)):
        before = node('0')
        scene.show({'a/b': SceneObject(shapes, Pose(position, from_rpy(0.0, 0.0, yaw)))})
        first = node('0')
        assert before in (None, first), 'the node is moved and not replaced'
        x, y, z, w = from_rpy(0.0, 0.0, yaw)
        assert tuple(first.position) == position and tuple(first.wxyz) == (w, x, y, z)
    parts = [node(f'0/{number}') for number in range(len(shapes))]
    assert (parts[3].text, parts[3].font_scene_height) == ('<b>text</b>', 0.25)
    assert parts[4].thickness == pytest.approx(0.05)
    assert parts[4].points.tolist() == [[list(points[0]), list(points[1])],
                                        [list(points[1]), list(points[2])]]
    assert parts[5].points.tolist() == []
    assert all(part.scale == (1.0, 2.0, 3.0) for part in parts[:3])
    x, y, z, w = from_rpy(0.0, 0.0, 1.0)
    assert all(tuple(part.wxyz) == pytest.approx((w, x, y, z)) for part in parts[:3])
    assert parts[0].color == (255, 0, 0) and parts[0].opacity is None
    box = shapes[0]._replace(color=(0.0, 2.0, 0.5, 0.25))
    scene.show({'a/b': SceneObject((box,), ORIGIN, 'odom')})
    assert node('0') is None and node('1/1') is None and node('1/name').text == 'odom'
    assert (node('1/0').color, node('1/0').opacity) == ((0, 255, 128), 0.25)
    assert tuple(node('1').position) == (0.0, 0.0, 0.0) and node('1').show_axes
    scene.show({})
    assert node('1') is None


def test_camera_follows_robot_and_brick_until_somebody_turns_it(page, monkeypatch):
    """A camera position that the browser reports late is not mistaken for user input."""
    browser = SimpleNamespace(client_id=1, image_width=800, image_height=600)
    browser.camera, browser.on_update = browser, lambda callback: setattr(
        browser, 'report',
        lambda position: asyncio.run(callback(SimpleNamespace(position=position))))
    monkeypatch.setattr(page.viser, 'get_clients', lambda: {1: browser})
    scene = Scene(page.viser)

    def request(x, has_arena=False):
        """Return the camera position that the scene requests for a brick at x (m), or None."""
        browser.position = None
        scene.keep_in_view([(0.0, 0.0, 0.0), (x, 0.0, 0.0)] if x else [], has_arena)
        return browser.position

    assert request(0.0) is None
    requests = [request(1.0)]
    browser.report((4.0, 5.0, 6.0))  # This camera position is older than the first request.
    requests += [request(5.0), request(9.0)]
    assert None not in requests and request(9.0) is None
    for late in requests:
        browser.report(late)
    assert request(12.0) is not None
    browser.report((4.0, 5.0, 6.0))
    assert request(15.0) is None, 'somebody has turned the camera'
    scene.set_view(browser, TOP_VIEW)
    top, _ = TOP_VIEW.camera_pose(CORNERS, 800 / 600)
    assert request(15.0, True) == pytest.approx(top) and request(20.0, True) is None
    scene.set_view(browser, NEAR_VIEW)
    near, _ = NEAR_VIEW.camera_pose([(0.0,) * 3, (15.0, 0.0, 0.0)], 800 / 600)
    assert request(15.0, True) == pytest.approx(near)
    new = Scene(page.viser)
    new.keep_in_view([(5.0, 5.0, 12.0)], True)
    arena, _ = ARENA_VIEW.camera_pose([*CORNERS, (5.0, 5.0, 12.0)], 800 / 600)
    assert browser.position == pytest.approx(arena), 'the first view shows the whole arena'


def test_curves_are_plotted_from_the_time_when_all_are_known(page):
    panel, nan = page.panel, numpy.nan
    panel.show_curves([(99.5, 4.0, nan, 1.5), (100.0, 3.0, 5.0, 1.0), (100.5, 2.0, 4.0, 0.5)])
    assert [list(row) for row in panel.plot.data] == [
        [-0.5, 0.0], [3.0, 2.0], [5.0, 4.0], [1.0, 0.5]]
    panel.show_curves([(100.0, nan, nan, 1.0), (100.5, nan, nan, 0.5)])
    assert [list(row) for row in panel.plot.data] == [[-0.5, 0.0], [1.0, 0.5]]
    assert [series.get('label') for series in panel.plot.series] == [None, 'speed (m/s)']


def test_texts_are_escaped_alarms_are_red_and_sections_can_be_hidden(page):
    panel = page.panel
    panel.show_response('place: <script>alert(1)</script>', False)
    assert '&lt;script&gt;' in panel.response.content and '#c92a2a' in panel.response.content
    panel.show_status('Unreachable', True)
    assert '#c92a2a' in panel.status.content
    panel.show_status('Caught', False)
    assert '#c92a2a' not in panel.status.content
    panel.show_hidden_links(['wheel', 'stem'], 'no joint_states are received')
    assert '#c92a2a' in panel.hidden_links.content and panel.hidden_links.visible
    assert 'Not shown because no joint_states are received: wheel, stem' in (
        panel.hidden_links.content)
    panel.show_hidden_links([], 'no joint_states are received')
    assert not panel.hidden_links.visible
    panel.show_rates([('odom', 99.96), ('cmd_vel', 0.0)])
    assert '>odom: 100.0 Hz<' in panel.rates.content
    assert '>cmd_vel: no messages<' in panel.rates.content
    panel.show_sections(True, False, False)
    assert panel.brick_folder.visible and not panel.robot_folder.visible


def test_slider_follows_the_platform_within_its_range(page):
    for angle, shown in ((0.7, 0.7), (9.0, 1.57), (-9.0, -1.57), (0.0, 0.0)):
        page.panel.show_tilt(angle)
        assert page.panel.tilt.value == pytest.approx(shown)


def test_position_is_parsed_or_rejected():
    for text, position in (('7.5, 7, 1.66', (7.5, 7.0, 1.66)),
                           ('(-1,2e1,.5) ', (-1.0, 20.0, 0.5)), ('7.5 7  1.66', (7.5, 7.0, 1.66)),
                           ('1, 2 3', (1.0, 2.0, 3.0))):
        assert parse_position(text) == position
    for text in ('', '7.5, 7', '7.5, , 8', '7,5, 7, 8'):
        with pytest.raises(ValueError, match=f'{text!r} is not a position. Enter x, y and z'):
            parse_position(text)


def test_drop_first_places_the_brick_at_an_edited_position(page):
    panel, calls = page.panel, page.calls

    def press(name, text=None):
        panel.position.value = panel.position.value if text is None else text
        panel.press(name)
        assert text is None or panel.position.value == text
        return calls.pop()

    panel.suggest_position((6.0, 5.0, 1.6))
    assert press('Drop') == ('drop',)
    assert press('Place') == ('place', (6.0, 5.0, 1.6))
    assert press('Drop', '6, 5.0, 1.66') == ('drop', (6.0, 5.0, 1.66))
    panel.suggest_position((1.0, 2.0, 3.0))
    assert panel.position.value == '6, 5.0, 1.66', 'a suggestion does not replace a user input'
    panel.suggest_position((6.0, 5.0, 1.66))
    assert press('Drop') == ('drop',), 'the brick is already there'
    for name in ('Place', 'Drop'):
        panel.position.value = ''
        panel.press(name)
        assert calls == [] and "'' is not a position" in unescape(panel.response.content)
    name, (x, y, z) = press('Drop at random')
    assert name == 'drop' and 0.4 < x < 10.7 and 0.4 < y < 10.7 and 2.9 < z < 9.1
    assert press('Replay at 1/8') == ('replay', 0.125)
