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
import re
import shutil
import signal
import subprocess
import sys

import pytest
from turtle_referee.processes import Process

SCRIPTS = Path(__file__).resolve().parents[2] / 'scripts'
INTERPRETER = os.path.realpath(sys.executable)


def load(top):
    """Return the maker as a module that serves another workspace."""
    spec = importlib.util.spec_from_file_location('make_home', SCRIPTS / 'make_home.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.TOP, module.HOME, module.VENV = top, top / '.ros', top / '.ros' / 'venv'
    module.RECORD = top / '.ros' / 'made.json'
    return module


@pytest.fixture
def top(tmp_path):
    """Return a workspace with two small packages, two stand-ins and the scripts themselves."""
    root = tmp_path / 'workspace'
    for name in ('turtle_brick', 'turtle_brick_interfaces', 'turtle_brick/standins/tf2_msgs',
                 'turtle_brick/standins/tf2_ros'):
        folder = root / name
        folder.mkdir(parents=True)
        (folder / 'package.xml').write_text(
            f'<package format="3"><name>{folder.name}</name></package>')
        (folder / 'content.txt').write_text('one')
    shutil.copytree(SCRIPTS, root / 'turtle_brick' / 'scripts')
    return root


@pytest.fixture
def make_home(top):
    """Return the maker of that workspace."""
    return load(top)


def executable(path, text):
    """Write a program."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)
    return path


def test_exported_cmake_files_point_to_this_machine(make_home):
    text = make_home.point_to_this_machine(
        'INCLUDES "/opt/python/cp313-cp313t/include/python3.13t;'
        '/opt/python/cp310-cp310/lib/python3.10/site-packages/numpy/_core/include"\n'
        'LIBRARIES "${_IMPORT_PREFIX}/lib/python3.11/site-packages/a.so;/opt/other"\n'
        '  file(STRINGS "${idl_output}" idl_tuples)\n'
        '  add_custom_target(\n    ament_cmake_python_copy_${package_name}\n    COMMAND a "b"\n'
        '  add_custom_target(\n    ament_cmake_python_build_${package_name}_egg ALL\n'
        '  add_custom_target(\n    ${target} ALL\n',
        '/usr/include/python3.x', '/home/me\\1/packages')
    assert text == (
        'INCLUDES "/usr/include/python3.x;/home/me\\1/packages/numpy/_core/include"\n'
        'LIBRARIES "${_IMPORT_PREFIX}/lib/python3.11/site-packages/a.so;/opt/other"\n'
        '  file(STRINGS "${idl_output}" idl_tuples ENCODING UTF-8)\n'
        '  add_custom_target(\n    ament_cmake_python_copy_${package_name} VERBATIM\n'
        '    COMMAND a "b"\n'
        '  add_custom_target(\n    ament_cmake_python_build_${package_name}_egg ALL VERBATIM\n'
        '  add_custom_target(\n    ${target} ALL\n')


def test_what_takes_long_is_seen_to_go_on_where_there_is_a_terminal(
        make_home, capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, 'isatty', lambda: True)
    monkeypatch.setenv('COLUMNS', '40')
    make_home.run(['printf', f'one\ntwo of many\n{"o" * 99}'], dict(os.environ), 'work', '')
    said = capsys.readouterr().err
    assert re.search(r'work ... \d s two of many', said)
    assert re.search(r'\r  work ... \d s\033\[K\n$', said)
    assert all(len(line.replace('\033[K', '')) < 40 for line in said.split('\r'))


# --------------------------------------------------------------------------- what is out of date

def with_package(prefix, name):
    """Make a prefix that has a package."""
    executable(prefix / 'share/ament_index/resource_index/packages' / name, '')


# A colcon that notes what it is to build, and builds it unless there is a file "broken".
COLCON = f"""#!{INTERPRETER}
import pathlib, sys
top = pathlib.Path.cwd()
selected = sys.argv[sys.argv.index('--packages-select') + 1:sys.argv.index('--build-base')]
with open(top / 'built', 'a') as file:
    print(*selected, file=file)
for name in selected:
    (top / '.ros' / 'install' / name).mkdir(parents=True)
if (top / 'broken').exists():
    sys.exit('error: it is broken')
"""
EVERYTHING = ['tf2_msgs', 'tf2_ros', 'turtle_brick_interfaces', 'turtle_brick']


@pytest.fixture
def built(top, make_home, tmp_path, monkeypatch):
    """Return a function that makes a native home, and returns the names of what it has built."""
    for name in ('colcon', 'cmake'):
        executable(tmp_path / 'tools' / name, COLCON)
    monkeypatch.setenv('PATH', f'{tmp_path}/tools:{os.environ["PATH"]}')
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path / 'prefix'))

    def build(maker=make_home):
        (maker.TOP / 'built').write_text('')
        maker.make_native_home(maker.read_record())
        return (maker.TOP / 'built').read_text().split()

    return build


def test_only_what_changed_is_built_again(top, tmp_path, built):
    assert built() == EVERYTHING
    os.utime(top / 'turtle_brick/content.txt', (1, 1))
    assert built() == []
    for path, names in (
            ('turtle_brick/content.txt', ['turtle_brick']),
            ('turtle_brick/empty.txt', ['turtle_brick']),
            *((f'turtle_brick/{path}', []) for path in (
                'test/test_new.py', 'scripts/demo', 'doc/page.md', 'inner/__pycache__/a.pyc',
                '.pytest_cache/a', '.content.txt.swp', 'turtle_brick.egg-info/a')),
            ('turtle_brick_interfaces/content.txt', ['turtle_brick_interfaces']),
            ('turtle_brick/standins/tf2_ros/content.txt', ['tf2_ros'])):
        executable(top / path, 'changed')
        assert built() == names, path
        assert built() == []
    content = top / 'turtle_brick/content.txt'
    for change in (lambda: content.write_text('CHANGED'), lambda: content.chmod(0o644),
                   lambda: content.rename(content.with_name('content.text')),
                   (top / 'turtle_brick/empty.txt').unlink):
        change()
        assert built() == ['turtle_brick']
    with_package(tmp_path / 'prefix', 'rclpy')
    assert built() == EVERYTHING
    for package, folder in (('tf2_msgs', 'tf2_msgs'), ('tf2_ros_py', 'tf2_ros')):
        with_package(tmp_path / 'prefix', package)
        assert built() == []
        assert not (top / '.ros/install' / folder).exists()
    shutil.rmtree(top / '.ros/install/turtle_brick')
    assert built() == ['turtle_brick']
    assert built(load(top.rename(top.with_name('moved')))) == EVERYTHING[2:]


def test_a_failed_build_is_shown_and_tried_again(top, make_home, built, capsys):
    (top / 'broken').touch()
    with pytest.raises(make_home.HomeError, match='colcon could not build tf2_msgs, tf2_ros'):
        built()
    assert 'error: it is broken' in capsys.readouterr().err
    (top / 'broken').unlink()
    assert built() == EVERYTHING
    (top / '.ros/made.json').write_text('{"tf2_ro')
    assert built() == EVERYTHING


# ---------------------------------------------------------------- what is missing on the machine

def maker(top, kind='pypi', before=''):
    """Return the command that runs the maker after some preparations."""
    program = top / 'turtle_brick' / 'scripts' / 'make_home.py'
    return [INTERPRETER, '-c', f'import sys\n{before}\nimport runpy\nsys.argv[:] = '
            f'[{str(program)!r}, {kind!r}]\nrunpy.run_path(sys.argv[0], run_name="__main__")']


def refusal(top, kind='pypi', before='', **variables):
    """Run the maker where something is missing: return its sentence, having seen what it left."""
    files = sorted(top.rglob('*'))
    done = subprocess.run(maker(top, kind, before), env={**os.environ, **variables}, cwd='/',
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True)
    assert done.returncode == 1, done.stdout
    assert sorted(top.rglob('*')) == files
    assert variables.get('PIP_SAYS', '') in done.stdout
    sentence = done.stdout.splitlines()[-1]
    assert sentence.startswith('turtle_brick: ')
    return sentence


# A Python that makes virtual environments of itself, and whose pip fails with the words that a
# variable has; with the word "wait" it goes on until the maker has ended.
PYTHON = """#!/bin/sh
if [ "$1 $2" = "-m venv" ]; then
  mkdir -p "$3/bin" && cp "$0" "$3/bin/python" && : > "$3/attempt"
elif [ "$1 $2" = "-m pip" ]; then
  echo "$PIP_SAYS"
  if [ "$PIP_SAYS" = wait ]; then while kill -0 $PPID; do sleep 0.05; done; fi
  exit 1
fi
"""


def fake_python(top):
    """Return what makes the maker use a Python of that kind."""
    return f'sys._base_executable = {str(executable(top.with_name("python"), PYTHON))!r}'


ANOTHER_MACHINE = 'import platform; platform.machine = lambda: "aarch64"'
WORKING = '#!/bin/sh\nexit 0\n'


@pytest.mark.parametrize('before, says, words', [
    (ANOTHER_MACHINE, '', ['x86-64', 'aarch64', 'install']),
    ('import platform; platform.libc_ver = lambda: ("glibc", "2.17")', '', ['2.28', 'glibc 2.17']),
    ('sys.modules["ensurepip"] = None', '', ['virtual environments', '-venv']),
    ('import sysconfig; sysconfig.get_path = lambda _: "/no/include"', '',
     ['/no/include/Python.h', '-dev']),
    ('', 'ERROR: No space left', ['pip could not install', 'network'])])
def test_what_the_python_or_the_machine_lacks_or_pip_fails_for_is_said(top, before, says, words):
    """And nothing stays."""
    sentence = refusal(top, before=before or fake_python(top), PIP_SAYS=says)
    assert all(word in sentence for word in words), sentence


@pytest.mark.parametrize('name, words', [
    ('work:space', "contains ':'"), ('a\nb', "contains '\\n'"),
    ('C++ & co. Übung #1 日本 ~100%', 'aarch64')])
def test_a_path_of_every_day_is_taken_and_one_that_cannot_be_is_refused(top, name, words):
    """Where the path fits, what is missed is what comes after it: here, a machine that fits."""
    assert words in refusal(top.rename(top.with_name(name)), before=ANOTHER_MACHINE)


@pytest.mark.parametrize('kind, programs, variables, words', [
    ('pypi', {}, {}, ['There is no C compiler', 'cc, gcc, clang', 'build-essential']),
    ('pypi', {'gcc': WORKING}, {}, ['There is no C++ compiler', 'c++, g++, clang++']),
    ('pypi', {'gcc': WORKING, 'g++': WORKING}, {'CXX': 'icpc -O'}, ['PATH: icpc. Install']),
    ('native', {}, {'AMENT_PREFIX_PATH': ''}, ['There is no colcon', 'sudo apt install'])])
def test_a_program_that_is_missing_is_said(
        top, tmp_path, kind, programs, variables, words):
    for name, text in programs.items():
        executable(tmp_path / 'tools' / name, text)
    sentence = refusal(top, kind, **{
        'CC': '', 'CXX': '', 'PATH': f'{tmp_path}/tools', **variables})
    assert all(word in sentence for word in words), sentence


def test_a_home_that_was_not_finished_is_not_taken_for_a_good_one(top):
    for path in ('venv/attempt', 'install/turtle_brick/a', 'build/turtle_brick/a', 'log/a'):
        executable(top / '.ros' / path, '')
    executable(top / '.ros/mine.txt', 'kept')
    with Process(maker(top, before=fake_python(top)), {'PIP_SAYS': 'oops'}) as process:
        assert process.wait(20.0) == 1
    assert [path.name for path in (top / '.ros').iterdir()] == ['mine.txt']


@pytest.fixture
def waiting(top):
    """Return a maker that is in the middle of an installation."""
    with Process(maker(top, before=fake_python(top)), {'PIP_SAYS': 'wait'}) as process:
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
    with Process(maker(top, before=fake_python(top)), {'PIP_SAYS': 'oops'}) as second:
        second.wait_for_output('another process is making this home', 20.0)
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
