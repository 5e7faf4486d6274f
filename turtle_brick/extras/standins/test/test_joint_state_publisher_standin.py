# SPDX-License-Identifier: Apache-2.0
"""Test the joint limits and zero positions of the stand-in for joint_state_publisher."""

import sys

from joint_state_publisher import JointStatePublisher, make_node
import pytest
import rclpy
from rclpy.parameter import Parameter
from std_msgs.msg import String

JOINT = """<robot name="r"><joint name="j" type="prismatic">
  <limit lower="-1" upper="3"/><safety_controller soft_lower_limit="{}" soft_upper_limit="{}"/>
</joint></robot>"""


def test_a_urdf_file_on_the_command_line_is_read(tmp_path, monkeypatch, domain_id):
    path = tmp_path / 'r.urdf'
    path.write_text(JOINT.format(0.7, 1.0))
    monkeypatch.setattr(sys, 'argv', ['joint_state_publisher', str(path), '--ros-args'])
    rclpy.init(domain_id=domain_id)
    node = make_node(JointStatePublisher)
    rclpy.shutdown()
    assert node.positions == {'j': pytest.approx(0.85)}


@pytest.mark.parametrize('soft, smallest, limits', [
    ((0.7, 1.0), None, (0.7, 1.0, 0.85)),
    ((-2.0, 5.0), None, (-1.0, 3.0, 0.0)),
    ((0.7, 1.0), False, (-1.0, 3.0, 0.0))])
def test_soft_limits_apply_as_in_the_real_node(live, soft, smallest, limits):
    """The limits are minimum, maximum and zero position."""
    overrides = [] if smallest is None else [
        Parameter('use_smallest_joint_limits', value=smallest)]
    node = live.add(JointStatePublisher, parameters=False, parameter_overrides=overrides)
    node.configure(String(data=JOINT.format(*soft)))
    assert node.limits == {'j': pytest.approx(limits)}
