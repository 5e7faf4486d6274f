# SPDX-License-Identifier: Apache-2.0
"""Test the reader of URDFs."""

from math import pi
from xml.etree.ElementTree import ParseError

import pytest
from turtle_graph.client.geometry import IDENTITY, ORIGIN, turn, X, Z
from turtle_graph.client.urdf import read_urdf

ROBOT = """<robot name="small">
  <material name="paint"><color rgba="0.1 0.2 0.3 1"/></material>
  <link name="base">
    <visual>
      <origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/>
      <geometry><box size="0.5 0.25 2"/></geometry>
      <material name="paint"/>
    </visual>
    <visual>
      <geometry><cylinder radius="0.1" length="3"/></geometry>
      <material name="own"><color rgba="1 0 0 1"/></material>
    </visual>
    <visual><geometry><mesh filename="package://x/y.stl"/></geometry><material/></visual>
    <collision><geometry><box size="9 9 9"/></geometry></collision>
  </link>
  <link name="arm"/>
  <joint name="turning" type="continuous">
    <parent link="base"/><child link="arm"/><origin xyz="0 0 1"/><axis xyz="0 0 2"/>
  </joint>
</robot>"""


def test_visual_elements_have_a_size_a_pose_and_a_color():
    robot = read_urdf(ROBOT)
    box, cylinder, mesh = robot.links['base']
    assert (box.kind, box.size, box.material, box.color) == ('box', (0.5, 0.25, 2.0), 'paint', ())
    assert box.pose.position == (1.0, 2.0, 3.0)
    assert box.pose.orientation == pytest.approx(turn(Z, pi / 2.0))
    assert cylinder == ('cylinder', (0.1, 3.0), ORIGIN, 'own', (1.0, 0.0, 0.0, 1.0))
    assert mesh == ('mesh', (), ORIGIN, None, ())
    assert robot.links['arm'] == []
    assert robot.colors == {'paint': (0.1, 0.2, 0.3, 1.0), 'own': (1.0, 0.0, 0.0, 1.0)}


def test_a_joint_connects_two_links():
    joint, = read_urdf(ROBOT).joints
    assert joint == ('turning', 'continuous', 'base', 'arm', ((0.0, 0.0, 1.0), IDENTITY), Z)
    assert joint.movable
    joint, = read_urdf(ROBOT.replace('continuous', 'fixed').replace('xyz="0 0 2"', '')).joints
    assert joint.axis == X, 'the default axis'
    assert not joint.movable


def test_the_first_of_two_materials_with_one_name_has_the_color():
    robot = read_urdf(ROBOT.replace('"own"', '"paint"'))
    assert robot.colors == {'paint': (0.1, 0.2, 0.3, 1.0)}


@pytest.mark.parametrize(('before', 'after', 'reason'), (
    ('size="0.5 0.25 2"', 'size="0.5 0.25"', "size of <box> is '0.5 0.25'"),
    ('radius="0.1"', '', "radius of <cylinder> is ''"),
    ('length="3"', 'length="nan"', "length of <cylinder> is 'nan'"),
    ('length="3"', 'length="wide"', "length of <cylinder> is 'wide'"),
    ('xyz="1 2 3"', 'xyz="1 2"', "xyz of <origin> is '1 2'"),
    ('xyz="0 0 2"', 'xyz="0 0 inf"', "xyz of <axis> is '0 0 inf'"),
    ('<parent link="base"/>', '', 'the joint turning does not connect two links')))
def test_an_invalid_value_is_reported(before, after, reason):
    with pytest.raises(ValueError, match=reason):
        read_urdf(ROBOT.replace(before, after))


def test_invalid_xml_is_reported():
    with pytest.raises(ParseError):
        read_urdf(ROBOT.replace('</robot>', ''))
