# SPDX-License-Identifier: Apache-2.0
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
