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
import shutil
import signal
import stat
import subprocess
import sys

from live_graph import NodeProcess
import pytest

SCRIPTS = Path(__file__).resolve().parents[2] / 'scripts'
INTERPRETER = os.path.realpath(sys.executable)


def load(top):
    """Return the maker as a module that serves another workspace."""
    spec = importlib.util.spec_from_file_location('make_home', SCRIPTS / 'make_home.py')
    module = importlib.util.module_from_spec(spec)
    sys.modules['make_home'] = module
    spec.loader.exec_module(module)
    module.TOP, module.HOME, module.VENV = top, top / '.ros', top / '.ros' / 'venv'
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


def executable(path, text):
    """Write a program."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


# ------------------------------------------------------------------------------ exported CMake

@pytest.mark.parametrize('tag, version', [
    ('cp310-cp310', '3.10'), ('cp311-cp311', '3.11'), ('cp312-cp312', '3.12'),
    ('cp313-cp313', '3.13'), ('cp313-cp313t', '3.13t')])
def test_exported_cmake_files_point_to_this_machine(top, tag, version):
    make_home = load(top)
    text = make_home.point_to_this_machine(
        f'INCLUDES "/opt/python/{tag}/include/python{version};'
        f'/opt/python/{tag}/lib/python{version}/site-packages/numpy/_core/include"\n'
        'LIBRARIES "${_IMPORT_PREFIX}/lib/python3.11/site-packages/a.so;/opt/other"\n',
        '/usr/include/python3.x', '/home/me\\1/packages')
    assert text == (
        'INCLUDES "/usr/include/python3.x;/home/me\\1/packages/numpy/_core/include"\n'
        'LIBRARIES "${_IMPORT_PREFIX}/lib/python3.11/site-packages/a.so;/opt/other"\n')


def test_exported_cmake_files_take_any_path(top):
    make_home = load(top)
    assert make_home.point_to_this_machine(
        '  file(STRINGS "${idl_output}" idl_tuples)\n'
        '  add_custom_target(\n    ament_cmake_python_copy_${package_name}\n    COMMAND a "b"\n'
        '  add_custom_target(\n    ament_cmake_python_build_${package_name}_egg ALL\n'
        '  add_custom_target(\n    ${target} ALL\n', '', '') == (
        '  file(STRINGS "${idl_output}" idl_tuples ENCODING UTF-8)\n'
        '  add_custom_target(\n    ament_cmake_python_copy_${package_name} VERBATIM\n'
        '    COMMAND a "b"\n'
        '  add_custom_target(\n    ament_cmake_python_build_${package_name}_egg ALL VERBATIM\n'
        '  add_custom_target(\n    ${target} ALL\n')


# ------------------------------------------------------------------------------------ Fast DDS

def test_only_the_wait_that_is_known_is_changed(top):
    make_home = load(top)
    known = make_home.FOR_EVER
    assert make_home.with_patience(b'a' + known + b'z') == b'a' + make_home.AN_HOUR + b'z'
    for other in (b'az', known * 2, known[1:], known[:-1]):
        assert make_home.with_patience(other) == other


# --------------------------------------------------------------------------- what is out of date

@pytest.mark.parametrize('change', [
    lambda folder: (folder / 'content.txt').write_text('two'),
    lambda folder: (folder / 'content.txt').rename(folder / 'other.txt'),
    lambda folder: (folder / 'content.txt').unlink(),
    lambda folder: (folder / 'content.txt').chmod(0o755),
    lambda folder: (folder / 'empty.txt').touch(),
    lambda folder: (folder / 'inner').mkdir() or (folder / 'inner' / 'a').write_text('a'),
])
def test_a_change_of_what_is_built_is_seen(top, change):
    make_home = load(top)
    folder = top / 'turtle_brick'
    before = make_home.folder_fingerprint(folder, ['test'])
    change(folder)
    assert make_home.folder_fingerprint(folder, ['test']) != before


@pytest.mark.parametrize('change', [
    lambda folder: os.utime(folder / 'content.txt', (1, 1)),
    lambda folder: executable(folder / '__pycache__' / 'a.pyc', ''),
    lambda folder: executable(folder / 'inner' / '__pycache__' / 'a.pyc', ''),
    lambda folder: executable(folder / '.pytest_cache' / 'a', ''),
    lambda folder: executable(folder / '.content.txt.swp', ''),
    lambda folder: executable(folder / 'turtle_brick.egg-info' / 'a', ''),
    lambda folder: executable(folder / 'test' / 'test_a.py', ''),
])
def test_a_change_of_what_is_not_built_is_not(top, change):
    make_home = load(top)
    folder = top / 'turtle_brick'
    before = make_home.folder_fingerprint(folder, ['test'])
    change(folder)
    assert make_home.folder_fingerprint(folder, ['test']) == before


def test_what_is_in_two_files_is_not_what_is_in_one(tmp_path):
    make_home = load(tmp_path)
    executable(tmp_path / 'a' / 'x', 'one').chmod(0o644)
    executable(tmp_path / 'a' / 'y', 'two').chmod(0o644)
    executable(tmp_path / 'b' / 'x', 'oney\0False\0three\0two').chmod(0o644)
    assert make_home.folder_fingerprint(tmp_path / 'a') \
        != make_home.folder_fingerprint(tmp_path / 'b')


@pytest.mark.parametrize('text', [None, '', '{"venv": ', '[]', '"venv"', '\0'])
def test_a_record_that_cannot_be_read_says_that_nothing_is_made(top, text):
    make_home = load(top)
    path = top / 'made.json'
    if text is not None:
        path.write_text(text)
    record = make_home.Record(path)
    assert record.parts() == set()
    record.add('venv', 'x')
    assert ('venv', 'x') in make_home.Record(path)
    assert ('venv', 'y') not in make_home.Record(path)
    record.forget('venv')
    assert ('venv', 'x') not in make_home.Record(path)


def with_package(prefix, name):
    """Make a prefix that has a package."""
    executable(prefix / 'share/ament_index/resource_index/packages' / name, '')


@pytest.mark.parametrize('real, standins', [
    ((), ['tf2_msgs', 'tf2_ros']),
    (('tf2_msgs',), ['tf2_ros']),
    (('tf2_msgs', 'tf2_ros_py'), []),
    (('turtlesim', 'rclpy'), ['tf2_msgs', 'tf2_ros']),
])
def test_stand_ins_are_built_for_what_is_absent(top, tmp_path, real, standins):
    make_home = load(top)
    for number, name in enumerate(real):
        with_package(tmp_path / f'prefix_{number}', name)
    prefixes = [str(tmp_path / f'prefix_{number}') for number in range(3)]
    assert list(make_home.packages_to_build(prefixes)) == [
        *standins, 'turtle_brick_interfaces', 'turtle_brick']


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


@pytest.fixture
def built(top, tmp_path, monkeypatch):
    """Return a function that makes a native home, and returns the names of what it has built."""
    make_home = load(top)
    tools = tmp_path / 'tools'
    executable(tools / 'colcon', COLCON)
    executable(tools / 'cmake', COLCON)
    monkeypatch.setenv('PATH', f'{tools}:{os.environ["PATH"]}')
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path / 'prefix'))

    def build():
        (top / 'built').write_text('')
        make_home.make_native_home(make_home.Record(make_home.HOME / 'made.json'))
        return (top / 'built').read_text().split()

    return build


EVERYTHING = ['tf2_msgs', 'tf2_ros', 'turtle_brick_interfaces', 'turtle_brick']


def test_only_what_changed_is_built_again(top, tmp_path, built):
    assert built() == EVERYTHING
    assert built() == []
    for path, names in (
            ('turtle_brick/content.txt', ['turtle_brick']),
            ('turtle_brick/package.xml', ['turtle_brick']),
            ('turtle_brick/test/test_new.py', []),
            ('turtle_brick/scripts/demo', []),
            ('turtle_brick_interfaces/content.txt', ['turtle_brick_interfaces']),
            ('turtle_brick/standins/tf2_ros/content.txt', ['tf2_ros'])):
        with open(executable(top / path, (top / path).read_text() if (top / path).exists()
                             else ''), 'a') as file:
            file.write('\n')
        assert built() == names
        assert built() == []
    with_package(tmp_path / 'prefix', 'rclpy')
    assert built() == EVERYTHING
    with_package(tmp_path / 'prefix', 'tf2_msgs')
    assert built() == []
    assert not (top / '.ros/install/tf2_msgs').exists()
    shutil.rmtree(top / '.ros/install/turtle_brick')
    assert built() == ['turtle_brick']
    moved = top.with_name('moved')
    top.rename(moved)
    make_home = load(moved)
    (moved / 'built').write_text('')
    make_home.make_native_home(make_home.Record(make_home.HOME / 'made.json'))
    assert (moved / 'built').read_text().split() == EVERYTHING[1:]


def test_a_failed_build_is_shown_and_tried_again(top, built, capsys):
    (top / 'broken').touch()
    make_home = sys.modules['make_home']
    with pytest.raises(make_home.HomeError, match='colcon could not build tf2_msgs, tf2_ros'):
        built()
    assert 'error: it is broken' in capsys.readouterr().err
    (top / 'broken').unlink()
    assert built() == EVERYTHING


# ---------------------------------------------------------------- what is missing on the machine

def maker(top, kind='pypi', before='', **variables):
    """Return the command and the environment that run the maker after some preparations."""
    env = {name: value for name, value in os.environ.items() if not name.startswith('PIP_')}
    program = top / 'turtle_brick' / 'scripts' / 'make_home.py'
    return [INTERPRETER, '-c', f'import sys\n{before}\nimport runpy\nsys.argv[:] = '
            f'[{str(program)!r}, {kind!r}]\nrunpy.run_path(sys.argv[0], run_name="__main__")'], {
                **env, **variables}


def refusal(top, **arguments):
    """Run the maker where something is missing: return its sentence, having seen what it left."""
    command, env = maker(top, **arguments)
    before = sorted(top.rglob('*'))
    done = subprocess.run(command, env=env, cwd='/', stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert done.returncode == 1, done.stdout
    assert sorted(top.rglob('*')) == before
    lines = done.stdout.splitlines()
    assert [line for line in lines if line.startswith('turtle_brick: ')][-1] == lines[-1]
    return lines[-1]


@pytest.mark.parametrize('before, words', [
    ('import platform; platform.machine = lambda: "aarch64"', ['x86-64', 'aarch64', 'install']),
    ('import platform; platform.system = lambda: "Darwin"', ['x86-64', 'Darwin', 'install']),
    ('import platform; platform.libc_ver = lambda: ("glibc", "2.17")', ['2.28', 'glibc 2.17']),
    ('import platform; platform.libc_ver = lambda: ("", "")', ['2.28', 'another C library']),
    ('sys.modules["ensurepip"] = None', ['virtual environments', '-venv']),
    ('sys.modules["venv"] = None', ['virtual environments', '-venv']),
    ('import sysconfig; sysconfig.get_path = lambda _: "/no/include"',
     ['/no/include/Python.h', '-dev']),
])
def test_what_the_python_or_the_machine_lacks_is_said(top, before, words):
    sentence = refusal(top, before=before)
    assert all(word in sentence for word in words), sentence


@pytest.mark.parametrize('character', ':;,"$`\\*?[]{}<>|^\'\n\x7f')
def test_a_path_that_nothing_can_mend_is_refused_before_anything_is_fetched(top, character):
    moved = top.rename(top.with_name(f'work{character}space'))
    sentence = refusal(moved, before='import subprocess; subprocess.Popen = None')
    assert f'has {character!r} in it' in sentence


@pytest.mark.parametrize('name', ['Übung 2 (1)', 'C++ & co. #1', '日本 ~100%', 'a' * 200])
def test_a_path_of_every_day_is_taken(top, name):
    """Nothing is missed but what comes after the path: here, a machine that fits."""
    moved = top.rename(top.with_name(name))
    before = 'import platform; platform.machine = lambda: "aarch64"'
    assert 'aarch64' in refusal(moved, before=before)


WORKING = '#!/bin/sh\nexit 0\n'
BROKEN = '#!/bin/sh\necho "stdlib.h: fatal error: no such file" >&2\nexit 1\n'


@pytest.mark.parametrize('programs, variables, words', [
    ({}, {}, ['There is no C compiler', 'cc, gcc, clang', 'build-essential']),
    ({'gcc': WORKING}, {}, ['There is no C++ compiler', 'c++, g++, clang++']),
    ({'gcc': WORKING, 'g++': WORKING}, {'CXX': 'icpc -O'}, ['no C++ compiler', 'CXX=icpc']),
    ({'gcc': BROKEN, 'g++': WORKING}, {}, ['gcc cannot build', 'stdlib.h: fatal', 'install']),
    ({'clang': WORKING, 'clang++': BROKEN}, {}, ['clang++ cannot build', 'install']),
])
def test_a_compiler_that_is_missing_or_broken_is_said(top, tmp_path, programs, variables, words):
    tools = tmp_path / 'tools'
    tools.mkdir()
    for name, text in programs.items():
        executable(tools / name, text)
    clean = {'CC': '', 'CXX': '', 'PATH': str(tools)}
    sentence = refusal(top, **{**clean, **variables})
    assert all(word in sentence for word in words), sentence


def test_a_native_home_without_colcon_is_refused(top, tmp_path):
    sentence = refusal(top, kind='native', PATH=str(tmp_path), AMENT_PREFIX_PATH='')
    assert 'There is no colcon' in sentence and 'sudo apt install' in sentence


# A Python that makes virtual environments of itself, and whose pip fails with the words that a
# variable has; with the word "wait" it goes on until the maker has ended.
PYTHON = """#!/bin/sh
if [ "$1 $2" = "-m venv" ]; then
  mkdir -p "$3/bin" && cp "$0" "$3/bin/python" && : > "$3/attempt_$ATTEMPT"
elif [ "$1 $2" = "-m pip" ]; then
  echo "$PIP_SAYS"
  if [ "$PIP_SAYS" = wait ]; then while kill -0 $PPID; do sleep 0.05; done; fi
  exit 1
fi
"""


def pip(top, says):
    """Return what makes the maker use a Python of that kind."""
    python = executable(top.with_name('python'), PYTHON)
    return {'before': f'sys._base_executable = {str(python)!r}', 'PIP_SAYS': says}


NO_NETWORK = """
WARNING: Retrying (Retry(total=4, connect=None, read=None, redirect=None, status=None)) after \
connection broken by 'NewConnectionError('<pip._vendor.urllib3.connection.HTTPSConnection object \
at 0x7fd03b9c8a10>: Failed to establish a new connection: [Errno -3] Temporary failure in name \
resolution')': /simple/setuptools/
ERROR: Could not find a version that satisfies the requirement setuptools==79.0.1 (from \
versions: none)
ERROR: No matching distribution found for setuptools==79.0.1
"""


@pytest.mark.parametrize('says, words', [
    (NO_NETWORK, ['cannot be reached (Temporary failure in name resolution)', 'network']),
    ('ERROR: No matching distribution found for ros-rclpy==7.1.6', ['has no ros-rclpy==7.1.6']),
    ('ERROR: Could not install packages due to an OSError: [Errno 28] No space left on device\n',
     ['[Errno 28] No space left on device']),
    ('oops', ['oops']),
    ('', ['pip could not install']),
])
def test_what_pip_fails_for_is_said_and_nothing_stays(top, says, words):
    sentence = refusal(top, **pip(top, says))
    assert all(word in sentence for word in words), sentence


def test_a_home_that_was_not_finished_is_not_taken_for_a_good_one(top):
    for path in ('venv/attempt_0', 'install/turtle_brick/a', 'build/turtle_brick/a', 'log/a'):
        executable(top / '.ros' / path, '')
    executable(top / '.ros/mine.txt', 'kept')
    assert not (top / '.ros/made.json').exists()
    command, env = maker(top, **pip(top, 'oops'))
    assert subprocess.run(command, env=env, stderr=subprocess.DEVNULL).returncode == 1
    assert [path.name for path in (top / '.ros').iterdir()] == ['mine.txt']


@pytest.fixture
def waiting(top):
    """Return a maker that is in the middle of an installation."""
    command, env = maker(top, **pip(top, 'wait'))
    process = NodeProcess(command, 0, env)
    process.wait_for_output('the package index', 20.0)
    assert (top / '.ros/venv/attempt_').exists()
    yield process
    process.kill()


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interruption_leaves_nothing(top, waiting, number):
    assert waiting.stop(number) == 1
    assert waiting.output.splitlines()[-1] == (
        'turtle_brick: Interrupted: the home is not ready.')
    assert not (top / '.ros').exists()


def test_a_death_without_warning_leaves_nothing_that_is_believed(top, waiting):
    assert waiting.stop(signal.SIGKILL) == -signal.SIGKILL
    assert (top / '.ros').exists()
    command, env = maker(top, **pip(top, 'oops'))
    done = subprocess.run(command, env=env, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 1 and 'oops' in done.stderr
    assert not (top / '.ros').exists()


def test_two_at_once_take_turns(top, waiting):
    command, env = maker(top, **pip(top, 'oops'))
    second = NodeProcess(command, 0, env)
    try:
        second.wait_for_output('another process is making this home', 20.0)
        assert second.running
        waiting.stop(signal.SIGINT)
        assert second.wait(20.0) == 1
        assert 'oops' in second.output
    finally:
        second.kill()
