# SPDX-License-Identifier: Apache-2.0
"""Test that unusual data from a graph do not stop the referee."""

import pytest
from std_msgs.msg import String
from turtle_graph.client.observer import load_type
from turtle_graph.client.profiles import Profile
from turtle_graph.client.record import Received, Record
from turtle_graph.referee.rules.rule import OPEN, Rule


@pytest.mark.parametrize('urdf, expected', (
    ('<robot><link name="a"/><link name=\'b\' /></robot>', {'a', 'b'}),
    ('<robot><!-- <link name="a"/> --><link  name="b"/></robot>', {'b'}),
    ('<robot><link name="a"', set())))
def test_the_links_of_a_urdf_are_frames(urdf, expected):
    record = Record(Profile())
    record.topics['robot_description'].append(Received(0, String(data=urdf)))
    assert record.frame_names() == expected


@pytest.mark.parametrize('name', ('', 'String', 'std_msgs/String', '/msg/String', 'a/b/c/d',
                                  'std_msgs/msg/Nonsuch', 'nonsuch/msg/String'))
def test_an_unknown_type_is_reported(name):
    with pytest.raises(LookupError, match='is not installed'):
        load_type(name)


def test_an_error_in_a_rule_is_not_a_failure():
    judgment = Rule('a', '', '', lambda record: record.nonsuch, [])(Record(Profile()))
    assert judgment.mark == OPEN
    assert judgment.measured.startswith('referee error: AttributeError: ')
    assert 'record.nonsuch' in judgment.traceback
