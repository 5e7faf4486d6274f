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
"""What the referee is told in options and files, and how it tells of one graph and of many."""

import csv
import json
from math import inf, nan
import sys
from xml.etree import ElementTree

from browser import Chromium, find_chromium
import pytest
from turtle_referee import referee, report
from turtle_referee.graph_client.profile import Profile, ProfileError
from turtle_referee.rules.rule import BROKEN, Judgement, KEPT, OPEN, Plot, Series

JUDGEMENTS = [
    Judgement('b', 'ж', 'ö', BROKEN, '-' * 300, Plot(
        'Empty', '', '', [], Series('line', [], []))),
    Judgement('d', '', '', BROKEN, 'wrong', follows=['b']),
    Judgement('c', '', '', OPEN, '50.00 Hz; not judged: the machine stood still in 1 of 9 trials'),
    Judgement('e', '', '', OPEN, 'nobody asked'),
    Judgement('a', 'words <b> & "more"', 'x [red]', KEPT, '1 < 2 & [bold]3[/bold]', Plot(
        'Title <&>', 'x (m)', 'y & z', [Series('<points>', [0.0, 1.0, nan], [1.0, inf, 2.0])],
        Series('line', [0.0, 1.0], [0.0, 1.0])))]

ABOUT = {'seconds': nan, 'command': 'ros2 <tag>', 'versions': {'rclpy': '7.1'}, 'notes': ['ö'],
         'date': '2026-11-23'}


def parse(page):
    """Return the root of a page that closes all tags but these."""
    assert page.startswith('<!DOCTYPE html>')
    for tag in ('meta charset="utf-8"', 'meta name="viewport" content="width=device-width"'):
        page = page.replace(f'<{tag}>', f'<{tag}/>')
    return ElementTree.fromstring(page.removeprefix('<!DOCTYPE html>'))


def test_the_page_is_a_page():
    root = parse(report.page(JUDGEMENTS, ABOUT))
    for words in ('date: 2026-11-23', 'command: ros2 <tag>', 'versions: rclpy 7.1', 'notes: ö'):
        assert words in [one.text for one in root.iter('p')]
    assert len(root.findall('.//table/tr')) == 1 + len(JUDGEMENTS)
    assert [one.tag for one in root.find('body/main')][-3:] == [
        'table', *['{http://www.w3.org/2000/svg}svg'] * 2]


@pytest.mark.skipif(find_chromium() is None, reason='Chromium is not installed')
def test_the_pages_do_not_overflow(tmp_path, judged):
    """On a phone, long words, wide plots and many columns are as wide as the window."""
    (tmp_path / 'page.html').write_text(report.page(JUDGEMENTS, ABOUT))
    report.summarize(judged, ['b', 'a'], None, tmp_path / 'class.html')
    with Chromium(400) as browser:
        for name in ('page', 'class'):
            browser.go_to(f'file://{tmp_path}/{name}.html')
            browser.wait_for(f'location.href.endsWith("{name}.html") && document.querySelector'
                             '("table") && document.readyState === "complete"')
            assert browser.evaluate('document.documentElement.scrollWidth') == 400


def test_the_json_has_everything():
    told = json.loads(report.as_json(JUDGEMENTS, ABOUT), parse_constant=pytest.fail)
    assert [one['mark'] for one in told['requirements']] == [BROKEN, BROKEN, OPEN, OPEN, KEPT]
    assert told['requirements'][4]['plot']['points'][0]['y'] == [1.0, None, 2.0]
    assert told['requirements'][1]['follows'] == ['b']
    assert told['seconds'] is None and told['notes'] == ['ö']


def test_the_terminal_shows_words_as_they_are_and_again_what_is_not_kept(capsys):
    report.print_judgements(JUDGEMENTS, ['ö'])
    table, _, again = capsys.readouterr().out.partition('\n\n')
    assert '[bold]3[/bold]' in table and 'x [red]' in table
    assert again.splitlines() == [
        f'{BROKEN} b: {"-" * 300}', f'{BROKEN} d: wrong; may follow from: b',
        f'{OPEN} c: {JUDGEMENTS[2].measured}', f'{OPEN} e: nobody asked', 'note: ö',
        '1 ✔ kept, 2 ✗ broken, 2 – open']


# ----------------------------------------------------------------------------------- of a class

@pytest.fixture
def judged(tmp_path):
    """Return a directory with what was written about some workspaces, and something else."""
    directory = tmp_path / 'judged'
    (directory / 'dora').mkdir(parents=True)
    for name, judgements in (('ann', JUDGEMENTS), ('bob', JUDGEMENTS[4:]), ('dora/late', [])):
        (directory / f'{name}.json').write_text(report.as_json(judgements, ABOUT))
    (directory / 'bob.html').touch()
    return directory


def test_a_class_is_told_a_row_each(judged, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(referee, 'RULES', [rule._replace(name=name) for rule, name in zip(
        referee.RULES, ('f', 'b', 'a'))])
    table, page = tmp_path / 'class.csv', tmp_path / 'class.html'
    assert referee.main(['--summary', str(judged), '--csv', str(table), '--page', str(page)]) == 0
    assert list(csv.reader(table.open(newline=''))) == [
        ['student', KEPT, BROKEN, OPEN, 'broken', 'open', 'date', 'f', 'b', 'a'],
        ['ann', '1', '2', '2', 'b', 'c (judge again on a quieter machine); e (nobody asked)',
         '2026-11-23', '', BROKEN, KEPT],
        ['bob', '1', '0', '0', '', '', '2026-11-23', '', '', KEPT],
        ['dora/late', '0', '0', '0', 'nothing judged, ö', '', '2026-11-23', '', '', '']]
    students, hardest = parse(page.read_text()).findall('.//table')
    assert [one.get('href') for one in students.iter('a')] == ['judged/bob.html']
    assert [[cell[0].text for cell in row] for row in hardest][1:] == [['b', '1']]
    assert 'dora/late' in capsys.readouterr().out


@pytest.mark.parametrize('text, complaint', (
    ('', 'Expecting value'), ('[1]', 'TypeError'), ('{"requirements": []}', "KeyError('notes')")))
def test_what_the_referee_did_not_write_stops_no_others(judged, capsys, tmp_path, text, complaint):
    (judged / 'carl.json').write_text(text)
    page = tmp_path / 'class.html'
    assert referee.main(['--summary', str(judged), '--page', str(page)]) == 1
    told, errors = capsys.readouterr()
    line, = errors.splitlines()
    assert f'{judged}/carl.json: ' in line and complaint in line
    assert 'ann' in told and 'carl.json' in page.read_text()


def test_what_can_not_be_summed_up_is_said(tmp_path, capsys):
    assert referee.main(['--summary', str(tmp_path)]) == 2
    assert f'{tmp_path}: no JSON file is there' in capsys.readouterr().err
    for options in (['--csv', 'x.csv'], ['--summary', str(tmp_path), '--', 'true']):
        with pytest.raises(SystemExit):
            referee.main(options)


# ----------------------------------------------------------------------- what the referee is told

@pytest.mark.parametrize('text, complaint', (
    ('topics: {tlit: x}', "topics.tlit: 'x' means nothing; there are: cmd_vel, odom"),
    ('names: {tilt: x}', "names.tilt: 'x' means nothing; there are: topics, services, numbers"),
    ('topics: {tilt: ""}', "topics.tilt: '' means nothing"),
    ('numbers: {platform_radius: true}', 'platform_radius: True means nothing'),
    ('topics: tilt', 'has no attribute'),
    ('{', 'while parsing')))
def test_profiles_that_can_not_be_used(tmp_path, text, complaint):
    path = tmp_path / 'profile.yaml'
    path.write_text(text)
    with pytest.raises(ProfileError) as caught:
        Profile().load(path)
    assert f'{path}: ' in str(caught.value) and complaint in str(caught.value)


def test_what_differs_is_taken_over(tmp_path):
    path = tmp_path / 'profile.yaml'
    path.write_text('topics: {tilt: tray}\nservices: {place: put}\nnumbers: {wheel_radius: 1}')
    profile = Profile()
    profile.load(path)
    assert (profile.topics['tilt'], profile.topics['odom']) == ('tray', 'odom')
    assert (profile.services['place'], profile.numbers) == ('put', {'wheel_radius': 1.0})


@pytest.mark.parametrize('dashes', [['--'], []])
def test_the_command_is_found_behind_dashes_that_ros2_run_may_have_taken(dashes):
    options, command = referee.parse(['--verbose', *dashes, sys.executable, '-c', 'pass'])
    assert (options.verbose, command) == (True, [sys.executable, '-c', 'pass'])
