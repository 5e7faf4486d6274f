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
"""Test the page of the stand-in for joint_state_publisher_gui in a browser."""

from browser import Chromium, find_chromium
from live_graph import graph, LATCHED, process, TIMEOUT
import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from turtle_brick.tools.graph import executable

ROBOT = """
<robot name="two_wheels">
  <link name="base"/><link name="left"/><link name="right"/>
  <joint name="left_joint" type="continuous"><parent link="base"/><child link="left"/></joint>
  <joint name="right_joint" type="continuous"><parent link="base"/><child link="right"/></joint>
</robot>
"""


@pytest.mark.skipif(find_chromium() is None,
                    reason='Chromium is not installed. Run: apt-get install chromium')
def test_buttons_on_the_page_move_the_joints(domain_id):
    command = [executable('joint_state_publisher_gui', 'joint_state_publisher_gui')]
    with graph(domain_id) as live, process(command, domain_id) as sliders, Chromium() as browser:
        live.publisher('robot_description', String, LATCHED).publish(String(data=ROBOT))
        states = live.record('joint_states', JointState)
        browser.go_to(sliders.wait_for_output(r'Joint State Publisher: (\S+)', TIMEOUT)[1])
        for name, moved in (('Randomize', True), ('Center', False)):
            button = f'[...document.querySelectorAll("button")].find(b => b.innerText == {name!r})'
            browser.wait_for(button)
            browser.evaluate(f'{button}.click()')
            live.wait_for(lambda: states.last and states.last.position and all(
                (position != 0.0) is moved for position in states.last.position), TIMEOUT, name)
        assert states.last.name == ['left_joint', 'right_joint']
