# SPDX-License-Identifier: Apache-2.0
"""Test make_environment with changed packages, missing requirements and interrupted builds."""

import importlib.util
import os
from pathlib import Path
import platform
import select
import shutil
import signal
import subprocess
import sys
import sysconfig
from types import SimpleNamespace

import pytest
from turtle_graph.client.processes import Process

SCRIPTS = Path(__file__).resolve().parents[3] / 'scripts'


@pytest.fixture
def top(tmp_path):
    """Return the path of a workspace with two packages, two stand-ins and the real scripts."""
    root = tmp_path / 'workspace'
    for name in ('turtle_brick', 'turtle_brick_interfaces', 'turtle_brick/extras/turtle_graph',
                 'turtle_brick/extras/turtle_brick_tools', 'turtle_brick/extras/standins/tf2_msgs',
                 'turtle_brick/extras/standins/tf2_ros'):
        folder = root / name
        executable(folder / 'content.txt', 'one')
        (folder / 'package.xml').write_text(
            f'<package format="3"><name>{folder.name}</name></package>')
    shutil.copytree(SCRIPTS, root / 'turtle_brick' / 'scripts')
    return root


def load(top, monkeypatch):
    """Return the main module of the program in a workspace."""
    folder = top / 'turtle_brick/scripts/make_environment'
    for name in ('common', 'virtual_environment'):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.syspath_prepend(folder)
    spec = importlib.util.spec_from_file_location('make_environment', folder / '__main__.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def program(top, monkeypatch):
    return load(top, monkeypatch)


def executable(path, text=''):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)
    return path


def test_cmake_files_are_adapted_to_this_machine(program):
    text = program.virtual_environment.repair_cmake(
        'INCLUDES "/opt/python/cp313-cp313t/include/python3.13t;'
        '/opt/python/cp310-cp310/lib/python3.10/site-packages/numpy/_core/include"\n'
        'LIBRARIES "${_IMPORT_PREFIX}/lib/python3.11/site-packages/a.so;/opt/other"\n'
        'file(STRINGS "${idl_output}" idl_tuples)\n'
        'add_custom_target(\n    ament_cmake_python_copy_${package_name}\n    COMMAND a "b"\n',
        '/usr/include/python3.x', '/home/me\\1/packages', 'numpy/core/include')
    assert text == (
        'INCLUDES "/usr/include/python3.x;/home/me\\1/packages/numpy/core/include"\n'
        'LIBRARIES "${_IMPORT_PREFIX}/lib/python3.11/site-packages/a.so;/opt/other"\n'
        'file(STRINGS "${idl_output}" idl_tuples ENCODING UTF-8)\n'
        'add_custom_target(\n    ament_cmake_python_copy_${package_name} VERBATIM\n'
        '    COMMAND a "b"\n')


COLCON = """#!/bin/sh
all=$*
selected=${all#*--packages-select }
selected=${selected%% --build-base*}
echo "$selected" >>built
build=${all#*--build-base }
build=${build%% --install-base*}
status=0
for name in $selected; do
  mkdir -p "$build/$name" "${all##* }/$name"
  if grep -qx "$name" broken 2>/dev/null; then
    echo "error: $name is broken"
    status=1
  else
    echo 0 >"$build/$name/colcon_build.rc"
  fi
done
exit $status
"""
"""Replacement for colcon that logs the selected packages and fails for those in `broken`."""

EVERYTHING = ['tf2_msgs', 'tf2_ros', 'turtle_graph',
              'turtle_brick_interfaces', 'turtle_brick', 'turtle_brick_tools']

INDEX = 'share/ament_index/resource_index/packages'


@pytest.fixture
def built(program, tmp_path, monkeypatch):
    """Return a function that makes a native environment and returns the built packages."""
    executable(tmp_path / 'tools/colcon', COLCON)
    monkeypatch.setenv('PATH', f'{tmp_path}/tools:{os.environ["PATH"]}')
    # AMENT_PREFIX_PATH contains the environment if env.bash has already been sourced.
    executable(program.ENVIRONMENT / 'sourced' / INDEX / 'tf2_msgs')
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{program.ENVIRONMENT}/sourced:{tmp_path}/prefix')

    def build(module=program, content='packages'):
        monkeypatch.setattr(module.virtual_environment, 'is_installed', lambda _: True)
        (module.TOP / 'built').write_text('')
        module.make_environment('native', content)
        return (module.TOP / 'built').read_text().split()

    return build


def test_only_changed_packages_are_built_again(top, tmp_path, built, monkeypatch):
    assert built() == EVERYTHING
    content = top / 'turtle_brick/content.txt'
    os.utime(content, (1, 1))
    for path in ('test/test_new.py', 'scripts/demo', 'doc/page.md', 'inner/__pycache__/a.pyc',
                 '.pytest_cache/a', '.content.txt.swp', 'turtle_brick.egg-info/a'):
        executable(top / 'turtle_brick' / path)
    assert built() == []
    for name in ('turtle_brick', 'turtle_brick_interfaces',
                 'turtle_brick/extras/standins/tf2_ros', 'turtle_brick/extras/turtle_graph'):
        executable(top / name / 'content.txt', 'changed')
        assert built() == [Path(name).name]
        assert built() == []
    for change in (lambda: content.chmod(0o644), lambda: executable(content.with_name('empty')),
                   lambda: content.rename(content.with_name('content.text'))):
        change()
        assert built() == ['turtle_brick']
    for package, again in (('rclpy', EVERYTHING), ('tf2_msgs', []), ('tf2_ros', [])):
        executable(tmp_path / 'prefix' / INDEX / package)
        assert built() == again
    assert {path.name for path in (top / '.ros/install').iterdir()} == set(EVERYTHING[3:])
    assert [path.name for path in (top / '.ros/standins').iterdir()] == ['turtle_graph']
    shutil.rmtree(top / '.ros/install/turtle_brick')
    assert built() == ['turtle_brick']
    assert built(load(top.rename(top.with_name('moved')), monkeypatch)) == EVERYTHING[2:]


def test_the_standins_are_built_without_the_packages(top, built):
    assert built(content='ros') == EVERYTHING[:3]
    assert built() == EVERYTHING[3:]
    for name in ('arena', 'kinematics'):
        shared = executable(top / f'turtle_brick/turtle_brick/core/turtlesim_{name}.py')
    assert built(content='ros') == []
    standins = top / 'turtle_brick/extras/standins'
    shutil.copytree(standins / 'tf2_ros', standins / 'turtlesim')
    assert built(content='ros') == ['turtlesim']
    executable(shared, 'changed again')
    assert built() == ['turtlesim', 'turtle_brick']
    # Only other workspaces require this package.
    shutil.copytree(standins / 'tf2_ros', standins / 'example_interfaces')
    assert built() == []
    assert built(content='ros') == ['example_interfaces']
    assert built() == []
    assert (top / '.ros/standins/example_interfaces').is_dir()


def test_a_failed_build_is_reported_and_repeated(top, program, built, capsys):
    """Packages that were built before the error are not built again."""
    (top / 'broken').write_text('tf2_ros')
    with pytest.raises(program.SetupError, match='colcon could not build tf2_ros.'):
        built()
    assert 'error: tf2_ros is broken' in capsys.readouterr().err
    (top / 'broken').unlink()
    assert built() == ['tf2_ros', *EVERYTHING[3:]]


def test_the_users_packages_are_built_after_those_of_the_project(top, built, capsys):
    """A broken package is reported, but the others are ready."""
    assert built() == EVERYTHING
    manifest = '<package format="3"><name>{}</name></package>'
    for path, name in (('mine', 'my_package'), ('src/second', 'second'),
                       ('mine/inside', 'inside'), ('install/mine', 'my_package')):
        executable(top / path / 'package.xml', manifest.format(name))
    executable(top / 'install/COLCON_IGNORE')
    executable(top / 'turtle_brick/extras/standins/example_interfaces/package.xml',
               manifest.format('example_interfaces'))
    (top / 'broken').write_text('my_package')
    log = executable(top / '.ros/log/latest_build/my_package/stdout_stderr.log')
    assert built() == ['example_interfaces', 'my_package', 'second']
    errors = capsys.readouterr().err
    assert 'error: my_package is broken' in errors
    assert errors.splitlines()[-1] == (
        'turtle_brick: colcon could not build my_package. See its output above and in '
        f'{log.relative_to(top)}. All other packages are ready.')
    (top / 'broken').unlink()
    assert built() == ['my_package']
    for folder in ('scripts', 'test'):  # unlike in turtle_brick, these may be installed
        executable(top / 'mine' / folder / 'program')
        assert built() == ['my_package']
    shutil.rmtree(top / 'mine')
    assert built() == []
    assert {path.name for path in (top / '.ros/install').iterdir()} == {*EVERYTHING[3:], 'second'}


PYTHON = """#!/bin/sh
if [ "$2 $3" = "-m venv" ]; then
  mkdir -p "${4%/*}" && mkdir "$4" "$4/bin" && cp "$0" "$4/bin/python" && : > "$4/attempt"
elif [ "$1 $2" = "-m pip" ]; then
  echo "$SAID${PIP_TARGET-}"
  if [ "$SAID" = wait ]; then
    sleep 600 & echo $! >child
    while kill -0 $PPID; do sleep 0.05; done
  fi
  exit 1
fi
"""
"""Fake Python interpreter whose pip prints $SAID and fails. If $SAID is "wait", pip fails
only after its parent process has exited."""


def refusal(program, kind='pypi'):
    """Check that make_environment fails and leaves no files, and return the error message."""
    with pytest.raises(program.SetupError) as refused:
        program.make_environment(kind, 'packages')
    assert not program.ENVIRONMENT.exists()
    return str(refused.value)


@pytest.mark.parametrize('module, name, value, words', [
    (platform, 'machine', lambda: 'aarch64', ['x86-64', 'aarch64', 'Install']),
    (platform, 'libc_ver', lambda: ('glibc', '2.17'), ['2.28', 'glibc 2.17']),
    (sysconfig, 'get_path', lambda _: '/no/include', ['/no/include/Python.h', '-dev']),
    (importlib.util, 'find_spec', lambda _: None, ['virtual environments', '-venv"']),
    (shutil, 'disk_usage', lambda _: SimpleNamespace(free=42e6), ['42 MB', '750 MB'])])
def test_an_unsupported_machine_is_refused(program, monkeypatch, module, name, value, words):
    monkeypatch.setattr(module, name, value)
    assert all(word in refusal(program) for word in words)


def test_a_missing_program_is_named(program, tmp_path, monkeypatch):
    monkeypatch.setenv('PATH', f'{tmp_path}/tools')
    monkeypatch.setenv('AMENT_PREFIX_PATH', '')
    assert 'colcon' in refusal(program, 'native')
    assert 'No C compiler' in refusal(program)
    executable(tmp_path / 'tools' / 'gcc')
    sentence = refusal(program)
    assert 'No C++ compiler' in sentence and 'sudo apt install build-essential' in sentence


@pytest.mark.parametrize('name, words', [
    ('work:space', "contains ':'"), ('a\nb', "contains '\\n'"),
    ('C++ & co. Übung #1 日本 ~100%', 'aarch64')])
def test_unsupported_characters_in_the_path_are_refused(top, monkeypatch, name, words):
    """The path with 'C++' is valid, so the error message is about the machine type."""
    monkeypatch.setattr(platform, 'machine', lambda: 'aarch64')
    assert words in refusal(load(top.rename(top.with_name(name)), monkeypatch))


def test_a_native_machine_gets_what_it_lacks(top, program, built, monkeypatch, capsys):
    """The packages of the assignment are ready even if the installation fails."""
    extras = program.virtual_environment
    monkeypatch.setattr(extras, 'is_installed', lambda pinned: not pinned.startswith('rich='))
    monkeypatch.setattr(program.common, 'BASE_PYTHON', executable(top.with_name('python'), PYTHON))
    monkeypatch.setenv('SAID', 'no network')
    assert program.make_environment('native', 'packages') == 2
    *before, sentence = capsys.readouterr().err.splitlines()
    assert sentence.startswith('turtle_brick: no network. pip could not install')
    assert 'assignment are ready' in sentence and 'no network' not in ''.join(before)
    assert not program.VENV.exists() and (top / '.ros/install/turtle_brick').is_dir()
    installed = []
    monkeypatch.setattr(extras, 'pip_install', lambda *arguments, **_: installed.extend(
        name for name in arguments if '==' in name))
    for _ in range(2):
        assert program.make_environment('native', 'packages') == 0
    name, = installed
    assert name.startswith('rich==') and program.VENV.is_dir()
    monkeypatch.setattr(extras, 'is_installed', lambda _: True)
    assert program.make_environment('native', 'packages') == 0
    assert not program.VENV.exists()


def started(top, said):
    folder = str(top / 'turtle_brick/scripts/make_environment')
    script = f"""import runpy, sys
sys.path.insert(0, {folder!r})
import common
common.BASE_PYTHON = {str(executable(top.with_name('python'), PYTHON))!r}
runpy.run_path({folder!r}, run_name='__main__')"""
    return Process([sys.executable, '-c', script, 'pypi', 'packages'],
                   {'SAID': said, 'PIP_TARGET': '/elsewhere'})


@pytest.fixture
def waiting(top):
    os.mkfifo(top / 'child')
    with started(top, 'wait') as process:
        child = os.pidfd_open(int((top / 'child').read_text()))  # Reading waits for the child.
        assert (top / '.ros/venv/attempt').exists()
        yield process, child
        os.close(child)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGHUP])
def test_an_interrupted_installation_is_deleted_and_its_processes_end(top, waiting, number):
    process, child = waiting
    assert process.stop(number, 600.0) == 1
    assert process.output.splitlines()[-1] == (
        'turtle_brick: The build was interrupted. Source env.bash again.')
    assert not (top / '.ros').exists()
    # A file descriptor of a process is readable once it has exited, even if init never reaps it.
    assert select.select([child], [], [], 600.0)[0] == [child]


def test_a_second_process_waits_for_the_first(top, waiting):
    with started(top, 'oops') as second:
        second.wait_for_output('Another terminal is building this workspace', 600.0)
        with pytest.raises(TimeoutError):
            second.wait_for_output('oops', 1.0)
        waiting[0].kill()  # The second process first deletes the unfinished installation.
        assert second.wait(600.0) == 1
        assert 'oops' in second.output.splitlines()
    assert not (top / '.ros').exists()


def test_the_owner_of_a_workspace_that_cannot_be_built_is_named(program, monkeypatch, capsys):
    program.ENVIRONMENT.write_text('not a folder')
    monkeypatch.setattr(sys, 'argv', ['', 'native', 'ros'])
    monkeypatch.setattr(program, 'lock', lambda: None)  # This process can lock the folder once.
    monkeypatch.setattr(program, 'standins', lambda *_, **__: {'tf2_ros': program.TOP})
    assert program.main() == 1
    assert 'belongs to' not in capsys.readouterr().err
    monkeypatch.setattr(os, 'geteuid', lambda: program.TOP.stat().st_uid + 1)
    assert program.main() == 1
    sentence = capsys.readouterr().err
    assert f'{program.TOP} belongs to {program.TOP.owner()}. Copy the workspace' in sentence


def test_the_owner_of_a_part_that_cannot_be_changed_is_named(program, built, monkeypatch, capsys):
    """After one sudo, root owns some of the files. Neither pip nor colcon is started."""
    assert built() == EVERYTHING
    capsys.readouterr()
    shutil.rmtree(program.ENVIRONMENT / 'install/turtle_brick')
    part = program.ENVIRONMENT / 'standins/tf2_ros'
    monkeypatch.setattr(os, 'geteuid', lambda: 1234)
    monkeypatch.setattr(program.common, 'owner_id', lambda path: 0 if path == part else 1234)
    monkeypatch.setattr(os, 'access', lambda path, mode: path != part)
    for kind in ('native', 'pypi'):
        if kind == 'pypi':
            monkeypatch.setattr(program.common, 'check_programs', lambda *_: None)
        with pytest.raises(program.SetupError) as refused:
            program.make_environment(kind, 'packages')
        assert str(refused.value) == (
            f'{part} cannot be changed. {part} belongs to root. '
            f'Enter: sudo chown -R "$(id -u)" {program.ENVIRONMENT}')
        assert capsys.readouterr().err == ''


@pytest.mark.parametrize('lines, summary, status', [
    ([], '0 passed, 0 failed, 0 skipped', 1),
    (['a b/pytest.xml: 5 tests, 0 errors, 0 failures, 2 skipped',
      'c/lint.xunit.xml: 1 test, 0 errors, 0 failures, 0 skipped',
      'c/Testing/2/Test.xml: 9 tests, 0 errors, 9 failures, 0 skipped',
      '', 'Summary: 15 tests, 0 errors, 9 failures, 2 skipped'],
     '4 passed, 0 failed, 2 skipped', 0),
    (['pytest.xml: 5 tests, 1 error, 2 failures, 1 skipped', '- test_one', '  assert 1 == 0', '',
      'Summary: 5 tests, 1 error, 2 failures, 1 skipped'],
     '- test_one\n  assert 1 == 0\n1 passed, 3 failed, 1 skipped', 1)])
def test_the_summary_counts_each_test_once(lines, summary, status):
    """No other line contains a count, and failed tests are printed above the sum."""
    done = subprocess.run(['awk', '-f', str(SCRIPTS / 'summary.awk')], input='\n'.join(lines),
                          stdout=subprocess.PIPE, text=True)
    assert (done.stdout, done.returncode) == (f'{summary}\n', status)
