# SPDX-License-Identifier: Apache-2.0
"""Test that one command judges all workspaces and rejects invalid options."""

import csv
from pathlib import Path
import re
import sys

import psutil
import pytest
from turtle_graph.client.processes import Process
from turtle_graph.client.spinning import STOP_SIGNALS
from turtle_graph.referee import classroom, referee
from turtle_graph.referee.rules.rule import FAILED
from turtle_graph.referee.trial import configured_numbers

ROOT = Path(__file__).resolve().parents[3]

TIMEOUT = 120.0
"""Timeout (s) for the output and the end of the referee."""


def test_each_requirement_belongs_to_the_hour_on_the_page():
    table = re.findall(r'^\| (\d) \|.*\| (.*) \|$', (ROOT / 'doc/judging.md').read_text(), re.M)
    listed = {int(hour): re.findall('`([^`]+)`', names) for hour, names in table}
    rules = [classroom.rules_in_hour(referee.RULES, hour) for hour in classroom.HOURS]
    assert sorted(sum(rules, [])) == sorted(referee.RULES)
    for hour, names in zip(classroom.HOURS, rules):
        beginnings = tuple(name.removesuffix('…').rstrip(': ') for name in listed[hour])
        assert all(rule.name.startswith(beginnings) for rule in names), hour
        assert set(beginnings) == set(classroom.HOURS[hour])


BUILD_ERROR = """Traceback (most recent call last):
  File "setup.py", line 3, in <module>
SyntaxError: invalid syntax
"""


@pytest.fixture
def students(tmp_path, monkeypatch):
    """Make workspaces of students whose graphs cannot start, each for another reason."""
    monkeypatch.chdir(tmp_path)
    for name, prefix in (('ann', tmp_path), ('carl', '/nowhere'), ('dora', tmp_path),
                         ('eve', tmp_path)):
        share = tmp_path / f'class/{name}/install/share'
        for directory in ('turtle_brick', 'ament_index/resource_index/packages'):
            (share / directory).mkdir(parents=True)
        (share / 'ament_index/resource_index/packages/turtle_brick').touch()
        (share / 'turtle_brick/package.xml').touch()
        (share / 'turtle_brick/turtle_arena.launch.py').write_text('import turtle_brick')
        (share / 'turtle_brick/turtle_arena.launch.xml').write_text(
            '<launch><executable cmd="false"/></launch>')
        (share.parent / 'local_setup.bash').write_text(
            f'export AMENT_PREFIX_PATH={share.parent}:$AMENT_PREFIX_PATH')
        (share.parent / 'setup.sh').write_text(
            f'_colcon_prefix_chain_sh_COLCON_CURRENT_PREFIX={prefix}\n')
    for directory in ('src', 'install/share/turtle_brick/hook', 'log/latest_build/turtle_brick'):
        (tmp_path / 'class/bob' / directory).mkdir(parents=True)
    (tmp_path / 'class/bob/install/local_setup.bash').touch()
    (tmp_path / 'class/bob/log/latest_build/events.log').write_text(
        "[0.2] (turtle_brick) JobEnded: {'identifier': 'turtle_brick', 'rc': 1}\n")
    (tmp_path / 'class/bob/log/latest_build/turtle_brick/stderr.log').write_text(BUILD_ERROR)
    # The setup file of dora is not UTF-8, and one of eve cannot be read.
    (tmp_path / 'class/dora/install/setup.sh').write_bytes(b'\xff\n')
    (tmp_path / 'class/dora/install/local_setup.bash').write_bytes(b'echo "\xff\x1b[2J"; exit 3\n')
    (tmp_path / 'class/eve/install/setup.sh').unlink()
    (tmp_path / 'class/eve/install/setup.sh').mkdir()
    return 'class'


def test_no_workspace_ends_the_judging_of_the_others(students):
    assert referee.main(['--class', students, '--hour', '3']) == 2
    ann, bob, carl, dora, eve = csv.DictReader(open('judged/class.csv', newline=''))
    assert 'turtle_arena.launch.py: found no graph: ModuleNotFoundError: No' in ann['failed']
    assert ann['failed'].endswith('.xml: found no graph: false crashed: exit status 1')
    assert bob['failed'] == 'not built: turtle_brick: SyntaxError: invalid syntax'
    assert 'not built on this machine: install belongs in /nowhere, ' in carl['open']
    assert dora['failed'].endswith('bash exited with status 3: \ufffd')
    assert 'not judged: [Errno 21] Is a directory' in eve['open']
    assert [row[FAILED] for row in (ann, bob, carl, dora, eve)] == ['1', '1', '0', '1', '0']
    assert 'drop' in ann and 'tilt' not in ann
    assert all(f'href="{name}.html"' in Path('judged/class.html').read_text() for name in (
        'ann', 'bob', 'carl', 'dora', 'eve'))
    assert 'SyntaxError: invalid syntax' in Path('judged/bob.html').read_text()
    assert Path('judged/.gitignore').read_text() == '*\n'


def test_the_referee_reads_the_configuration_of_the_workspace(tmp_path, monkeypatch):
    share = tmp_path / 'install/share/turtle_brick'
    packages = share.parent / 'ament_index/resource_index/packages'
    for directory in (share / 'config', packages):
        directory.mkdir(parents=True)
    (packages / 'turtle_brick').touch()
    (share / 'config/turtle.yaml').write_text('robot: {ros__parameters: {wheel_radius: 0.3}}')
    environment = classroom.judging_environment(tmp_path / 'install', share)
    monkeypatch.setenv('AMENT_PREFIX_PATH', environment['AMENT_PREFIX_PATH'])
    assert configured_numbers() == {'wheel_radius': 0.3}


HIDDEN = 'setsid env -i sleep 100'
"""A program in a session of its own, without the environment of the referee."""


@pytest.mark.parametrize('number', STOP_SIGNALS)
def test_a_signal_ends_all_processes(students, number):
    with Process([str(ROOT / 'scripts/referee'), '--verbose', '--class', students, '--',
                  'bash', '-c', f'({HIDDEN} & echo process $!); exec sleep 100']) as process:
        pid = int(process.wait_for_output(r'process (\d+)', TIMEOUT)[1])
        child = psutil.Process(pid)
        assert process.stop(number, TIMEOUT) == 2
    assert process.output.endswith('referee: interrupted\n') and 'Traceback' not in process.output
    child.wait(5.0)  # Shorter than the sleep.


@pytest.mark.parametrize('options, reason', (
    (['--class', 'missing'], '--class missing is not a directory'),
    (['--class', '.'], '. has no subdirectories'),
    (['--class', str(ROOT.parent)], ' is a workspace, but --class requires a directory with'),
    (['--class', '.', '--summary', '.'], '--class cannot be combined with'),
    (['--summary', '.'], 'there is no JSON file in .'),
    (['--summary', '.', '--', 'true'], '--summary cannot be combined with'),
    (['--csv', 'x.csv'], '--csv requires --summary or --class')))
def test_invalid_options_are_refused(tmp_path, monkeypatch, capsys, options, reason):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        sys.exit(referee.main(options))
    assert end.value.code == 2 and reason in capsys.readouterr().err
