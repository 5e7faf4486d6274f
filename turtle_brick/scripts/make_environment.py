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
Create or update the directory `.ros`, which contains the environment for this workspace.

The first argument selects the ROS installation. `native` uses the sourced installation, and `pypi`
installs ROS from Python wheels. The second argument selects the packages to build. `ros` builds
all stand-ins. `packages` builds the packages of this project and only the stand-ins that they
require. If the workspace contains further packages, that is every stand-in.

The script setup_shell.bash runs this program and then sources the setup files in `.ros`. The
directory `.ros` contains the following items:

- `venv` is a virtual environment. In the PyPI environment, it contains rclpy, DDS, rosidl and the
  Jazzy messages and is also a ROS prefix whose `local_setup.bash` sets environment variables. In
  the native environment, it contains only what the folder extras requires and the machine lacks.
- `standins`, `install` and `own` contain the built stand-ins with turtle_graph, the built packages
  that use turtle_brick, and the built packages that the user added to the workspace.
- `build` and `log` are the other colcon directories.
- `made.json` contains fingerprints of the virtual environment and of each built package.

The exit status is 0 on success and 2 if only what the folder extras requires could not be
installed. Otherwise, it is 1. If it is not 0, the last line of output states the reason.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
import fcntl
import hashlib
from importlib.metadata import PackageNotFoundError, version
import importlib.util
import json
import os
from pathlib import Path
import platform
import pwd
import re
import shlex
import shutil
import signal
import subprocess
import sys
import sysconfig
import time

SCRIPTS = Path(__file__).resolve().parent
REQUIREMENTS = SCRIPTS / 'requirements.txt'
COPIED = (SCRIPTS / 'local_setup.bash', SCRIPTS / 'fastdds.xml')
TOP = SCRIPTS.parents[1]
EXTRAS = TOP / 'turtle_brick' / 'extras'
OWN_REQUIREMENTS = TOP / '.ros-requirements.txt'
ENVIRONMENT = TOP / '.ros'
VENV = ENVIRONMENT / 'venv'
RECORD = ENVIRONMENT / 'made.json'

VERSION = f'{sys.version_info.major}.{sys.version_info.minor}'
BASE_PYTHON = Path(sys.base_prefix, 'bin', f'python{VERSION}')
"""Python interpreter that creates the virtual environment."""

FOREIGN_INCLUDE = re.compile(r'/opt/python/cp\w+-cp\w+/include/python3\.\d+t?')
NUMPY_HEADERS = re.compile('numpy/_?core/include')
FOREIGN_PACKAGES = re.compile(r'/opt/python/cp\w+-cp\w+/lib/python3\.\d+t?/site-packages')
"""Paths in the wheels' CMake files that may exist only on the machine that built the wheels."""

CPP_GENERATORS = ('rosidl_generator_cpp', 'rosidl_typesupport_cpp',
                  'rosidl_typesupport_fastrtps_cpp', 'rosidl_typesupport_introspection_cpp')
"""Interface generators for rclcpp, which the environment does not contain."""

GENERATORS = re.compile(r'(ament_execute_extensions\("rosidl_generate_idl_interfaces")\)')
"""CMake command that runs the interface generators."""

NO_TYPE_SUPPORT = re.compile(r'set\(output_target "\$\{output_target\}-NOTFOUND"\)')
"""CMake command that is executed if a package requires an interface in another language."""

UNQUOTED_TARGET = re.compile(r'(add_custom_target\(\s*ament_cmake_python_\S+(?: ALL)?)')
ASCII_LINES = re.compile(r'(file\(STRINGS "\$\{idl_output\}" idl_tuples)\)')
"""CMake commands that fail if the workspace path contains parentheses or non-ASCII letters."""

BEYOND_ROS = '# Beyond ROS:'
"""Beginning of the line in REQUIREMENTS that precedes the packages for the folder extras."""

PINNED = ('--no-deps', '--no-build-isolation', '--use-pep517')
"""Options of pip for packages whose dependencies are listed too."""

NETWORK_OPTION = re.compile('INDEX|LINKS|HOST|CERT|PROXY|TIMEOUT|RETRIES|CACHE|CONFIG|KEYRING')
"""Names of pip options that change neither the installed packages nor their location."""

REQUIRED_SPACE = 750
"""Required free space (MB): 600 MB for the environment, and temporary files of pip."""

ALLOWED = '/ ._-+~@=!%&()#'
"""Special characters that CMake, Ninja and colcon accept in a path."""

TURTLE_GRAPH = EXTRAS / 'turtle_graph'
"""Folder of the package that the stand-ins use and that does not depend on turtle_brick."""

PACKAGES = {folder.name: folder for folder in (
    TOP / 'turtle_brick_interfaces', TOP / 'turtle_brick', EXTRAS / 'turtle_brick_tools')}
"""Folders of the other packages that belong to this project, in build order."""

LATER = ('example_interfaces',)
"""Stand-ins that these packages do not require."""

BASES = ('standins', 'install', 'own')
"""Directories in `.ros` with the built packages. Each one depends on those before it."""

NOT_BUILT = ('doc', 'extras', 'media', 'scripts', 'test')
MANIFEST_NAME = re.compile(r'<name>\s*([\w-]+)\s*</name>')
"""Package name in a package.xml file."""

IGNORED = re.compile(r'/\.|/__pycache__/|\.egg-info/')
"""Folders, hidden files and generated files that do not affect package builds."""

SHARED_FILES = {'turtlesim': ('turtle_brick/core/turtlesim_arena.py',
                              'turtle_brick/core/turtlesim_kinematics.py')}
"""Source files of the package turtle_brick that a stand-in also installs."""

REPLACED = {'absent_packages': 'rclcpp'}
"""Package that a stand-in replaces, if the stand-in has another name."""

COMPILERS = (('C compiler', ('cc', 'gcc', 'clang'), 'build-essential'),
             ('C++ compiler', ('c++', 'g++', 'clang++'), 'build-essential'))
BUILD_TOOLS = (('build tool', ('colcon',), 'python3-colcon-common-extensions'),
               ('build tool', ('cmake',), 'cmake'))
"""Description, alternative names and Ubuntu package of each required program."""


class SetupError(Exception):
    """Setup failure whose message suggests a remedy."""


def report(text: str, end: str = '\n') -> None:
    """Print text to standard error."""
    print(f'{text}{end}', end='', file=sys.stderr, flush=True)


def run(command: list[str], env: dict[str, str], step: str, failed: str,
        show_output: bool = True) -> None:
    """
    Run a command and report its progress.

    :param show_output: whether the whole output is shown if the command fails
    :raises SetupError: if the command fails; `failed` is the error message, which the last line of
        the output precedes if the output is not shown
    """
    start, output = time.monotonic(), ''

    def show(line: str, end: str = '') -> None:
        if sys.stderr.isatty():
            text = f'\r  {step} ... {time.monotonic() - start:.0f} s {line}'.rstrip()
            report(f'{text[:shutil.get_terminal_size().columns]}\033[K', end)

    report(f'  {step} ...', end='' if sys.stderr.isatty() else '\n')
    with subprocess.Popen(
            command, cwd=TOP, env=env, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, errors='replace',
            start_new_session=True) as process:
        try:
            for line in process.stdout or ():
                output += line
                show(line.strip())
            process.wait()
        finally:
            # After a KeyboardInterrupt, the command and its children may still be running.
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            show('', end='\n')
    if process.returncode:
        if show_output:
            report(output.rstrip())
        else:
            failed = f'{" ".join(output.splitlines()[-1:])}. {failed}'
        raise SetupError(failed)


def clean_environment() -> dict[str, str]:
    """Return the environment variables without any search path entries inside `.ros`."""
    env = dict(os.environ)
    for name in [name for name in env if name.endswith('PATH')]:
        env[name] = os.pathsep.join(entry for entry in env[name].split(os.pathsep)
                                    if not entry.startswith(f'{ENVIRONMENT}{os.sep}'))
        if not env[name]:
            del env[name]
    return env


def fingerprint(*parts: object) -> str:
    """Return a hash of the string representations of the given values."""
    return hashlib.sha256('\0'.join(map(str, parts)).encode()).hexdigest()


def folder_fingerprint(folder: Path) -> str:
    """Return a hash of the names, modes and contents of the source files in a package."""
    found: list[object] = []
    for pattern in SHARED_FILES.get(folder.name, ()):
        found += [path.read_bytes() for path in sorted((TOP / 'turtle_brick').glob(pattern))]
    not_built = NOT_BUILT if folder in (TURTLE_GRAPH, *PACKAGES.values()) else ()
    for path in sorted(folder.rglob('*')):
        name = path.relative_to(folder)
        if path.is_file() and name.parts[0] not in not_built and not IGNORED.search(f'/{name}'):
            found += [name, os.access(path, os.X_OK), path.read_bytes()]
    return fingerprint(*found)


def read_record() -> dict[str, str]:
    """Return the recorded fingerprints, or {} if there is no valid record."""
    try:
        return json.loads(RECORD.read_text())
    except (OSError, ValueError):
        return {}


def write_record(made: dict[str, str]) -> None:
    """Record the fingerprints of the environment and its packages."""
    RECORD.write_text(json.dumps(made, indent=1, sort_keys=True) + '\n')


def lock() -> None:
    """Wait for other builds of the workspace, and then lock the workspace for this process."""
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
    library, release = platform.libc_ver()
    machine = (platform.system(), platform.machine().lower(), library)
    numbers = [int(number) for number in re.findall(r'\d+', release)]
    if machine != ('Linux', 'x86_64', 'glibc') or numbers < [2, 28]:
        raise SetupError(
            'The Python wheels for ROS 2 Jazzy require Linux on x86-64 with glibc 2.28 or newer, '
            f'but this is {platform.system()} on {platform.machine()} with '
            f'{f"{library} {release}" if library else "another C library"}. '
            'Install ROS 2 Jazzy or use its container, and source its setup.bash first.')


def owner_id(path: Path) -> int:
    """Return the ID of the user who owns a file or folder."""
    return path.lstat().st_uid


def owner_hint(part: Path) -> str:
    """Return a sentence about the workspace or a part of `.ros` if it belongs to another user."""
    for path in filter(Path.exists, (TOP, part)):
        owner = owner_id(path)
        if owner != os.geteuid():
            try:
                name = pwd.getpwuid(owner).pw_name
            except KeyError:
                name = f'the user with the ID {owner}'
            return f' {path} belongs to {name}. ' + (
                'Copy the workspace without the .ros folder to a folder of your own, and source '
                'env.bash there.' if path == TOP else
                f'Enter: sudo chown -R "$(id -u)" {shlex.quote(str(ENVIRONMENT))}')
    return ''


def check_owner() -> None:
    """Check that this user can change `.ros`, which root owns if it was made with sudo."""
    for path in (ENVIRONMENT, *ENVIRONMENT.glob('*'), *ENVIRONMENT.glob('*/*')):
        if path.exists() and not os.access(path, os.W_OK):
            raise SetupError(f'{path} cannot be changed.{owner_hint(path)}')


def check_disk() -> None:
    """Check that the disk has enough space for the virtual environment."""
    free = shutil.disk_usage(TOP).free / 1e6
    if free < REQUIRED_SPACE:
        raise SetupError(f'The disk that contains {TOP} has {free:.0f} MB of free space, but '
                         f'ROS 2 Jazzy requires {REQUIRED_SPACE} MB. Delete other files first.')


def check_programs(*required: tuple[str, tuple[str, ...], str]) -> None:
    """Check that the required programs are on the PATH."""
    for kind, names, package in required:
        if not any(map(shutil.which, names)):
            raise SetupError(f'No {kind} found: the PATH does not contain {" or ".join(names)}. '
                             f'Install one, for example with "sudo apt install {package}".')


def check_python() -> None:
    """Check that this Python can create virtual environments and has C headers."""
    if not all(map(importlib.util.find_spec, ('ensurepip', 'venv'))):
        raise SetupError(
            f'Python {VERSION} at {sys.executable} cannot create virtual environments. Install '
            f'the missing package, for example with "sudo apt install python{VERSION}-venv".')
    header = Path(sysconfig.get_path('include'), 'Python.h')
    if not header.is_file():
        raise SetupError(
            f'The C headers of Python {VERSION} are missing: {header} does not exist. Install '
            f'them, for example with "sudo apt install python{VERSION}-dev".')


def repair_cmake(text: str, include: str, packages: str, numpy: str) -> str:
    """
    Repair the paths and commands in the text of a wheel's CMake file.

    :param include: folder with the headers of Python
    :param packages: folder with the Python packages
    :param numpy: folder with the headers of NumPy, relative to `packages`
    """
    text = FOREIGN_INCLUDE.sub(lambda _: include, text)
    text = FOREIGN_PACKAGES.sub(lambda _: packages, text)
    text = NUMPY_HEADERS.sub(numpy, text)
    text = GENERATORS.sub(rf'\1 EXCLUDE {" ".join(CPP_GENERATORS)})', text)
    text = NO_TYPE_SUPPORT.sub(
        'message(FATAL_ERROR "The PyPI environment generates interfaces for C and Python, but '
        'this package requires ${typesupport_name}. Nodes in C++ require ROS 2 Jazzy.")', text)
    text = UNQUOTED_TARGET.sub(r'\1 VERBATIM', text)
    return ASCII_LINES.sub(r'\1 ENCODING UTF-8)', text)


def pip_install(packages: str, *arguments: str, show_output: bool = True) -> None:
    """Install packages in the virtual environment."""
    env = {name: value for name, value in clean_environment().items()
           if not name.startswith(('PIP_', 'PYTHON')) or NETWORK_OPTION.search(name)}
    env.update(PYTHONNOUSERSITE='1', PIP_USER='0', PIP_NO_INPUT='1',
               PIP_DISABLE_PIP_VERSION_CHECK='1', _ROS_WHEELS_BOOTSTRAP_COMPLETE='1')
    cache = [] if os.access(os.path.expanduser('~'), os.W_OK) else ['--no-cache-dir']
    # Python compiles a module when it is imported. Most modules are never imported.
    run([f'{VENV}/bin/python', '-m', 'pip', 'install', '--no-compile', *cache, *arguments], env,
        f'downloading and installing {packages}',
        f'pip could not install {packages}.{" See its output above." if show_output else ""} '
        'Check the network connection and the proxy and index of pip, and try again.', show_output)


def make_venv() -> None:
    """Create the virtual environment and install the wheels."""
    run([str(BASE_PYTHON), '-I', '-m', 'venv', str(VENV)], clean_environment(),
        f'creating a virtual environment with Python {platform.python_version()}',
        f'{BASE_PYTHON} could not create a virtual environment. See its output above.')
    # Three small packages have no wheels. pip requires setuptools to build them.
    tools = [line.split()[0] for line in REQUIREMENTS.read_text().splitlines()
             if line.startswith(('pip==', 'setuptools=='))]
    pip_install('pip and setuptools', *PINNED, *tools)
    pip_install('ROS 2 Jazzy', *PINNED, '-r', str(REQUIREMENTS))

    packages = VENV / 'lib' / f'python{VERSION}' / 'site-packages'
    # NumPy 2 renamed this folder, and the wheels were built with NumPy 2.
    numpy = next(str(path.relative_to(packages)) for path in packages.glob('numpy/*core/include'))
    for path in (VENV / 'share').rglob('*.cmake'):
        text = path.read_text()
        repaired = repair_cmake(text, sysconfig.get_path('include'), str(packages), numpy)
        if repaired != text:
            path.write_text(repaired)
    for path in COPIED:
        shutil.copy(path, VENV)


def find_prefix(package: str, prefixes: Iterable[str]) -> str | None:
    """Return the first prefix in which `package` is installed, or None if there is none."""
    index = 'share/ament_index/resource_index/packages'
    return next((prefix for prefix in prefixes if Path(prefix, index, package).is_file()), None)


def standins(prefixes: list[str], complete: bool) -> dict[str, Path]:
    """
    Return the folders of the required stand-ins whose real packages are absent.

    :param prefixes: prefixes of the ROS installation
    :param complete: whether also the stand-ins in LATER are required
    :return: folders, keyed by package name
    """
    folders = {manifest.parent.name: manifest.parent
               for manifest in sorted(EXTRAS.glob('standins/*/package.xml'))}
    return {name: folder for name, folder in folders.items()
            if not find_prefix(REPLACED.get(name, name), prefixes)
            and (complete or name not in LATER or (ENVIRONMENT / 'standins' / name).is_dir())}


def own_packages() -> dict[str, Path]:
    """Return the folders of the packages that the user added to the workspace, keyed by name."""
    folders = {}
    for manifest in sorted((*TOP.glob('*/package.xml'), *TOP.glob('*/*/package.xml'))):
        folder = manifest.parent
        name = MANIFEST_NAME.search(manifest.read_text(errors='replace'))
        inside = (folder.parent / 'package.xml').is_file()
        ignored = any((place / file).exists() for place in (folder, folder.parent)
                      for file in ('COLCON_IGNORE', 'AMENT_IGNORE'))
        if name and name[1] not in PACKAGES and not inside and not ignored:
            folders[name[1]] = folder
    return folders


def build(base: str, folders: dict[str, Path], made: dict[str, str], mark: str,
          setup_files: list[Path]) -> None:
    """
    Build the changed packages, and delete the builds of packages that are no longer required.

    :param base: name of the directory in `.ros` in which the packages are installed
    :param folders: folders of the packages, keyed by package name
    :param made: recorded fingerprints, which the function updates
    :param mark: fingerprint of the ROS installation
    :param setup_files: setup files of the ROS installation that have not been sourced yet
    """
    current = {name: fingerprint(mark, folder_fingerprint(folder))
               for name, folder in folders.items()}
    install = ENVIRONMENT / base
    changed = [name for name in folders
               if made.get(name) != current[name] or not (install / name).is_dir()]
    if changed and not setup_files:
        check_programs(*BUILD_TOOLS)
    if any((folders[name] / 'CMakeLists.txt').is_file() for name in changed):
        check_programs(*COMPILERS)
    ENVIRONMENT.mkdir(exist_ok=True)
    unused = {path.name for path in install.glob('*') if path.is_dir()} - set(folders)
    if changed or unused:
        check_owner()
    for name in (*changed, *unused):
        made.pop(name, None)
        write_record(made)
        # colcon does not delete files that a package no longer installs.
        shutil.rmtree(ENVIRONMENT / 'build' / name, ignore_errors=True)
        shutil.rmtree(install / name, ignore_errors=True)
    if not changed:
        return
    setup_files = [*setup_files, *(ENVIRONMENT / earlier / 'local_setup.bash'
                                   for earlier in BASES[:BASES.index(base)])]
    try:
        run_colcon([*folders.values()], changed, install, setup_files)
    finally:
        made.update((name, current[name]) for name in changed if is_built(name))
        write_record(made)


def run_colcon(folders: list[Path], changed: list[str], install: Path,
               setup_files: list[Path]) -> None:
    """Source the setup files and build the changed packages."""
    # colcon's setup scripts require an empty IFS because they do not quote the path to Python.
    sourced = [f'IFS= source {shlex.quote(str(path))}' for path in setup_files if path.is_file()]
    try:
        run(['bash', '-c', ' && '.join([*sourced, 'exec "$@"']), 'bash',
             'colcon', '--log-base', str(ENVIRONMENT / 'log'), 'build', '--continue-on-error',
             '--base-paths', *map(str, folders), '--packages-select', *changed,
             '--build-base', str(ENVIRONMENT / 'build'), '--install-base', str(install)],
            {**clean_environment(), 'COLCON_DEFAULTS_FILE': os.devnull, 'PYTHONUTF8': '1'},
            f'building {len(changed)} of {len(folders)} packages', '')
    except SetupError:
        failed = ', '.join(name for name in changed if not is_built(name))
        raise SetupError(f'colcon could not build {failed}. See its output above and in '
                         '.ros/log/latest_build.') from None


def is_built(name: str) -> bool:
    """Return whether the latest build of a package succeeded."""
    status = ENVIRONMENT / 'build' / name / 'colcon_build.rc'
    return status.is_file() and status.read_text().strip() == '0'


def remove_environment() -> None:
    """Delete the directory `.ros`, starting with the record file."""
    RECORD.unlink(missing_ok=True)
    shutil.rmtree(ENVIRONMENT, ignore_errors=True)


def is_installed(requirement: str) -> bool:
    """Return whether any version of a pinned package is installed for this Python."""
    with suppress(PackageNotFoundError):
        return bool(version(requirement.partition('==')[0]))
    return False


def install_extras(made: dict[str, str]) -> None:
    """
    Install what the folder extras requires and this machine lacks in a virtual environment.

    :param made: recorded fingerprints, which the function updates
    :raises SetupError: if the packages cannot be installed
    """
    _, _, beyond = REQUIREMENTS.read_text().partition(BEYOND_ROS)
    pinned = [line.split()[0] for line in beyond.splitlines()
              if '==' in line and not line.startswith('#')]
    lacking = [requirement for requirement in pinned if not is_installed(requirement)]
    mark = fingerprint('native', BASE_PYTHON, *lacking)
    if made.get('venv') == mark and VENV.is_dir() == bool(lacking):
        return
    shutil.rmtree(VENV, ignore_errors=True)
    if lacking:
        check_python()
        report(f'turtle_brick: Installing {len(lacking)} Python packages that this machine lacks '
               'into .ros. They serve the page in the browser, the tools and the tests ...')
        ENVIRONMENT.mkdir(exist_ok=True)
        run([str(BASE_PYTHON), '-I', '-m', 'venv', str(VENV), '--system-site-packages'],
            clean_environment(), 'creating a virtual environment',
            f'{BASE_PYTHON} could not create a virtual environment.', show_output=False)
        try:
            pip_install('what this machine lacks', *PINNED, *lacking, show_output=False)
        except BaseException:
            shutil.rmtree(VENV, ignore_errors=True)
            raise
    made['venv'] = mark
    write_record(made)


def use_native() -> tuple[list[str], str, list[Path]]:
    """Return the prefixes and fingerprint of the sourced ROS installation."""
    prefixes = clean_environment().get('AMENT_PREFIX_PATH', '').split(os.pathsep)
    mark = fingerprint(ENVIRONMENT, sys.prefix, VERSION, Path(__file__).read_bytes(),
                       find_prefix('rclpy', prefixes))
    return prefixes, mark, []


def use_pypi(made: dict[str, str]) -> tuple[list[str], str, list[Path]]:
    """
    Update the virtual environment.

    :param made: recorded fingerprints, which the function updates
    :return: prefix, fingerprint and setup file of the environment
    """
    sources = (REQUIREMENTS, *COPIED, Path(__file__))
    mark = fingerprint(VENV, BASE_PYTHON, *(path.read_bytes() for path in sources))
    if made.get('venv') != mark or not VENV.is_dir():
        check_path()
        check_platform()
        check_programs(*COMPILERS)
        check_python()
        check_owner()
        reason = ('The ROS 2 Jazzy in .ros was installed by an earlier version of these scripts '
                  'or with another Python. Installing it again' if VENV.is_dir() else
                  'ROS 2 Jazzy is not installed. Installing it once')
        report(f'turtle_brick: {reason} from Python wheels into .ros, which takes two to four '
               'minutes and 600 MB ...')
        try:
            remove_environment()
            check_disk()
            ENVIRONMENT.mkdir(exist_ok=True)
            make_venv()
            made.clear()
            made['venv'] = mark
            write_record(made)
        except BaseException:
            remove_environment()
            raise
    if OWN_REQUIREMENTS.is_file():
        wanted = fingerprint(OWN_REQUIREMENTS.read_bytes())
        if made.get('own') != wanted:
            check_owner()
            pip_install(OWN_REQUIREMENTS.name, '-r', str(OWN_REQUIREMENTS))
            made['own'] = wanted
            write_record(made)
    return [str(VENV)], mark, [VENV / 'local_setup.bash']


def make_environment(kind: str, content: str) -> int:
    """Create or update the selected environment, and return the exit status."""
    made = read_record()
    own = own_packages()
    complete = content == 'ros' or bool(own)
    prefixes, mark, setup_files = use_native() if kind == 'native' else use_pypi(made)
    build('standins', {**standins(prefixes, complete), TURTLE_GRAPH.name: TURTLE_GRAPH}, made,
          mark, setup_files)
    if content == 'packages':
        build('install', PACKAGES, made, mark, setup_files)
        try:
            build('own', own, made, mark, setup_files)
        except SetupError as error:
            report(f'turtle_brick: {error} All other packages are ready.')
    if kind == 'native':
        try:
            install_extras(made)
        except SetupError as error:
            report(f'turtle_brick: {error} The packages of the assignment are ready.')
            return 2
    return 0


def main() -> int:
    """Make the environment and return the exit status."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)
    try:
        lock()
        return make_environment(*sys.argv[1:])
    except SetupError as error:
        report(f'turtle_brick: {error}')
    except KeyboardInterrupt:
        report('turtle_brick: The build was interrupted. Source env.bash again.')
    except OSError as error:
        report(f'turtle_brick: The workspace cannot be built: {error}.{owner_hint(ENVIRONMENT)}')
    return 1


if __name__ == '__main__':
    sys.exit(main())
