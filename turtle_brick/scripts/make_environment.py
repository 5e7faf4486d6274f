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
"""
Create or update the directory `.ros`.

The command `make_environment.py native` uses the sourced ROS installation. The command
`make_environment.py pypi` first installs ROS from Python wheels.

The script env.bash runs this program and then sources the setup files in `.ros`:

- `venv` (PyPI environment only) is a virtual environment that contains rclpy, DDS, rosidl and the
  Jazzy messages. It is also a ROS prefix, and its `local_setup.bash` sets the environment
  variables.
- `build`, `install` and `log` are the colcon directories for all packages.
- `made.json` contains fingerprints of the virtual environment and of each built package.

The exit status is 0 on success. Otherwise, the last line of output states the reason.
"""

from __future__ import annotations

from collections.abc import Iterable
import fcntl
import hashlib
import importlib.util
import json
import os
from pathlib import Path
import platform
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
import time

SCRIPTS = Path(__file__).resolve().parent
REQUIREMENTS = SCRIPTS / 'requirements.txt'
LOCAL_SETUP = SCRIPTS / 'local_setup.bash'
TOP = SCRIPTS.parents[1]
ENVIRONMENT = TOP / '.ros'
VENV = ENVIRONMENT / 'venv'
RECORD = ENVIRONMENT / 'made.json'

VERSION = f'{sys.version_info.major}.{sys.version_info.minor}'
BASE_PYTHON = Path(sys.base_prefix, 'bin', f'python{VERSION}')
"""Base interpreter of this process, which may run in a virtual environment."""

FOREIGN_INCLUDE = re.compile(r'/opt/python/cp\w+-cp\w+/include/python3\.\d+t?')
FOREIGN_PACKAGES = re.compile(r'/opt/python/cp\w+-cp\w+/lib/python3\.\d+t?/site-packages')
"""Paths in the CMake files of the wheels that exist only on the machine that built the wheels."""

UNQUOTED_TARGET = re.compile(r'(add_custom_target\(\s*ament_cmake_python_\S+(?: ALL)?)')
ASCII_LINES = re.compile(r'(file\(STRINGS "\$\{idl_output\}" idl_tuples)\)')
"""CMake commands that fail if the workspace path contains parentheses or non-ASCII letters."""

ALLOWED = '/ ._-+~@=!%&()#'
"""Special characters that CMake, Ninja and colcon accept in a path."""

NOT_BUILT = ('doc', 'media', 'scripts', 'standins', 'test')
IGNORED = re.compile(r'/\.|/__pycache__/|\.egg-info/')
"""Folders, hidden files and generated files that do not affect package builds."""

SHARED_FILES = {'rviz2': 'graph_*/*.py'}
"""Source files outside the folder of a stand-in that the stand-in installs."""

REAL_NAMES = {'tf2_ros': 'tf2_ros_py'}
"""Real package for each stand-in with a different name."""

COMPILERS = (('C compiler', ('cc', 'gcc', 'clang'), 'build-essential'),
             ('C++ compiler', ('c++', 'g++', 'clang++'), 'build-essential'))
BUILD_TOOLS = (('build tool', ('colcon',), 'python3-colcon-common-extensions'),
               ('build tool', ('cmake',), 'cmake'))
"""Description, alternative names and Ubuntu package for each required program."""


class SetupError(Exception):
    """A requirement is missing, or a step failed. The message tells the user what to do."""


def report(text: str, end: str = '\n') -> None:
    """Print text to standard error."""
    print(f'{text}{end}', end='', file=sys.stderr, flush=True)


def run(command: list[str], env: dict[str, str], step: str, failed: str) -> None:
    """
    Run a command, and show the step and the latest line of output in a terminal.

    :raises SetupError: the command failed and its output has been printed; the message is `failed`
    """
    start, output = time.monotonic(), ''

    def show(line: str, end: str = '') -> None:
        if sys.stderr.isatty():
            text = f'\r  {step} ... {time.monotonic() - start:.0f} s {line}'.rstrip()
            report(f'{text[:shutil.get_terminal_size().columns]}\033[K', end)

    report(f'  {step} ...', end='' if sys.stderr.isatty() else '\n')
    with subprocess.Popen(
            command, cwd=TOP, env=env, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, errors='replace') as process:
        try:
            for line in process.stdout or ():
                output += line
                show(line.strip())
            process.wait()
        finally:
            process.kill()  # This program may have been interrupted.
            show('', end='\n')
    if process.returncode:
        report(output.rstrip())
        raise SetupError(failed)


def clean_environment() -> dict[str, str]:
    """Return the environment variables, without search path entries in the directory `.ros`."""
    env = dict(os.environ)
    for name in [name for name in env if name.endswith('PATH')]:
        env[name] = os.pathsep.join(entry for entry in env[name].split(os.pathsep)
                                    if not entry.startswith(f'{ENVIRONMENT}{os.sep}'))
        if not env[name]:
            del env[name]
    return env


def fingerprint(*parts: object) -> str:
    """Return a hash of the string representations of values."""
    return hashlib.sha256('\0'.join(map(str, parts)).encode()).hexdigest()


def folder_fingerprint(folder: Path) -> str:
    """Return a hash of the names, modes and contents of the source files in a package."""
    found: list[object] = []
    if folder.name in SHARED_FILES:
        shared = sorted((TOP / 'turtle_brick').glob(SHARED_FILES[folder.name]))
        found += [path.read_bytes() for path in shared]
    for path in sorted(folder.rglob('*')):
        name = path.relative_to(folder)
        if path.is_file() and name.parts[0] not in NOT_BUILT and not IGNORED.search(f'/{name}'):
            found += [name, os.access(path, os.X_OK), path.read_bytes()]
    return fingerprint(*found)


def read_record() -> dict[str, str]:
    """Return the recorded fingerprints, or an empty dict if the record is missing or invalid."""
    try:
        return json.loads(RECORD.read_text())
    except (OSError, ValueError):
        return {}


def write_record(made: dict[str, str]) -> None:
    """Write the fingerprints to the record file."""
    RECORD.write_text(json.dumps(made, indent=1, sort_keys=True) + '\n')


def lock() -> None:
    """Wait until no other process is building the workspace, and lock it until exit."""
    folder = os.open(TOP, os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        report('turtle_brick: Another terminal is building this workspace. Waiting ...')
        fcntl.flock(folder, fcntl.LOCK_EX)
    except OSError:
        pass  # Some file systems, such as NFS, cannot lock a folder.


def check_path() -> None:
    """Check that CMake and colcon accept the workspace path."""
    for character in str(ENVIRONMENT):
        if not (character.isalnum() or character in ALLOWED):
            raise SetupError(f'The path {str(TOP)!r} contains {character!r}, which CMake or '
                             'colcon cannot handle. Move the workspace to another path.')


def check_platform() -> None:
    """Check that this machine runs x86-64 Linux with a supported version of glibc."""
    library, version = platform.libc_ver()
    machine = (platform.system(), platform.machine().lower(), library)
    numbers = [int(number) for number in re.findall(r'\d+', version)]
    if machine != ('Linux', 'x86_64', 'glibc') or numbers < [2, 28]:
        raise SetupError(
            'The Python wheels for ROS 2 Jazzy require Linux on x86-64 with glibc 2.28 or newer, '
            f'but this is {platform.system()} on {platform.machine()} with '
            f'{f"{library} {version}" if library else "another C library"}. '
            'Install ROS 2 Jazzy or use its container, and source its setup.bash first.')


def check_programs(*required: tuple[str, tuple[str, ...], str]) -> None:
    """Check that the PATH contains a program of each required kind."""
    for kind, names, package in required:
        if not any(map(shutil.which, names)):
            raise SetupError(f'No {kind} found: the PATH does not contain {" or ".join(names)}. '
                             f'Install one, for example with "sudo apt install {package}".')


def check_python() -> None:
    """Check that this Python can create virtual environments and that its C headers exist."""
    if not all(map(importlib.util.find_spec, ('ensurepip', 'venv'))):
        raise SetupError(
            f'Python {VERSION} at {sys.executable} cannot create virtual environments. Install '
            f'the missing package, for example with "sudo apt install python{VERSION}-venv".')
    header = Path(sysconfig.get_path('include'), 'Python.h')
    if not header.is_file():
        raise SetupError(
            f'The C headers of Python {VERSION} are missing: {header} does not exist. Install '
            f'them, for example with "sudo apt install python{VERSION}-dev".')


def repair_cmake(text: str, include: str, packages: str) -> str:
    """Replace foreign paths and unsafe commands in the text of a CMake file from the wheels."""
    text = FOREIGN_INCLUDE.sub(lambda _: include, text)
    text = FOREIGN_PACKAGES.sub(lambda _: packages, text)
    text = UNQUOTED_TARGET.sub(r'\1 VERBATIM', text)
    return ASCII_LINES.sub(r'\1 ENCODING UTF-8)', text)


def make_venv() -> None:
    """Create the virtual environment and install the wheels."""
    env = clean_environment()
    for name in ('PYTHONPATH', 'PYTHONHOME'):
        env.pop(name, None)
    env.update(PYTHONNOUSERSITE='1', PIP_USER='0', PIP_NO_INPUT='1',
               PIP_DISABLE_PIP_VERSION_CHECK='1', _ROS_WHEELS_BOOTSTRAP_COMPLETE='1')

    run([str(BASE_PYTHON), '-m', 'venv', str(VENV)], env,
        f'creating a virtual environment with Python {platform.python_version()}',
        f'{BASE_PYTHON} could not create a virtual environment. See its output above.')
    pip = [f'{VENV}/bin/python', '-m', 'pip', 'install', '--no-deps', '--no-build-isolation',
           '--use-pep517']
    setuptools = next(line.split()[0] for line in REQUIREMENTS.read_text().splitlines()
                      if line.startswith('setuptools=='))
    # Three small packages have no wheels. pip requires setuptools to build them.
    for name, arguments in (('setuptools', [setuptools]),
                            ('ROS 2 Jazzy', ['-r', str(REQUIREMENTS)])):
        run([*pip, *arguments], env, f'downloading and installing {name}',
            f'pip could not install the packages in {REQUIREMENTS.name}. See its output above. '
            'Check the network connection and the proxy and index of pip, and try again.')

    packages = VENV / 'lib' / f'python{VERSION}' / 'site-packages'
    for path in (VENV / 'share').rglob('*.cmake'):
        text = path.read_text()
        repaired = repair_cmake(text, sysconfig.get_path('include'), str(packages))
        if repaired != text:
            path.write_text(repaired)
    shutil.copy(LOCAL_SETUP, VENV)


def find_prefix(package: str, prefixes: Iterable[str]) -> str | None:
    """Return the first prefix with a package in its ament index, or None."""
    index = 'share/ament_index/resource_index/packages'
    return next((prefix for prefix in prefixes if Path(prefix, index, package).is_file()), None)


def packages_to_build(prefixes: list[str]) -> dict[str, Path]:
    """Return the folders of both packages and of all required stand-ins, by package name."""
    folders = {}
    for manifest in sorted(TOP.glob('turtle_brick/standins/*/package.xml')):
        name = manifest.parent.name
        if not find_prefix(REAL_NAMES.get(name, name), prefixes):
            folders[name] = manifest.parent
    for name in ('turtle_brick_interfaces', 'turtle_brick'):
        folders[name] = TOP / name
    return folders


def build(prefixes: list[str], python: str, made: dict[str, str], launcher: list[str],
          env: dict[str, str]) -> None:
    """
    Build the changed packages, and delete the builds of packages that are no longer required.

    :param prefixes: ROS prefixes in the underlay
    :param python: identification of the Python interpreter for the build
    :param made: recorded fingerprints
    :param launcher: command prefix that runs a command in the underlay
    """
    folders = packages_to_build(prefixes)
    real = [find_prefix(name, prefixes)
            for name in ('rclpy', 'geometry_msgs', 'rosidl_default_generators')]
    underlay = fingerprint(ENVIRONMENT, python, Path(__file__).read_bytes(), *real)
    current = {name: fingerprint(underlay, folder_fingerprint(folder))
               for name, folder in folders.items()}
    changed = [name for name in folders
               if made.get(name) != current[name] or not (ENVIRONMENT / 'install' / name).is_dir()]
    outdated = [*changed, *(set(made) - set(folders) - {'venv'})]
    if changed and not launcher:
        check_programs(*BUILD_TOOLS)
    if any((folders[name] / 'CMakeLists.txt').is_file() for name in changed):
        check_programs(*COMPILERS)
    ENVIRONMENT.mkdir(exist_ok=True)
    made = {name: mark for name, mark in made.items() if name not in outdated}
    if outdated:
        write_record(made)
    for name in outdated:
        # colcon does not delete files that a package no longer installs.
        shutil.rmtree(ENVIRONMENT / 'build' / name, ignore_errors=True)
        shutil.rmtree(ENVIRONMENT / 'install' / name, ignore_errors=True)
    if not changed:
        return
    command = [
        *launcher, 'colcon', '--log-base', str(ENVIRONMENT / 'log'), 'build',
        '--base-paths', *map(str, folders.values()), '--packages-select', *changed,
        '--build-base', str(ENVIRONMENT / 'build'), '--install-base', str(ENVIRONMENT / 'install')]
    if launcher:
        # The linters for turtle_brick_interfaces are not on PyPI.
        command += ['--cmake-args', f'-DPython3_EXECUTABLE={VENV}/bin/python3',
                    '-DBUILD_TESTING=OFF']
    run(command, env, f'building {len(changed)} of {len(folders)} packages',
        f'colcon could not build {", ".join(changed)}. See its output above and in '
        '.ros/log/latest_build.')
    write_record({**made, **current})


def remove_environment() -> None:
    """Delete the directory `.ros`, starting with the record file."""
    RECORD.unlink(missing_ok=True)
    shutil.rmtree(ENVIRONMENT, ignore_errors=True)


def make_native_environment(made: dict[str, str]) -> None:
    """Build the packages against the sourced ROS installation."""
    env = clean_environment()
    env['COLCON_DEFAULTS_FILE'] = os.devnull
    prefixes = [prefix for prefix in env.get('AMENT_PREFIX_PATH', '').split(os.pathsep) if prefix]
    build(prefixes, f'{sys.prefix} {VERSION}', made, [], env)


def make_pypi_environment(made: dict[str, str]) -> None:
    """Create the virtual environment if it is missing or outdated, and build the packages."""
    sources = (REQUIREMENTS, LOCAL_SETUP, Path(__file__))
    mark = fingerprint(VENV, BASE_PYTHON, *(path.read_bytes() for path in sources))
    if made.get('venv') != mark or not VENV.is_dir():
        check_path()
        check_platform()
        check_programs(*COMPILERS)
        check_python()
        report('turtle_brick: ROS 2 Jazzy is not installed. Installing it once from Python wheels '
               'into .ros, which takes two to four minutes and 650 MB ...')
        try:
            remove_environment()
            ENVIRONMENT.mkdir(exist_ok=True)
            make_venv()
            made = {'venv': mark}
            write_record(made)
        except BaseException:
            remove_environment()
            raise
    env = clean_environment()
    # With these variables, CMake would also search the prefixes of another environment.
    for name in ('CONDA_PREFIX', 'CMAKE_PREFIX_PATH'):
        env.pop(name, None)
    env.update(CMAKE_GENERATOR='Ninja', COLCON_DEFAULTS_FILE=os.devnull, PYTHONUTF8='1')
    launcher = ['bash', '-c', 'source "$0" && exec "$@"', str(VENV / 'local_setup.bash')]
    build([str(VENV)], mark, made, launcher, env)


def main() -> int:
    """Make the environment selected on the command line, and return the exit status."""
    make = {'native': make_native_environment, 'pypi': make_pypi_environment}[sys.argv[1]]
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)
    try:
        lock()
        make(read_record())
    except SetupError as error:
        report(f'turtle_brick: {error}')
    except KeyboardInterrupt:
        report('turtle_brick: The build was interrupted. Source env.bash again.')
    except OSError as error:
        report(f'turtle_brick: The workspace cannot be built: {error}.')
    else:
        return 0
    return 1


if __name__ == '__main__':
    sys.exit(main())
