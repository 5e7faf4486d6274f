# SPDX-License-Identifier: Apache-2.0
"""Test the profiles and reports of the referee."""

from math import inf, nan
import sys
from xml.etree import ElementTree

import pytest
from turtle_graph.client.profiles import Profile, similar_names
from turtle_graph.client.record import LOADED, Record
from turtle_graph.referee import referee, report
from turtle_graph.referee.rules.rule import FAILED, Judgment, MET, OPEN, Plot

JUDGMENTS = [
    Judgment('b', 'ж', 'ö', FAILED, '-' * 300, Plot('Empty', '', '', ([], []), ([], []))),
    Judgment('d', '', '', FAILED, 'wrong', follows=['b']),
    Judgment('c', '', '', OPEN, f'not judged: {LOADED} in 1 of 9 trials', loaded=True),
    Judgment('e', '', '', OPEN, 'no data'),
    Judgment('a', 'words <b> & "more"', 'x [red]', MET, '1 < 2 & [bold]3[/bold]', Plot(
        'Title <&>', 'x (m)', 'y & z', ([0.0, 1.0, nan], [1.0, inf, 2.0]),
        ([0.0, 1.0], [0.0, 1.0])))]

ABOUT = {'seconds': 1.5, 'command': 'ros2 <tag>', 'versions': {'rclpy': '7.1'}, 'notes': ['ö'],
         'date': '2026-11-23'}


def parse(page):
    assert page.startswith('<!DOCTYPE html>')
    return ElementTree.fromstring(page.removeprefix('<!DOCTYPE html>'))


def test_the_page_contains_facts_table_and_plots():
    root = parse(report.page(JUDGMENTS, ABOUT))
    for text in ('date: 2026-11-23', 'command: ros2 <tag>', 'versions: rclpy 7.1', 'notes: ö'):
        assert text in [paragraph.text for paragraph in root.iter('p')]
    assert len(root.findall('.//table/tr')) == 1 + len(JUDGMENTS)
    assert [element.tag for element in root.find('body/main')][-3:] == [
        'table', *['{http://www.w3.org/2000/svg}svg'] * 2]


def test_a_crashed_node_is_a_failure_even_if_all_requirements_are_met():
    met, failed = ([Judgment('a', '', '', mark, '')] for mark in (MET, FAILED))
    for judgments, crashes, notes, status in (
            (met, [], [], 0), (met, ['viewer crashed: E'], [], 1), (failed, [], [], 1),
            (met, [], [report.INCOMPLETE], 2)):
        record = Record(Profile())
        record.crashes, record.notes = crashes, notes
        assert referee.exit_status(judgments, record) == status


def test_the_terminal_repeats_what_is_not_met(capsys):
    more = [JUDGMENTS[1]._replace(name='d 2'), JUDGMENTS[3]._replace(name='e 2')]
    report.print_judgments([*JUDGMENTS, *more], {
        'crashes': ['arena crashed: E'], 'notes': ['ö'], 'load': LOADED,
        'machine': 'load 1.0', 'domain': '7'})
    table, _, repeated = capsys.readouterr().out.partition('\n\n')
    assert table.splitlines()[:3] == ['load 1.0', f'{FAILED} arena crashed: E', 'note: ö']
    assert '[bold]3[/bold]' in table and 'x [red]' in table
    assert repeated.splitlines() == [
        f'{FAILED} b: {"-" * 300}', f'{FAILED} d, d 2: may follow from: b',
        f'{OPEN} c: {JUDGMENTS[2].measured}', f'{OPEN} e, e 2: no data',
        '1 ✔ met, 3 ✗ failed, 3 – open',
        f'1 – open because {LOADED}: judge again on an idle machine',
        'ROS domain 7: 4 of 7 requirements were judged']


@pytest.mark.parametrize('text, reason', (
    ('topics: {tlit: x}', "topics.tlit: 'x' is not valid; the valid names are cmd_vel, odom"),
    ('names: {tilt: x}', "names.tilt: 'x' is not valid; the valid names are topics, services, f"),
    ('numbers: {platform_radius: true}', 'platform_radius: True is not valid'),
    ('topics: tilt', 'has no attribute'),
    ('{', 'while parsing')))
def test_invalid_profiles_are_refused(tmp_path, text, reason):
    path = tmp_path / 'profile.yaml'
    path.write_text(text)
    with pytest.raises(ValueError) as caught:
        Profile().load(path)
    assert f'{path}: ' in str(caught.value) and reason in str(caught.value)


def test_a_profile_replaces_only_the_listed_names(tmp_path):
    path = tmp_path / 'profile.yaml'
    path.write_text('topics: {tilt: tray}\nservices: {place: put}\nnumbers: {wheel_radius: 1}')
    profile = Profile()
    profile.load(path)
    assert (profile.topics['tilt'], profile.topics['odom']) == ('tray', 'odom')
    assert (profile.services['place'], profile.numbers) == ('put', {'wheel_radius': 1.0})


@pytest.mark.parametrize('name, available, expected', (
    ('drop', {'/arena/drop': [], '/drop_status': []}, ['/arena/drop']),
    ('place', {'/place_brick': [], '/place_node/get_parameters': []}, ['/place_brick']),
    ('platform', {'platform_link': [], 'platform_post': []}, ['platform_link']),
    ('wheel', {'left_wheel': [], 'right_wheel': []}, ['left_wheel', 'right_wheel']),
    ('pose', {'/a/pose': ['turtlesim/msg/Pose'], '/b_pose': []}, ['/a/pose'])))
def test_the_most_similar_names_are_found(name, available, expected):
    assert similar_names(name, available) == expected


@pytest.mark.parametrize('dashes', [['--'], []])
def test_the_command_follows_dashes_that_ros2_run_may_remove(dashes):
    options, command = referee.parse(['--verbose', *dashes, sys.executable, '-c', 'pass'])
    assert (options.verbose, command) == (True, [sys.executable, '-c', 'pass'])
