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
"""Test the launch files that run an arena in a namespace."""

from ament_index_python.packages import get_package_share_path
from test_launch_files import programs_of, run_with_fake_programs


def test_python_and_xml_start_all_nodes_in_the_namespace_including_tf(tmp_path):
    files = get_package_share_path('turtle_brick_tools') / 'launch' / 'namespaced_arena.launch'
    run_with_fake_programs([f'{files}.{language} namespace:=alice view:=none'
                            for language in ('py', 'xml')], tmp_path)
    programs = programs_of(tmp_path, 0)
    assert programs == programs_of(tmp_path, 1)
    assert set(programs) == {
        'robot_state_publisher', 'turtlesim_node', 'turtle_robot', 'arena', 'catcher'}
    for words, _, _ in programs.values():
        assert {'__ns:=/alice', '/tf:=tf', '/tf_static:=tf_static'} <= set(words.split())
