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
"""A shell that sources env.bash can import all, soon, and is otherwise what it was before."""

import ctypes
import os
from pathlib import Path
import shlex
import shutil
import signal
import subprocess
import sys
import time

import pytest

SCRIPTS = Path(__file__).resolve().parents[2] / 'scripts'
ENV = SCRIPTS / 'env.bash'
HOME = os.environ.get('TURTLE_BRICK_HOME', '')
WHEELS = os.environ.get('VIRTUAL_ENV', '') == f'{HOME}/venv'

with_home = pytest.mark.skipif(
    HOME != str(SCRIPTS.parents[1] / '.ros'), reason='env.bash has not been sourced')
with_wheels = pytest.mark.skipif(
    not WHEELS, reason='this home is not one of wheels: ROS 2 itself is here')
without_ros = pytest.mark.skipif(
    os.path.exists('/opt/ros/jazzy'), reason='/opt/ros/jazzy would be found')


def shell(script, *, options=(), program='bash', **variables):
    """Run a script in a shell; return its status, standard output and standard error."""
    env = {name: value for name, value in {**os.environ, **variables}.items()
           if value is not None}
    with subprocess.Popen([program, *options, '-c', script], env=env, cwd='/',
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
        try:
            output, errors = process.communicate(timeout=60.0)
        except BaseException:
            os.killpg(process.pid, signal.SIGKILL)  # the shell's own children as well
            raise
    return process.returncode, output, errors


def sourced(script, env_bash=ENV, **arguments):
    """Source env.bash, then run a script."""
    return shell(f'source {shlex.quote(str(env_bash))} || exit\n{script}', **arguments)


IMPORTS = """python3 -c '
import geometry_msgs.msg, nav_msgs.msg, sensor_msgs.msg, std_srvs.srv, visualization_msgs.msg
import rclpy, tf2_msgs.msg, tf2_ros, turtlesim.msg, turtlesim.srv, xacro, yaml
import turtle_brick, turtle_brick_interfaces.msg, turtle_brick_interfaces.srv'"""


@with_home
def test_a_home_that_is_ready_is_ready_soon_and_silent():
    times = []
    for _ in range(3):
        start = time.monotonic()
        assert sourced('') == (0, '', '')
        times.append(time.monotonic() - start)
    assert min(times) < 2.0, times


@with_home
def test_at_a_prompt_one_line_says_what_the_shell_has_now():
    *_, errors = sourced('', options=('--norc', '-i'))
    said = [line for line in errors.splitlines() if line.startswith('turtle_brick')]
    assert len(said) == 1 and f'in the home {HOME} (' in said[0]


@with_home
def test_all_can_be_imported():
    assert sourced(IMPORTS) == (0, '', '')


@with_wheels
def test_fast_dds_waits_for_an_hour_and_not_for_ever():
    """Whoever pins another Fast DDS: see FOR_EVER in make_home.py."""
    library = ctypes.CDLL(f'{HOME}/venv/lib/libfastrtps.so.2.14')
    function = library[
        '_ZN8eprosima7fastdds3dds17DomainParticipant12set_listener'
        'EPNS1_25DomainParticipantListenerE']
    code = ctypes.string_at(ctypes.cast(function, ctypes.c_void_p).value, 10)
    assert int.from_bytes(code[2:], 'little') == 3600


@with_home
@with_wheels
def test_nothing_of_the_callers_leads_astray(tmp_path):
    for name in ('rclpy', 'numpy', 'platform', 'yaml'):
        (tmp_path / f'{name}.py').write_text('raise RuntimeError("the wrong one")')
    assert sourced(
        IMPORTS, PYTHONPATH=str(tmp_path), PYTHONHOME=str(tmp_path), LD_LIBRARY_PATH=None,
        VIRTUAL_ENV='/some/where', CONDA_PREFIX='/some/conda', RMW_IMPLEMENTATION='rmw_other',
        AMENT_PREFIX_PATH=None, ROS_DISTRO=None, PATH='/usr/local/bin:/usr/bin:/bin',
        CDPATH='/', PYTHON=None) == (0, '', '')


STATE = r"""
{ shopt -p; shopt -po; trap -p; declare -F; } | grep -v COLCON_TRACE
compgen -v | grep -v -x -E 'BASH.*|_|SECONDS|RANDOM|SRANDOM|EPOCH.*|PIPESTATUS|LINENO' | sort
"""


@with_home
@pytest.mark.parametrize('options', [(), ('-eu',), ('-f', '-o', 'pipefail')])
def test_the_shell_keeps_its_options_functions_and_variables(options):
    given = {'TURTLE_BRICK_HOME': HOME, 'ROS_DOMAIN_ID': None}
    # The shell that runs the tests has sourced env.bash before: so no variable is new.
    before = shell(STATE, options=options, **given)
    after = sourced(STATE, options=options, **given)
    assert before[0] == 0
    assert after == before


@with_home
@with_wheels
def test_the_home_has_no_executable_that_a_path_with_blanks_would_break():
    """The kernel takes no interpreter with a blank in its path: it is looked up on the PATH."""
    executables = list(Path(HOME, 'install').glob('*/lib/*/*'))
    firsts = [path.read_bytes().split(b'\n')[0] for path in executables
              if path.is_file() and os.access(path, os.X_OK) and '.so' not in path.name]
    assert len(firsts) > 5
    assert set(firsts) <= {b'#!/usr/bin/env python3', b'#!/bin/sh'}


@with_home
def test_colcons_script_is_sourced_without_splitting_paths(tmp_path):
    """As if the Python of this home had a blank in its path."""
    python = tmp_path / 'a b' / 'python'
    python.parent.mkdir()
    python.symlink_to(shutil.which('python3'))
    assert sourced(IMPORTS, COLCON_PYTHON_EXECUTABLE=str(python)) == (0, '', '')


@with_home
def test_sourced_again_it_changes_nothing():
    status, output, _ = sourced(
        f'env -0; printf "again\\0"; source {shlex.quote(str(ENV))}; env -0; true')
    first, second = output.split('again\0')
    assert status == 0
    assert sorted(first.split('\0')) == sorted(second.split('\0'))


@with_home
def test_no_path_has_an_entry_twice():
    _, output, _ = sourced(f'source {shlex.quote(str(ENV))}; env -0')
    for variable in output.split('\0'):
        name, _, value = variable.partition('=')
        if name in ('AMENT_PREFIX_PATH', 'CMAKE_PREFIX_PATH', 'LD_LIBRARY_PATH', 'PYTHONPATH'):
            entries = value.split(':')
            assert len(entries) == len(set(entries)), variable


@with_home
def test_the_users_domain_is_left_alone():
    for domain in (None, '77'):
        assert sourced('echo "$ROS_DOMAIN_ID"', ROS_DOMAIN_ID=domain)[1].strip() == (domain or '')


def test_run_instead_of_sourced_it_says_so():
    done = subprocess.run(['bash', str(ENV)], capture_output=True,
                          text=True)
    assert done.returncode == 1 and done.stdout == ''
    assert 'to be sourced' in done.stderr and len(done.stderr.splitlines()) == 1


@pytest.mark.skipif(not shutil.which('dash'), reason='dash is not installed')
def test_another_shell_is_told_that_it_is_for_bash():
    status, output, errors = shell(f'. {shlex.quote(str(ENV))}; echo "$?"', program='dash')
    assert (status, output) == (0, '1\n')
    assert 'is for bash' in errors and len(errors.splitlines()) == 1


# ----------------------------------------------------------------------------- what is refused

@pytest.fixture
def elsewhere(tmp_path):
    """Return the env.bash of a workspace that has no home yet."""
    shutil.copytree(SCRIPTS, tmp_path / 'workspace' / 'turtle_brick' / 'scripts')
    return tmp_path / 'workspace' / 'turtle_brick' / 'scripts' / 'env.bash'


NO_ROS = {'ROS_DISTRO': None, 'TURTLE_BRICK_HOME': None, 'VIRTUAL_ENV': None, 'PYTHON': None}


def refusal(env_bash, **variables):
    """Source env.bash where it cannot do its work: return its sentence."""
    status, output, errors = shell(
        f'source {shlex.quote(str(env_bash))}\necho "$?"\ndeclare -F', **variables)
    assert (status, output) == (0, '1\n')
    assert len(errors.splitlines()) == 1 and errors.startswith('turtle_brick: ')
    assert [path.name for path in env_bash.parents[2].iterdir()] == ['turtle_brick']
    return errors


def test_another_distribution_is_refused(elsewhere):
    assert 'humble' in refusal(elsewhere, **{**NO_ROS, 'ROS_DISTRO': 'humble'})


def python_of(folder, name, version, implementation='cpython'):
    """Write a program that answers like a Python of some version."""
    program = folder / name
    program.write_text(f"""#!/bin/sh
exec {shlex.quote(os.path.realpath(sys.executable))} -c '
import sys
sys.version_info = {version!r} + (0, "final", 0)
sys.implementation.name = "{implementation}"
exec(sys.argv[1])' "$3"
""")
    program.chmod(0o755)


@without_ros
@pytest.mark.parametrize('version, implementation', [
    ((3, 9), 'cpython'), ((3, 14), 'cpython'), ((2, 7), 'cpython'), ((3, 11), 'pypy')])
def test_a_python_that_does_not_fit_is_refused(elsewhere, tmp_path, version, implementation):
    tools = tmp_path / 'tools'
    tools.mkdir()
    python_of(tools, 'python3', version, implementation)
    for name in ('bash', 'dirname', 'env'):
        (tools / name).symlink_to(shutil.which(name))
    given = {**NO_ROS, 'PATH': str(tools)}
    sentence = refusal(elsewhere, **given)
    assert '3.10 to 3.13' in sentence and 'sudo apt install' in sentence
    sentence = refusal(elsewhere, **{**given, 'PYTHON': f'{tools}/python3'})
    assert f'{tools}/python3 is not' in sentence
    (tools / 'python3').unlink()
    assert '3.10 to 3.13' in refusal(elsewhere, **given)


@without_ros
@pytest.mark.parametrize('name', ['python3', 'python3.10', 'python3.12'])
def test_the_first_python_that_fits_is_taken(elsewhere, tmp_path, name):
    tools = tmp_path / 'tools'
    tools.mkdir()
    if name != 'python3':
        python_of(tools, 'python3', (3, 9))
    (tools / name).symlink_to(os.path.realpath(sys.executable))
    for program in ('bash', 'dirname', 'env'):
        (tools / program).symlink_to(shutil.which(program))
    # it fits, so that what is missed next is a compiler
    sentence = refusal(elsewhere, **{**NO_ROS, 'PATH': str(tools), 'CC': '', 'CXX': ''})
    assert 'no C compiler' in sentence
