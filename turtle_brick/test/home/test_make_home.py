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
"""The home's maker rebuilds what changed, refuses in one sentence, believes nothing half-made."""

import importlib.util
import os
from pathlib import Path
import platform
import re
import shutil
import signal
import subprocess
import sys
import sysconfig

import pytest
from turtle_referee.graph_client.processes import Process

SCRIPTS = Path(__file__).resolve().parents[2] / 'scripts'


@pytest.fixture
def top(tmp_path):
    """Return a workspace with two small packages, two stand-ins and the scripts themselves."""
    root = tmp_path / 'workspace'
    for name in ('turtle_brick', 'turtle_brick_interfaces', 'turtle_brick/standins/tf2_msgs',
                 'turtle_brick/standins/tf2_ros'):
        folder = root / name
        executable(folder / 'content.txt', 'one')
        (folder / 'package.xml').write_text(
            f'<package format="3"><name>{folder.name}</name></package>')
    shutil.copytree(SCRIPTS, root / 'turtle_brick' / 'scripts')
    return root


def load(top):
    """Return the maker of a workspace, as a module."""
    spec = importlib.util.spec_from_file_location(
        'make_home', top / 'turtle_brick' / 'scripts' / 'make_home.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def make_home(top):
    """Return the maker of that workspace."""
    return load(top)


def executable(path, text=''):
    """Write a program."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)
    return path


def test_exported_cmake_files_point_to_this_machine(make_home):
    """And take a path of every day."""
    text = make_home.point_to_this_machine(
        'INCLUDES "/opt/python/cp313-cp313t/include/python3.13t;'
        '/opt/python/cp310-cp310/lib/python3.10/site-packages/numpy/_core/include"\n'
        'LIBRARIES "${_IMPORT_PREFIX}/lib/python3.11/site-packages/a.so;/opt/other"\n'
        '  file(STRINGS "${idl_output}" idl_tuples)\n'
        '  add_custom_target(\n    ament_cmake_python_copy_${package_name}\n    COMMAND a "b"\n'
        '  add_custom_target(\n    ${target} ALL\n',
        '/usr/include/python3.x', '/home/me\\1/packages')
    assert text == (
        'INCLUDES "/usr/include/python3.x;/home/me\\1/packages/numpy/_core/include"\n'
        'LIBRARIES "${_IMPORT_PREFIX}/lib/python3.11/site-packages/a.so;/opt/other"\n'
        '  file(STRINGS "${idl_output}" idl_tuples ENCODING UTF-8)\n'
        '  add_custom_target(\n    ament_cmake_python_copy_${package_name} VERBATIM\n'
        '    COMMAND a "b"\n'
        '  add_custom_target(\n    ${target} ALL\n')


def test_what_takes_long_is_seen_to_go_on_where_there_is_a_terminal(
        make_home, capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, 'isatty', lambda: True)
    monkeypatch.setenv('COLUMNS', '40')
    make_home.run(['printf', f'one\ntwo of many\n{"o" * 99}'], dict(os.environ), 'work', '')
    said = capsys.readouterr().err
    assert re.search(r'work ... \d s two of many', said)
    assert re.search(r'\r  work ... \d s\033\[K\n$', said)
    assert all(len(line.replace('\033[K', '')) <= 40 for line in said.split('\r'))


# --------------------------------------------------------------------------- what is out of date

# A colcon that notes what it is to build, and builds it unless there is a file "broken".
COLCON = f"""#!{os.path.realpath(sys.executable)}
import pathlib, sys
top = pathlib.Path.cwd()
selected = sys.argv[sys.argv.index('--packages-select') + 1:sys.argv.index('--build-base')]
(top / 'built').write_text(' '.join(selected))
for name in selected:
    (top / '.ros' / 'install' / name).mkdir(parents=True)
if (top / 'broken').exists():
    sys.exit('error: it is broken')
"""
EVERYTHING = ['tf2_msgs', 'tf2_ros', 'turtle_brick_interfaces', 'turtle_brick']


def with_package(prefix, name):
    """Make a prefix that has a package."""
    executable(prefix / 'share/ament_index/resource_index/packages' / name)


@pytest.fixture
def built(make_home, tmp_path, monkeypatch):
    """Return a function that makes a native home, and returns the names of what it has built."""
    for name in ('colcon', 'cmake'):
        executable(tmp_path / 'tools' / name, COLCON)
    monkeypatch.setenv('PATH', f'{tmp_path}/tools:{os.environ["PATH"]}')
    # the home itself is in the prefixes of a shell that has sourced it
    with_package(make_home.HOME / 'sourced', 'tf2_msgs')
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{make_home.HOME}/sourced:{tmp_path}/prefix')

    def build(maker=make_home):
        (maker.TOP / 'built').write_text('')
        maker.make_native_home(maker.read_record())
        return (maker.TOP / 'built').read_text().split()

    return build


def test_only_what_changed_is_built_again(top, tmp_path, built):
    assert built() == EVERYTHING
    content = top / 'turtle_brick/content.txt'
    os.utime(content, (1, 1))
    for path in ('test/test_new.py', 'scripts/demo', 'doc/page.md', 'inner/__pycache__/a.pyc',
                 '.pytest_cache/a', '.content.txt.swp', 'turtle_brick.egg-info/a'):
        executable(top / 'turtle_brick' / path)
    assert built() == []
    for name in ('turtle_brick', 'turtle_brick_interfaces', 'turtle_brick/standins/tf2_ros'):
        executable(top / name / 'content.txt', 'changed')
        assert built() == [Path(name).name]
        assert built() == []
    for change in (lambda: content.chmod(0o644), lambda: executable(content.with_name('empty')),
                   lambda: content.rename(content.with_name('content.text'))):
        change()
        assert built() == ['turtle_brick']
    for package, again in (('rclpy', EVERYTHING), ('tf2_msgs', []), ('tf2_ros_py', [])):
        with_package(tmp_path / 'prefix', package)
        assert built() == again
    assert {path.name for path in (top / '.ros/install').iterdir()} == set(EVERYTHING[2:])
    shutil.rmtree(top / '.ros/install/turtle_brick')
    assert built() == ['turtle_brick']
    assert built(load(top.rename(top.with_name('moved')))) == EVERYTHING[2:]


def test_a_failed_build_is_shown_and_tried_again(top, make_home, built, capsys):
    assert built() == EVERYTHING
    content = top / 'turtle_brick/content.txt'
    content.write_text('changed')
    (top / 'broken').touch()
    with pytest.raises(make_home.HomeError, match='colcon could not build turtle_brick'):
        built()
    assert 'error: it is broken' in capsys.readouterr().err
    (top / 'broken').unlink()
    content.write_text('one')
    assert built() == ['turtle_brick']
    (top / '.ros/made.json').write_text('{"tf2_ro')
    assert built() == EVERYTHING


# ---------------------------------------------------------------- what is missing on the machine

# A Python that makes virtual environments of itself, and whose pip says what a variable has, and
# fails; with the word "wait" it goes on until the maker has ended.
PYTHON = """#!/bin/sh
if [ "$1 $2" = "-m venv" ]; then
  mkdir -p "$3/bin" && cp "$0" "$3/bin/python" && : > "$3/attempt"
elif [ "$1 $2" = "-m pip" ]; then
  echo "$PIP_SAYS"
  if [ "$PIP_SAYS" = wait ]; then while kill -0 $PPID; do sleep 0.05; done; fi
  exit 1
fi
"""


def refusal(make_home, make='make_pypi_home'):
    """Make a home where something is missing: return the sentence; nothing is left behind."""
    with pytest.raises(make_home.HomeError) as refused:
        getattr(make_home, make)({})
    assert not make_home.HOME.exists()
    return str(refused.value)


@pytest.mark.parametrize('whose, name, value, words', [
    (platform, 'machine', lambda: 'aarch64', ['x86-64', 'aarch64', 'install']),
    (platform, 'libc_ver', lambda: ('glibc', '2.17'), ['2.28', 'glibc 2.17']),
    (sysconfig, 'get_path', lambda _: '/no/include', ['/no/include/Python.h', '-dev'])])
def test_what_the_machine_lacks_is_said(make_home, monkeypatch, whose, name, value, words):
    monkeypatch.setattr(whose, name, value)
    assert all(word in refusal(make_home) for word in words)


def test_a_python_without_virtual_environments_is_said(make_home, monkeypatch):
    monkeypatch.setitem(sys.modules, 'ensurepip', None)
    assert '-venv"' in refusal(make_home)


def test_a_program_that_is_missing_is_said(make_home, tmp_path, monkeypatch):
    monkeypatch.setenv('PATH', f'{tmp_path}/tools')
    monkeypatch.setenv('AMENT_PREFIX_PATH', '')
    assert 'colcon' in refusal(make_home, 'make_native_home')
    assert 'no C compiler' in refusal(make_home)
    executable(tmp_path / 'tools' / 'gcc')
    sentence = refusal(make_home)
    assert 'no C++ compiler' in sentence and 'sudo apt install build-essential' in sentence


@pytest.mark.parametrize('name, words', [
    ('work:space', "contains ':'"), ('a\nb', "contains '\\n'"),
    ('C++ & co. Übung #1 日本 ~100%', 'aarch64')])
def test_a_path_of_every_day_is_taken_and_one_that_cannot_be_is_refused(
        top, monkeypatch, name, words):
    """Where the path fits, what is missed is what comes after it: here, a machine that fits."""
    monkeypatch.setattr(platform, 'machine', lambda: 'aarch64')
    assert words in refusal(load(top.rename(top.with_name(name))))


def test_what_pip_says_is_shown(top, make_home, monkeypatch, capsys):
    monkeypatch.setattr(sys, '_base_executable', executable(top.with_name('python'), PYTHON))
    monkeypatch.setenv('PIP_SAYS', 'ERROR: No space left')
    assert 'pip could not install' in refusal(make_home)
    assert 'ERROR: No space left' in capsys.readouterr().err


def test_nothing_that_was_not_finished_is_kept(make_home, monkeypatch):
    for path in ('venv/attempt', 'install/turtle_brick/a', 'build/turtle_brick/a'):
        executable(make_home.HOME / path)
    for name in ('make_venv', 'build'):
        monkeypatch.setattr(make_home, name, lambda *_: None)
    make_home.make_pypi_home({})
    assert [path.name for path in make_home.HOME.iterdir()] == ['made.json']


def maker(top, pip_says):
    """Start the maker with that Python."""
    base = executable(top.with_name('python'), PYTHON)
    program = top / 'turtle_brick' / 'scripts' / 'make_home.py'
    return Process([os.path.realpath(sys.executable), '-c', 'import runpy, sys\n'
                    f'sys._base_executable, sys.argv[1:] = {str(base)!r}, ["pypi"]\n'
                    f'runpy.run_path({str(program)!r}, run_name="__main__")'],
                   {'PIP_SAYS': pip_says})


@pytest.fixture
def waiting(top):
    """Return a maker that is in the middle of an installation."""
    with maker(top, 'wait') as process:
        process.wait_for_output('the package index', 20.0)
        assert (top / '.ros/venv/attempt').exists()
        yield process


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGHUP])
def test_an_interruption_leaves_nothing(top, waiting, number):
    assert waiting.stop(number) == 1
    assert waiting.output.splitlines()[-1] == (
        'turtle_brick: Interrupted: the home is not ready.')
    assert not (top / '.ros').exists()


def test_two_at_once_take_turns(top, waiting):
    with maker(top, 'oops') as second:
        second.wait_for_output('another process is making this home', 20.0)
        with pytest.raises(TimeoutError):
            second.wait_for_output('oops', 1.0)
        waiting.kill()  # leaves what it has begun, which is not believed
        assert second.wait(20.0) == 1
        assert 'oops' in second.output
    assert not (top / '.ros').exists()


# -------------------------------------------------------------------------------- scripts/test

@pytest.mark.parametrize('lines, said, status', [
    ([], '0 passed, 0 failed, 0 skipped', 1),
    (['a b/pytest.xml: 5 tests, 0 errors, 0 failures, 2 skipped',
      'c/lint.xunit.xml: 1 test, 0 errors, 0 failures, 0 skipped',
      'c/Testing/2/Test.xml: 9 tests, 0 errors, 9 failures, 0 skipped',
      '', 'Summary: 15 tests, 0 errors, 9 failures, 2 skipped'],
     '4 passed, 0 failed, 2 skipped', 0),
    (['pytest.xml: 5 tests, 1 error, 2 failures, 1 skipped'], '1 passed, 3 failed, 1 skipped', 1)])
def test_the_last_line_counts_every_test_once(lines, said, status):
    done = subprocess.run(['awk', '-f', str(SCRIPTS / 'summary.awk')], input='\n'.join(lines),
                          stdout=subprocess.PIPE, text=True)
    assert (done.stdout, done.returncode) == (f'{said}\n', status)
