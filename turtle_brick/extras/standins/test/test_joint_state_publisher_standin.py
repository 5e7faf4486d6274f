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
"""Test the joint limits and zero positions of the stand-in for joint_state_publisher."""

from joint_state_publisher import JointStatePublisher
import pytest
from rclpy.parameter import Parameter
from std_msgs.msg import String

JOINT = """<robot name="r"><joint name="j" type="prismatic">
  <limit lower="-1" upper="3"/><safety_controller soft_lower_limit="{}" soft_upper_limit="{}"/>
</joint></robot>"""


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
