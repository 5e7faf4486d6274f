# SPDX-License-Identifier: Apache-2.0
"""Test the shell setup in env.bash and its error messages."""

import os
from pathlib import Path
import shlex
import shutil
import subprocess
import sys

import pytest

SCRIPTS = Path(__file__).resolve().parents[3] / 'scripts'
ENV = SCRIPTS / 'env.bash'
ENVIRONMENT = os.environ.get('TURTLE_BRICK_ENVIRONMENT', '')
IS_PYPI = ENVIRONMENT != '' and os.environ.get('VIRTUAL_ENV') == f'{ENVIRONMENT}/venv'

with_environment = pytest.mark.skipif(
    ENVIRONMENT != str(SCRIPTS.parents[1] / '.ros'), reason='env.bash has not been sourced')
without_ros = pytest.mark.skipif(
    os.path.exists('/opt/ros/jazzy'), reason='env.bash would use /opt/ros/jazzy')


def shell(script, *, options=(), **variables):
    env = {name: value for name, value in {**os.environ, **variables}.items()
           if value is not None}
    done = subprocess.run(['bash', *options, '-c', script], env=env, cwd='/', text=True,
                          stdin=subprocess.DEVNULL, capture_output=True, timeout=600.0,
                          start_new_session=True)  # Bash must not take control of the terminal.
    return done.returncode, done.stdout, done.stderr


WAITING = 'turtle_brick: Another terminal is building this workspace. Waiting ...\n'
"""Message that appears if another test sources env.bash at the same time."""


def sourced(script, **arguments):
    status, output, errors = shell(
        f'source {shlex.quote(str(ENV))} || exit\n{script}', **arguments)
    return status, output, errors.replace(WAITING, '')


IMPORTS = """python3 -c '
import geometry_msgs.msg, nav_msgs.msg, sensor_msgs.msg, std_srvs.srv, visualization_msgs.msg
import rclpy, tf2_msgs.msg, tf2_ros, turtlesim.msg, turtlesim.srv, xacro, yaml
import turtle_brick, turtle_graph.referee, turtle_brick_interfaces.msg, turtle_brick_interfaces.srv
rclpy.init()'"""


FOREIGN = {
    'PYTHONHOME': '/some/where', 'LD_LIBRARY_PATH': None, 'VIRTUAL_ENV': '/some/where',
    'CONDA_PREFIX': '/some/conda', 'RMW_IMPLEMENTATION': 'rmw_other', 'ROS_LOCALHOST_ONLY': '0',
    'ROS_LOG_DIR': None, 'HOME': '/dev/null', 'AMENT_PREFIX_PATH': None, 'ROS_DISTRO': None,
    'PATH': '/usr/local/bin:/usr/bin:/bin', 'CDPATH': '/', 'PYTHON': None}
"""Environment variables that the PyPI environment ignores or replaces."""


@with_environment
def test_a_ready_environment_is_sourced_silently(tmp_path):
    """Nothing is built. Settings for another Python do not affect the PyPI environment."""
    foreign = {}
    if IS_PYPI:
        for name in ('rclpy', 'numpy', 'platform', 'yaml'):
            (tmp_path / f'{name}.py').write_text('raise RuntimeError("wrong module")')
        python = tmp_path / 'a b' / 'python'
        python.parent.mkdir()
        python.symlink_to(shutil.which('python3'))
        foreign = {**FOREIGN, 'PYTHONPATH': str(tmp_path), 'COLCON_PYTHON_EXECUTABLE': str(python)}
    assert sourced(IMPORTS, **foreign) == (0, '', '')


@pytest.mark.skipif(not IS_PYPI, reason='this is not a PyPI environment')
def test_programs_run_in_a_path_with_spaces():
    """Installed scripts do not begin with the absolute path of a Python interpreter."""
    shebangs = {path.read_bytes().split(b'\n')[0]
                for base in ('install', 'standins')
                for path in Path(ENVIRONMENT, base).glob('*/lib/*/*')
                if path.is_file() and os.access(path, os.X_OK) and '.so' not in path.name}
    assert shebangs == {b'#!/usr/bin/env python3', b'#!/bin/sh'}


@with_environment
def test_ros_bash_hides_the_packages_that_env_bash_provides():
    ros = shlex.quote(str(SCRIPTS / 'ros.bash'))
    status, output, errors = sourced(
        f'source {ros}; python3 -c "import rclpy, tf2_ros, turtlesim.srv; import turtle_brick"\n'
        f'echo "$?"; env | grep {ENVIRONMENT}/install')
    assert (status, output) == (1, '1\n')
    assert "No module named 'turtle_brick'" in errors


STATE = r"""
echo "$#"; { shopt -p; shopt -po; trap -p; declare -F; } | grep -v COLCON_TRACE
compgen -v | grep -v -x -E 'BASH.*|_|SECONDS|RANDOM|SRANDOM|EPOCH.*|PIPESTATUS|LINENO' | sort
"""


@with_environment
def test_sourcing_keeps_shell_options_functions_and_variables():
    options = {'options': ('-efu', '-o', 'pipefail'), 'ROS_DOMAIN_ID': '77'}
    # This process has already inherited the environment variables set by env.bash.
    before = shell(STATE, **options)
    show = 'printf "again\\0"; env -0'
    status, output, errors = sourced(
        f'{STATE}\n{show}; source {shlex.quote(str(ENV))}; {show}; true', **options)
    state, first, second = output.split('again\0')
    assert (status, state, errors) == before
    first, second = (sorted(text.split('\0')) for text in (first, second))
    assert 'ROS_DOMAIN_ID=77' in first
    assert first == second
    for variable in second:
        name, _, value = variable.partition('=')
        if name in ('AMENT_PREFIX_PATH', 'CMAKE_PREFIX_PATH', 'LD_LIBRARY_PATH', 'PYTHONPATH'):
            entries = value.split(':')
            assert len(entries) == len(set(entries)), variable


REPLACED = r"""cd() { builtin cd "$@" && ls; }
for name in mkdir python3 xacro register-python-argcomplete; do
  eval "$name() { echo 'my $name'; }"
done
shopt -s expand_aliases
alias mkdir='echo' python3='echo'
"""
"""Functions and aliases that replace commands in the shell of a user."""


@with_environment
def test_functions_and_aliases_of_the_user_do_not_change_the_setup():
    env, ros = (shlex.quote(str(SCRIPTS / name)) for name in ('env.bash', 'ros.bash'))
    status, output, errors = shell(f'{REPLACED}source {env} && source {ros} && builtin pwd')
    assert (status, output, errors.replace(WAITING, '')) == (0, '/\n', '')


@with_environment
def test_the_scripts_find_their_folder_with_a_function_of_the_user():
    demo = shlex.quote(str(SCRIPTS / 'demo'))
    status, output, _ = shell(f'cd() {{ builtin cd "$@" && ls; }}; export -f cd; {demo} --help')
    assert status == 0 and output.startswith('usage: ')


def test_an_invalid_parameter_file_is_reported_after_the_setup_of_the_shell(unbuilt):
    scripts = unbuilt[0].parent
    (scripts / 'make_environment/__main__.py').write_text('')
    for path, text in ((scripts.parents[1] / '.ros/install/local_setup.bash', 'OVERLAY=sourced'),
                       (scripts.parent / 'config/turtle.yaml', 'max_velocity:3.0')):
        path.parent.mkdir(parents=True)
        path.write_text(text)
    status, output, errors = shell(
        f'source {shlex.quote(str(unbuilt[0]))}\necho "$? $OVERLAY $TURTLE_BRICK_ENVIRONMENT"',
        VIRTUAL_ENV=None, ROS_DISTRO='jazzy')
    assert (status, output) == (0, f'1 sourced {scripts.parents[1]}/.ros\n')
    assert errors.startswith('turtle_brick: ') and 'turtle.yaml: there are no' in errors


def test_running_instead_of_sourcing_is_refused():
    status, output, errors = shell(f'bash {shlex.quote(str(ENV))}')
    assert (status, output) == (1, '')
    assert 'must be sourced' in errors and len(errors.splitlines()) == 1


@pytest.fixture
def unbuilt(tmp_path):
    """Return the path of env.bash in an unbuilt workspace, and a program folder without Python."""
    shutil.copytree(SCRIPTS, tmp_path / 'workspace' / 'turtle_brick' / 'scripts')
    tools = tmp_path / 'tools'
    tools.mkdir()
    for name in ('bash', 'dirname', 'env'):
        (tools / name).symlink_to(shutil.which(name))
    return tmp_path / 'workspace' / 'turtle_brick' / 'scripts' / 'env.bash', tools


def refusal(env_bash, command='', **variables):
    """Check that env.bash fails and creates no files, and return the error message."""
    status, output, errors = shell(
        f'{command}\nsource {shlex.quote(str(env_bash))}\necho "$?"\ndeclare -F', **{
            'ROS_DISTRO': None, 'TURTLE_BRICK_ENVIRONMENT': None, 'VIRTUAL_ENV': None,
            'PYTHON': None, **variables})
    assert (status, output) == (0, '1\n')
    assert len(errors.splitlines()) == 1 and errors.startswith('turtle_brick: ')
    assert [path.name for path in env_bash.parents[2].iterdir()] == ['turtle_brick']
    return errors


@pytest.mark.parametrize('command, variables, words', [
    ('', {'ROS_DISTRO': 'humble'}, 'humble'),
    ('', {'ROS_DOMAIN_ID': '300'}, "'300', but must be"),
    ('', {'ROS_DOMAIN_ID': 'one'}, "'one', but must be"),
    ('unset BASH_VERSION', {}, 'requires bash')])  # Only bash sets this variable.
def test_an_unsuitable_shell_is_refused(unbuilt, command, variables, words):
    assert words in refusal(unbuilt[0], command, **variables)


def test_a_python_without_the_packages_of_ros_is_refused(unbuilt):
    """A conda environment may contain rclpy, but not the packages that build the workspace."""
    env_bash, tools = unbuilt
    (tools / 'python3').write_text('#!/bin/sh\n[ "$2" = "import rclpy" ]\n')
    (tools / 'python3').chmod(0o755)
    sentence = refusal(env_bash, PATH=str(tools), ROS_DISTRO='jazzy')
    assert str(tools / 'python3') in sentence and 'conda' in sentence


@without_ros
def test_the_first_suitable_python_is_used(unbuilt):
    env_bash, tools = unbuilt
    old = tools / 'python3'
    old.write_text(f"""#!/bin/sh
exec {shlex.quote(os.path.realpath(sys.executable))} -c '
import sys
sys.version_info = (3, 9, 0, "final", 0)
exec(sys.argv[1])' "$3"
""")
    old.chmod(0o755)
    sentence = refusal(env_bash, PATH=str(tools))
    assert '3.10 to 3.13' in sentence and 'sudo apt install' in sentence
    assert f'{old} is not' in refusal(env_bash, PATH=str(tools), PYTHON=str(old))
    (tools / 'python3.12').symlink_to(os.path.realpath(sys.executable))
    # After accepting python3.12, the script looks for a compiler.
    assert 'No C compiler' in refusal(env_bash, PATH=str(tools), CC='', CXX='')
