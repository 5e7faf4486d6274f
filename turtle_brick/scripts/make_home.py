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
Make the workspace's home, or bring it up to date: `make_home.py native|pypi`.

env.bash runs this program, and then sources what it leaves in `.ros/`, next to the two packages:

- `venv` (home `pypi` only): a virtual environment with the real rclpy, DDS, rosidl and messages
  of Jazzy, which is at the same time a ROS prefix; its `local_setup.bash` sets its variables.
- `build`, `install`, `log`: colcon's, for the two packages and for those stand-ins whose real
  package is in no prefix underneath.
- `made.json`: a fingerprint of all that each of these was made from, written after it was made
  and deleted before it is made again. What an interruption leaves behind has no fingerprint, so
  nothing half-made is taken for complete.

It needs nothing but the standard library and says what it does on standard error. Status 0 means
that the home is ready; otherwise one sentence has said what is missing and how to get it.
"""

from __future__ import annotations

from collections.abc import Iterable
import contextlib
import fcntl
import hashlib
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
from xml.etree import ElementTree

TOP = Path(__file__).resolve().parents[2]
HOME = TOP / '.ros'
VENV = HOME / 'venv'
RECORD = HOME / 'made.json'
REQUIREMENTS = Path(__file__).resolve().with_name('requirements.txt')
LOCAL_SETUP = REQUIREMENTS.with_name('local_setup.bash')

GLIBC = (2, 28)

# What the machine that built the wheels wrote into the CMake files that they export: the headers
# of its Python, and of the numpy in its site-packages.
FOREIGN_INCLUDE = re.compile(r'/opt/python/cp\w+-cp\w+/include/python3\.\d+t?')
FOREIGN_PACKAGES = re.compile(r'/opt/python/cp\w+-cp\w+/lib/python3\.\d+t?/site-packages')

# What in those files fails for a path like "Übung 2 (1)": commands whose arguments reach the
# shell unquoted (ament_cmake_python), and a list of paths read as ASCII (rosidl_adapter).
UNQUOTED_TARGET = re.compile(r'(add_custom_target\(\s*ament_cmake_python_\S+(?: ALL)?)')
ASCII_LINES = re.compile(r'(file\(STRINGS "\$\{idl_output\}" idl_tuples)\)')

# What a path may have besides letters and digits of any script. Most other characters mean
# something to CMake, Ninja, colcon or search paths, and cannot be escaped.
FIT = '/ ._-+~@=!%&()#'

# What is in a package's folder and does not affect its build.
NOT_BUILT = ('doc', 'media', 'scripts', 'standins', 'test')
NO_SOURCE = re.compile(r'/\.|/__pycache__/|\.egg-info/')

# A stand-in is named for what a user imports or runs; the real package may have another name.
REAL_NAMES = {'tf2_ros': 'tf2_ros_py'}

COMPILERS = (('C compiler', ('cc', 'gcc', 'clang'), 'build-essential'),
             ('C++ compiler', ('c++', 'g++', 'clang++'), 'build-essential'))
BUILD_TOOLS = (('build tool', ('colcon',), 'python3-colcon-common-extensions'),
               ('build tool', ('cmake',), 'cmake'))
"""What has to be on the PATH: what it is, its names, and the package of Ubuntu that has it."""


class HomeError(Exception):
    """Something is missing or failed; the message is one sentence for the user."""


# ------------------------------------------------------------------ what is said, what is run

def say(text: str, end: str = '\n') -> None:
    """Tell the user what is being done, on standard error."""
    print(text, end=end, file=sys.stderr, flush=True)


def run(command: list[str], env: dict[str, str], what: str, failed: str) -> None:
    """
    Run a command; print what it does, how long it took and, on a terminal, what it says meanwhile.

    :param failed: the sentence for the user if it fails
    :raises HomeError: it has failed, with that sentence; all that it wrote is shown above
    """
    start, output = time.monotonic(), ''

    def show(text: str = '', end: str = '') -> None:
        line = f'\r  {what} ... {time.monotonic() - start:.0f} s {text}'.rstrip()
        say(line[:shutil.get_terminal_size().columns] + '\033[K' * sys.stderr.isatty(), end)

    with contextlib.ExitStack() as stack:
        stack.callback(show, end='\n')
        say(f'  {what} ...', end='')
        process = stack.enter_context(subprocess.Popen(
            command, cwd=TOP, env=env, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, errors='replace'))
        stack.callback(process.kill)  # when this one is interrupted
        for line in process.stdout or ():
            output += line
            if sys.stderr.isatty():
                show(line.strip())
        process.wait()
    if process.returncode:
        say(output.rstrip())
        raise HomeError(failed)


def clean_environment() -> dict[str, str]:
    """Return this process's environment without what belongs to the home that is made."""
    env = dict(os.environ)
    for name in [name for name in env if name.endswith('PATH')]:
        env[name] = os.pathsep.join(entry for entry in env[name].split(os.pathsep)
                                    if not entry.startswith(f'{HOME}{os.sep}'))
        if not env[name]:
            del env[name]
    return env


# --------------------------------------------------------------------------- what is made of what

def fingerprint(*parts: object) -> str:
    """Return a hash of some values, by their printed form."""
    return hashlib.sha256('\0'.join(map(str, parts)).encode()).hexdigest()


def folder_fingerprint(folder: Path) -> str:
    """Return a hash of the names, modes and contents of the files that a package is built of."""
    found: list[object] = []
    for path in sorted(folder.rglob('*')):
        name = path.relative_to(folder)
        if path.is_file() and name.parts[0] not in NOT_BUILT and not NO_SOURCE.search(f'/{name}'):
            found += [name, os.access(path, os.X_OK), path.read_bytes()]
    return fingerprint(*found)


def read_record() -> dict[str, str]:
    """Return the fingerprints of what has been made, by its name; none if none can be read."""
    try:
        return json.loads(RECORD.read_text())
    except (OSError, ValueError):
        return {}


def write_record(made: dict[str, str]) -> None:
    """Keep the fingerprints of what has been made."""
    new = RECORD.with_suffix('.new')  # a full disk must not cost the record of what is there
    new.write_text(json.dumps(made, indent=1, sort_keys=True) + '\n')
    os.replace(new, RECORD)


def lock() -> None:
    """Lock the home: another terminal may make it at the same time."""
    folder = os.open(TOP, os.O_RDONLY)  # the lock goes with this process
    try:
        fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        say('turtle_brick: another process is making this home; waiting for it')
        fcntl.flock(folder, fcntl.LOCK_EX)
    except OSError:
        pass  # a file system that cannot lock a folder (NFS): go on without


# -------------------------------------------------------------------------- what the machine has

def check_path() -> None:
    """Check that CMake, colcon and search paths can take the path of this folder."""
    for character in str(HOME):
        if not (character.isalnum() or character in FIT):
            raise HomeError(f'The path {str(TOP)!r} contains {character!r}, which CMake, colcon '
                            'or search paths cannot handle: move the folder to another path.')


def check_platform() -> None:
    """Check that the wheels of Jazzy can run here: on an x86-64 Linux with glibc."""
    library, version = platform.libc_ver()
    if (platform.system(), platform.machine().lower(), library) != ('Linux', 'x86_64', 'glibc') \
            or tuple(map(int, version.split('.')[:2])) < GLIBC:
        raise HomeError(
            'The wheels of ROS 2 Jazzy need Linux on x86-64 with glibc '
            f'{GLIBC[0]}.{GLIBC[1]} or newer, but this machine has {platform.system()} on '
            f'{platform.machine()} with {library or "another C library"} {version}'.rstrip()
            + ': install ROS 2 Jazzy itself here, or use its container, and source it first.')


def check_programs(*wanted: tuple[str, tuple[str, ...], str]) -> None:
    """Check that one of the programs of each kind is on the PATH."""
    for kind, names, package in wanted:
        if not any(map(shutil.which, names)):
            raise HomeError(f'There is no {kind}, since the PATH has no {" or ".join(names)}: '
                            f'install one, for example with "sudo apt install {package}".')


def check_python() -> None:
    """Check that this Python can make a virtual environment and be compiled against."""
    version = '{}.{}'.format(*sys.version_info[:2])
    try:
        import ensurepip  # noqa: F401
        import venv  # noqa: F401
    except ImportError as error:
        raise HomeError(
            f'Python {version} at {sys.executable} cannot make virtual environments ({error}): '
            'install the missing part, for example with '
            f'"sudo apt install python{version}-venv".') from None
    header = Path(sysconfig.get_path('include'), 'Python.h')
    if not header.is_file():
        raise HomeError(
            f'The C headers of Python {version} are missing, since there is no {header}: install '
            f'them, for example with "sudo apt install python{version}-dev".')


# ----------------------------------------------------------------------- the virtual environment

def venv_fingerprint() -> str:
    """Return the fingerprint of the virtual environment that this Python would make."""
    return fingerprint(VENV, sys.base_prefix, sys.version_info[:2], *(
        path.read_bytes() for path in (REQUIREMENTS, LOCAL_SETUP, Path(__file__))))


def point_to_this_machine(text: str, include: str, packages: str) -> str:
    """Repair an exported CMake file, which names the paths of the machine that built it."""
    text = FOREIGN_INCLUDE.sub(lambda _: include, text)
    text = FOREIGN_PACKAGES.sub(lambda _: packages, text)
    text = UNQUOTED_TARGET.sub(r'\1 VERBATIM', text)
    return ASCII_LINES.sub(r'\1 ENCODING UTF-8)', text)


def make_venv() -> None:
    """Make the virtual environment, from nothing."""
    env = clean_environment()
    for name in ('PYTHONPATH', 'PYTHONHOME'):
        env.pop(name, None)
    env.update(PYTHONNOUSERSITE='1', PIP_USER='0', PIP_NO_INPUT='1',
               PIP_DISABLE_PIP_VERSION_CHECK='1', _ROS_WHEELS_BOOTSTRAP_COMPLETE='1')
    python = str(VENV / 'bin' / 'python')

    # the interpreter itself, since this process may run in the environment that is replaced
    base = os.path.realpath(getattr(sys, '_base_executable', sys.executable))
    run([base, '-m', 'venv', str(VENV)], env,
        f'a virtual environment of Python {platform.python_version()}',
        f'{base} could not make a virtual environment: what it says is above.')
    pip = [python, '-m', 'pip', 'install', '--no-deps', '--no-build-isolation', '--use-pep517']
    setuptools = next(line.split()[0] for line in REQUIREMENTS.read_text().splitlines()
                      if line.startswith('setuptools=='))
    # three small packages are published as sources: setuptools must be there to build them
    for name, what in (('setuptools', [setuptools]), ('ROS 2 Jazzy', ['-r', str(REQUIREMENTS)])):
        run([*pip, *what], env, f'{name} from the package index',
            f'pip could not install the packages of {REQUIREMENTS.name}: what it says is above. '
            'Where it cannot reach the Python package index, connect this machine to the '
            "network, or set pip's proxy or index, and try again.")

    packages = VENV / 'lib' / 'python{}.{}'.format(*sys.version_info[:2]) / 'site-packages'
    for path in (VENV / 'share').rglob('*.cmake'):
        text = path.read_text()
        new = point_to_this_machine(text, sysconfig.get_path('include'), str(packages))
        if new != text:
            path.write_text(new)
    shutil.copy(LOCAL_SETUP, VENV)
    # The kernel takes no interpreter with a blank in its path, nor one that is very long.
    (packages / 'setuptools' / '_distutils' / 'distutils.cfg').write_text(
        '[build_scripts]\nexecutable = /usr/bin/env python3\n')


# ------------------------------------------------------------------------------------ the packages

def find_prefix(package: str, prefixes: Iterable[str]) -> str | None:
    """Return the first prefix that has a package in its ament index, or None."""
    for prefix in prefixes:
        if Path(prefix, 'share/ament_index/resource_index/packages', package).is_file():
            return prefix
    return None


def packages_to_build(prefixes: list[str]) -> dict[str, Path]:
    """
    Return the folder of each package that the workspace is to hold, by its name.

    :param prefixes: The prefixes of the home underneath.
    :return: The stand-ins of what is in no prefix, then the two packages themselves.
    """
    folders = {}
    for manifest in sorted(TOP.glob('turtle_brick/standins/*/package.xml')):
        name = ElementTree.parse(manifest).findtext('name')
        if not find_prefix(REAL_NAMES.get(name, name), prefixes):
            folders[name] = manifest.parent
    for name in ('turtle_brick_interfaces', 'turtle_brick'):
        folders[name] = TOP / name
    return folders


def underlay_fingerprint(prefixes: list[str], python: str) -> str:
    """Return a fingerprint of the home underneath, as far as packages are built against it."""
    return fingerprint(HOME, python, Path(__file__).read_bytes(), *(
        find_prefix(name, prefixes)
        for name in ('rclpy', 'geometry_msgs', 'rosidl_default_generators')))


def build(folders: dict[str, Path], underlay: str, made: dict[str, str], launcher: list[str],
          env: dict[str, str]) -> None:
    """
    Build the packages that changed, and delete those that are no longer wanted.

    :param folders: The folder of each package that the workspace is to hold, by its name.
    :param underlay: The fingerprint of the home underneath.
    :param made: The fingerprints of what has been made, which are brought up to date.
    :param launcher: The beginning of a command that is to run in the home underneath.
    """
    marks = {name: fingerprint(underlay, folder_fingerprint(folder))
             for name, folder in folders.items()}
    changed = [name for name, mark in marks.items()
               if made.get(name) != mark or not (HOME / 'install' / name).is_dir()]
    dropped = set(made) - set(marks) - {'venv'}
    if changed and not launcher:
        check_programs(*BUILD_TOOLS)
    if any((folders[name] / 'CMakeLists.txt').is_file() for name in changed):
        check_programs(*COMPILERS)
    HOME.mkdir(exist_ok=True)
    for name in [*changed, *dropped]:
        made.pop(name, None)
    if changed or dropped:
        write_record(made)
    for name in [*changed, *dropped]:
        # colcon keeps what a package has stopped to install
        for base in ('build', 'install'):
            shutil.rmtree(HOME / base / name, ignore_errors=True)
    if not changed:
        return
    command = [
        *launcher, 'colcon', '--log-base', str(HOME / 'log'), 'build',
        '--base-paths', *map(str, folders.values()), '--packages-select', *changed,
        '--build-base', str(HOME / 'build'), '--install-base', str(HOME / 'install')]
    if launcher:
        command += ['--cmake-args', f'-DPython3_EXECUTABLE={VENV}/bin/python3']
    packages = ', '.join(changed) if len(changed) < 3 else f'{len(changed)} packages'
    run(command, env, f'colcon build: {packages}',
        f'colcon could not build {", ".join(changed)}: its output is above and in '
        '.ros/log/latest_build.')
    write_record({**made, **marks})


# --------------------------------------------------------------------------------------- the homes

def remove_home() -> None:
    """Delete all that this program has made, the record of it first."""
    RECORD.unlink(missing_ok=True)
    shutil.rmtree(HOME, ignore_errors=True)


def make_native_home(made: dict[str, str]) -> None:
    """Build the packages on the ROS home that the environment has sourced."""
    env = clean_environment()
    env['COLCON_DEFAULTS_FILE'] = os.devnull  # a user's own layout is not this one
    prefixes = [prefix for prefix in env.get('AMENT_PREFIX_PATH', '').split(os.pathsep) if prefix]
    python = f'{sys.prefix} {sys.version_info[:2]}'
    build(packages_to_build(prefixes), underlay_fingerprint(prefixes, python), made, [], env)


def make_pypi_home(made: dict[str, str]) -> None:
    """Make the virtual environment, unless it is there and good, and build the packages on it."""
    mark = venv_fingerprint()
    if made.get('venv') != mark or not VENV.is_dir():
        check_path()
        check_platform()
        check_programs(*COMPILERS)
        check_python()
        say('turtle_brick: no ROS 2 Jazzy is at hand, so its wheels go into .ros '
            '(once: two to four minutes, 650 MB)')
        try:
            remove_home()
            HOME.mkdir(exist_ok=True)
            make_venv()
            made = {'venv': mark}
            write_record(made)
        except BaseException:
            remove_home()
            raise
    env = clean_environment()
    # of another environment that is active, which CMake would search as well
    for name in ('CONDA_PREFIX', 'CMAKE_PREFIX_PATH'):
        env.pop(name, None)
    env.update(CMAKE_GENERATOR='Ninja', COLCON_DEFAULTS_FILE=os.devnull, PYTHONUTF8='1')
    prefixes = [str(VENV)]
    launcher = ['bash', '-c', 'source "$0" && exec "$@"', str(VENV / 'local_setup.bash')]
    build(packages_to_build(prefixes), underlay_fingerprint(prefixes, mark), made, launcher, env)


def main() -> int:
    """Make the home that the command line names; return 0 if it is ready."""
    homes = {'native': make_native_home, 'pypi': make_pypi_home}
    if len(sys.argv) != 2 or sys.argv[1] not in homes:
        say('usage: make_home.py native|pypi')
        return 2
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)
    try:
        lock()
        homes[sys.argv[1]](read_record())
    except HomeError as error:
        say(f'turtle_brick: {error}')
    except KeyboardInterrupt:
        say('turtle_brick: Interrupted: the home is not ready.')
    except OSError as error:
        say(f'turtle_brick: The home cannot be made: {error}.')
    else:
        return 0
    return 1


if __name__ == '__main__':
    sys.exit(main())
