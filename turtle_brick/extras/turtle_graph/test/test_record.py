# SPDX-License-Identifier: Apache-2.0
"""Test records of a graph, and that unusual data do not stop the referee."""

import gzip
import os
import pickle

import pytest
from std_msgs.msg import String
from turtle_graph.client.geometry import IDENTITY, Pose
from turtle_graph.client.observer import load_type
from turtle_graph.client.processes import Process
from turtle_graph.client.profiles import Profile
from turtle_graph.client.record import Frame, Received, Record, Sample
from turtle_graph.client.storage import load
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


def test_a_frame_is_interpolated_between_close_transforms():
    frame, ms = Frame(False), 1_000_000
    for number, (time, parent) in enumerate((
            (0, 'world'), (100, 'world'), (300, 'world'), (400, 'platform'))):
        frame.add(time * ms, number, Sample(time * ms, parent, Pose((time, 0.0, 0.0), IDENTITY)))
    assert frame.at(50 * ms).pose.position[0] == pytest.approx(50.0)
    assert frame.at(200 * ms) is None
    assert frame.at(350 * ms) == frame.samples[2]
    assert frame.at(440 * ms) == frame.samples[-1]
    assert frame.at(460 * ms) is None


def test_a_file_with_other_contents_is_not_a_record(tmp_path):
    path = tmp_path / 'record.gz'
    for content in (os.getpid, Process, [], 5):
        with gzip.open(path, 'wb') as file:
            pickle.dump(content, file)
        with pytest.raises(ValueError, match='not a record from the referee'):
            load(path)
