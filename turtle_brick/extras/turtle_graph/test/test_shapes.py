# SPDX-License-Identifier: Apache-2.0
"""Test the conversion of robot descriptions and markers to shapes."""

from math import inf, nan

from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
import pytest
from rigid import axes_of
from std_msgs.msg import ColorRGBA, Header
from turtle_graph.client.geometry import from_rpy, ORIGIN
from turtle_graph.client.messages import NS_PER_SECOND
from turtle_graph.view.shapes import Markers, RED, robot_shapes, shape_of
from visualization_msgs.msg import Marker

SMALL = """<?xml version="1.0"?>
<robot name="small">
  <material name="paint"><color rgba="0.1 0.2 0.3 0.4"/></material>
  <link name="root">
    <visual>
      <origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/>
      <geometry><box size="0.5 0.25 2"/></geometry>
      <material name="paint"/>
    </visual>
    <visual>
      <geometry><sphere radius="0.5"/></geometry>
      <material name="own"><color rgba="1 0 0 1"/></material>
    </visual>
    <visual><geometry><mesh filename="package://x/y.stl"/></geometry></visual>
    <collision><geometry><box size="9 9 9"/></geometry></collision>
  </link>
  <link name="tip">
    <visual><geometry><cylinder radius="0.1" length="3"/></geometry></visual>
  </link>
  <link name="bare"/>
  <joint name="a" type="fixed"><parent link="root"/><child link="tip"/></joint>
  <joint name="b" type="fixed"><parent link="tip"/><child link="bare"/></joint>
</robot>
"""


def test_shapes_are_read_from_the_robot_description():
    robot = robot_shapes(SMALL)
    assert robot.root == 'root' and robot.skipped == {'mesh'}
    (box, sphere), (cylinder,), () = (robot.links[name] for name in ('root', 'tip', 'bare'))
    assert (box.kind, box.size, box.color) == ('box', (0.5, 0.25, 2.0), (0.1, 0.2, 0.3, 0.4))
    assert box.pose.position == (1.0, 2.0, 3.0)
    assert axes_of(box.pose.orientation)[0] == pytest.approx((0.0, 1.0, 0.0))
    assert (sphere.kind, sphere.size) == ('sphere', (1.0, 1.0, 1.0))
    assert sphere.color == (1.0, 0.0, 0.0, 1.0)
    assert (cylinder.kind, cylinder.size, cylinder.color) == ('cylinder', (0.2, 0.2, 3.0), RED)


def test_material_colors_are_those_of_urdfdom():
    """If a visual has an unnamed material, it and all later visuals of its link are ignored."""
    def visual(attributes, blue):
        return (f'<visual><geometry><sphere radius="1"/></geometry><material {attributes}>'
                f'<color rgba="0 0 {blue} 1"/></material></visual>')

    robot = robot_shapes(f"""<robot name="r">
        <joint name="j"><parent link="a"/><child link="b"/></joint>
        <link name="a">{visual('name="x"', 0.1)}{visual('', 0.2)}{visual('name="x"', 0.3)}</link>
        <link name="b">{visual('name="x"', 0.4)}{visual('name="y"', 0.5)}</link>
        <material name="y"><color rgba="0 0 0.6 1"/></material></robot>""")
    assert [[shape.color[2] for shape in robot.links[name]] for name in ('a', 'b')] == [
        [0.1], [0.1, 0.6]]


def test_visuals_without_a_material_name_have_the_color_of_the_first_visual():
    def link(name, *materials):
        return f'<link name="{name}">' + ''.join(
            f'<visual><geometry><sphere radius="1"/></geometry>{material}</visual>'
            for material in materials) + '</link>'

    def color(name, blue):
        return f'<material name="{name}"><color rgba="0 0 {blue} 1"/></material>'

    robot = robot_shapes(f"""<robot name="r">
        <joint name="j"><parent link="a"/><child link="b"/></joint>
        <joint name="k"><parent link="a"/><child link="c"/></joint>
        {link('a', color('', 0.1), color('', 0.2), '', color('x', 0.3))}{link('b', color('', 0.4))}
        {link('c', '', color('y', 0.5))}</robot>""")
    assert [[shape.color[2] for shape in robot.links[name]] for name in 'abc'] == [
        [0.1, 0.1, 0.1, 0.3], [0.4], [RED[2], RED[2]]]


def test_invalid_robot_description_is_rejected():
    for before, after, reason in (
            ('</robot>', '', 'is not valid XML'),
            ('radius="0.5"', 'radius="wide"', "radius of <sphere> is 'wide'"),
            ('rgba="1 0 0 1"', 'rgba="1 0 0"', "rgba of <color> is '1 0 0'"),
            ('length="3"', 'length="1e7"', 'contains a number that is too large'),
            ('<child link="bare"/>', '<child link="other"/>', 'must have one root link')):
        with pytest.raises(ValueError, match=reason):
            robot_shapes(SMALL.replace(before, after, 1))


def test_marker_is_shown_until_it_is_deleted_or_expires():
    def update(topic, number, now, **fields):
        message = Marker(id=number, type=Marker.CUBE, header=Header(frame_id='/world'), **fields)
        message.lifetime.sec = 3 * number
        markers.update(topic, message, now * NS_PER_SECOND)

    def shown(now):
        return set(markers.objects(now, {'world': ORIGIN}.get))  # The leading slash is ignored.

    markers = Markers()
    update('a', 0, 1)
    update('a', 1, 1)
    update('b', 1, 2)
    assert shown(4 * NS_PER_SECOND - 1) == {'a//0', 'a//1', 'b//1'}
    update('b', 1, 3)
    assert shown(4 * NS_PER_SECOND) == {'a//0', 'b//1'}
    update('b', 1, 4, action=Marker.DELETE)
    assert shown(4 * NS_PER_SECOND) == {'a//0'}
    assert markers.objects(0, lambda frame: None) == {}, 'the frame is unknown'
    update('a', 9, 4, action=Marker.DELETEALL)
    assert shown(4 * NS_PER_SECOND) == set()


def test_shape_has_kind_size_color_pose_and_text_of_the_marker():
    quaternion = from_rpy(0.0, 0.4, 0.3)
    message = Marker(scale=Vector3(x=1.0, y=2.0, z=3.0), text='Hi')
    message.color.r, message.color.a, message.pose.position.y = 0.5, 0.25, 6.0
    message.points = [Point(x=1.0), Point(y=2.0)]
    x, y, z, w = (2.0 * component for component in quaternion)
    message.pose.orientation = Quaternion(x=x, y=y, z=z, w=w)
    for message.type, kind in ((Marker.CUBE, 'box'), (Marker.TEXT_VIEW_FACING, 'text'),
                               (Marker.LINE_STRIP, 'line')):
        shape = shape_of(message)
        assert shape._replace(pose=ORIGIN) == (
            kind, (1.0, 2.0, 3.0), (0.5, 0.0, 0.0, 0.25), ORIGIN, 'Hi',
            ((1.0, 0.0, 0.0), (0.0, 2.0, 0.0)))
        assert shape.pose.position == (0.0, 6.0, 0.0)
        assert shape.pose.orientation == pytest.approx(quaternion)
    message.pose.orientation = Quaternion(w=0.0)
    assert shape_of(message).pose.orientation == ORIGIN.orientation, 'as in rviz2'


@pytest.mark.parametrize(('fields', 'reason'), [
    ({'type': Marker.MESH_RESOURCE}, 'cannot draw markers of type MESH_RESOURCE'),
    ({'type': 99}, 'cannot draw markers of type unknown'),
    ({'points': [Point(z=nan)]}, 'too large or not finite'),
    ({'scale': Vector3(x=-1e308)}, 'too large or not finite'),
    ({'pose': Pose(position=Point(y=nan))}, 'too large or not finite'),
    ({'color': ColorRGBA(a=inf)}, 'too large or not finite')])
def test_marker_that_cannot_be_drawn_is_rejected(fields, reason):
    with pytest.raises(ValueError, match=reason):
        shape_of(Marker(**{'type': Marker.CUBE, **fields}))
