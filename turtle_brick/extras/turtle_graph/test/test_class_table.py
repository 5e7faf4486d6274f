# SPDX-License-Identifier: Apache-2.0
"""Test the table of a class and the page with it."""

import csv
from xml.etree import ElementTree

import pytest
from turtle_graph.client.record import LOADED
from turtle_graph.referee import referee, report
from turtle_graph.referee.rules.rule import FAILED, Judgment, MET, OPEN

JUDGMENTS = [
    Judgment('b', '', '', FAILED, 'wrong'),
    Judgment('d', '', '', FAILED, 'wrong', follows=['b']),
    Judgment('c', '', '', OPEN, f'not judged: {LOADED} in 1 of 9 trials', loaded=True),
    Judgment('e', '', '', OPEN, 'no data'),
    Judgment('a', '', '', MET, '')]


@pytest.fixture
def judged(tmp_path):
    directory = tmp_path / 'judged'
    (directory / 'dora').mkdir(parents=True)
    for name, judgments, note in (('ann', JUDGMENTS, report.INCOMPLETE),
                                  ('bob', JUDGMENTS[4:], 'ö'), ('dora/late', [], 'ö')):
        (directory / f'{name}.json').write_text(
            report.as_json(judgments, {'date': '2026-11-23', 'notes': [note]}))
    (directory / 'bob.html').touch()
    return directory


def test_the_summary_has_one_row_per_student(judged, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(referee, 'RULES', [rule._replace(name=name) for rule, name in zip(
        referee.RULES, ('f', 'b', 'a'))])
    table, page = tmp_path / 'class.csv', tmp_path / 'class.html'
    assert referee.main(['--summary', str(judged), '--csv', str(table), '--page', str(page)]) == 0
    assert list(csv.reader(table.open(newline=''))) == [
        ['student', MET, FAILED, OPEN, 'failed', 'open', 'date', 'f', 'b', 'a'],
        ['ann', '1', '2', '2', 'b', f'{report.INCOMPLETE}; c (judge again on a less busy '
         'machine); e (no data)', '2026-11-23', '', FAILED, MET],
        ['bob', '1', '0', '0', '', '', '2026-11-23', '', '', MET],
        ['dora/late', '0', '0', '0', 'ö', '', '2026-11-23', '', '', '']]
    html = ElementTree.fromstring(page.read_text().removeprefix('<!DOCTYPE html>'))
    students, hardest = html.findall('.//table')
    assert [link.get('href') for link in students.iter('a')] == ['judged/bob.html'] * 2
    assert [[cell[0].text for cell in row] for row in hardest][1:] == [['b', '1']]
    assert 'dora/late' in capsys.readouterr().out


@pytest.mark.parametrize('text, reason', (
    ('', 'Expecting value'), ('[1]', 'TypeError'), ('{"requirements": []}', "KeyError('notes')")))
def test_an_invalid_file_is_skipped(judged, capsys, tmp_path, text, reason):
    (judged / 'carl.json').write_text(text)
    page = tmp_path / 'class.html'
    assert referee.main(['--summary', str(judged), '--page', str(page)]) == 1
    printed, errors = capsys.readouterr()
    line, = errors.splitlines()
    assert f'{judged}/carl.json is not' in line and reason in line
    assert 'ann' in printed and 'carl.json' in page.read_text()
