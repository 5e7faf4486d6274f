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
- `standins` and `install` contain the built stand-ins with turtle_graph, and the built packages
  that use turtle_brick or that the user added to the workspace.
- `build` and `log` are the other colcon directories.

The virtual environment and each built package contain a file `.made` with the fingerprint of their
sources. colcon alone would take 6 s to find that nothing has changed, and would not delete files
that a package no longer installs.

The exit status is 0 on success and 2 if only what the folder extras requires could not be
installed. Otherwise, it is 1. If it is not 0, the last line of output states the reason.
"""

from __future__ import annotations

from collections.abc import Iterable
import fcntl
import os
from pathlib import Path
import re
import shlex
import signal
import sys

import common
from common import ENVIRONMENT, EXTRAS, SetupError, TOP, VENV
import virtual_environment

TURTLE_GRAPH = EXTRAS / 'turtle_graph'
"""Folder of the package that the stand-ins use and that does not depend on turtle_brick."""

PACKAGES = {folder.name: folder for folder in (
    TOP / 'turtle_brick_interfaces', TOP / 'turtle_brick', EXTRAS / 'turtle_brick_tools')}
"""Folders of the other packages that belong to this project, in build order."""

LATER = ('example_interfaces',)
"""Stand-ins that these packages do not require."""

REPLACED = {'absent_packages': 'rclcpp'}
"""Package that a stand-in replaces, if the stand-in has another name."""

SHARED_FILES = {'turtlesim': ('turtle_brick/core/turtlesim_arena.py',
                              'turtle_brick/core/turtlesim_kinematics.py')}
"""Source files of the package turtle_brick that a stand-in also installs."""

NOT_BUILT = ('doc', 'extras', 'media', 'scripts', 'test')
"""Folders that the packages of this project do not install."""

IGNORED = re.compile(r'/\.|/__pycache__/|\.egg-info/')
"""Folders, hidden files and generated files that do not affect package builds."""

MANIFEST_NAME = re.compile(r'<name>\s*([\w-]+)\s*</name>')
"""Package name in a package.xml file."""


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


def folder_fingerprint(folder: Path) -> str:
    """Return a hash of the names, modes and contents of the source files in a package."""
    parts: list[object] = [(TOP / 'turtle_brick' / name).read_bytes()
                           for name in SHARED_FILES.get(folder.name, ())]
    not_built = NOT_BUILT if folder in (TURTLE_GRAPH, *PACKAGES.values()) else ()
    for path in sorted(folder.rglob('*')):
        relative = path.relative_to(folder)
        if (path.is_file() and relative.parts[0] not in not_built
                and not IGNORED.search(f'/{relative}')):
            parts += [relative, os.access(path, os.X_OK), path.read_bytes()]
    return common.fingerprint(*parts)


def is_built(name: str) -> bool:
    """Return whether the latest build of a package succeeded."""
    status = ENVIRONMENT / 'build' / name / 'colcon_build.rc'
    return status.is_file() and status.read_text().strip() == '0'


def run_colcon(folders: list[Path], changed: list[str], install: Path,
               setup_files: list[Path]) -> None:
    """Source the setup files and build the changed packages."""
    # colcon's setup scripts require an empty IFS because they do not quote the path to Python.
    sourced = [f'IFS= source {shlex.quote(str(path))}' for path in setup_files if path.is_file()]
    common.run(
        ['bash', '-c', ' && '.join([*sourced, 'exec "$@"']), 'bash',
         'colcon', '--log-base', str(ENVIRONMENT / 'log'), 'build', '--continue-on-error',
         '--base-paths', *map(str, folders), '--packages-select', *changed,
         '--build-base', str(ENVIRONMENT / 'build'), '--install-base', str(install)],
        {**common.clean_environment(), 'COLCON_DEFAULTS_FILE': os.devnull, 'PYTHONUTF8': '1'},
        f'building {len(changed)} of {len(folders)} packages', 'colcon failed.')


def build(base: str, folders: dict[str, Path], mark: str, ros_setup: Path | None) -> None:
    """
    Build the changed packages, and delete the builds of packages that are no longer required.

    :param base: name of the directory in `.ros` in which the packages are installed
    :param folders: folders of the packages, keyed by package name
    :param mark: fingerprint of the ROS installation
    :param ros_setup: setup file of the ROS installation if it has not been sourced yet
    :raises SetupError: if a package that belongs to this project cannot be built
    """
    install = ENVIRONMENT / base
    program = Path(__file__).read_bytes()
    marks = {name: common.fingerprint(mark, program, folder_fingerprint(folder))
             for name, folder in folders.items()}
    changed = [name for name in folders if not common.is_made(install / name, marks[name])]
    unused = {path.name for path in install.glob('*') if path.is_dir()} - set(folders)
    if changed and not ros_setup:
        common.check_programs(*common.COLCON)
    if any((folders[name] / 'CMakeLists.txt').is_file() for name in changed):
        common.check_programs(*common.COMPILERS)
    if not changed and not unused:
        return
    common.check_owner()
    for name in (*changed, *unused):
        # colcon does not delete files that a package no longer installs.
        common.remove(install / name)
        common.remove(ENVIRONMENT / 'build' / name)
    if not changed:
        return
    setup_files = [ros_setup] if ros_setup else []
    if base == 'install':
        setup_files.append(ENVIRONMENT / 'standins' / 'local_setup.bash')
    try:
        run_colcon([*folders.values()], changed, install, setup_files)
    except SetupError:
        failed = [name for name in changed if not is_built(name)]
        # A package that was not processed because another one failed has no log.
        logs = [log for name in failed
                if (log := ENVIRONMENT / f'log/latest_build/{name}/stdout_stderr.log').is_file()]
        paths = [str(log.relative_to(TOP)) for log in logs] or ['.ros/log/latest_build']
        sentence = (f'colcon could not build {", ".join(failed)}. See its output above and in '
                    f'{", ".join(paths)}.')
        if not set(failed) <= set(own_packages()):
            raise SetupError(sentence) from None
        common.report(f'turtle_brick: {sentence} All other packages are ready.')
    finally:
        for name in filter(is_built, changed):
            common.set_made(install / name, marks[name])


def lock() -> None:
    """Wait for other builds of the workspace, and then lock the workspace for this process."""
    folder = os.open(TOP, os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        common.report('turtle_brick: Another terminal is building this workspace. Waiting ...')
        fcntl.flock(folder, fcntl.LOCK_EX)
    except OSError:
        pass  # Some file systems, such as NFS, cannot lock a folder.


def make_environment(kind: str, content: str) -> int:
    """Create or update the selected environment, and return the exit status."""
    if kind == 'pypi':
        mark = virtual_environment.update_wheels()
        virtual_environment.update_own_requirements()
        prefixes, ros_setup = [str(VENV)], VENV / 'local_setup.bash'
    else:
        prefixes = common.clean_environment().get('AMENT_PREFIX_PATH', '').split(os.pathsep)
        rclpy = find_prefix('rclpy', prefixes)
        mark = common.fingerprint(ENVIRONMENT, sys.prefix, common.VERSION, rclpy)
        ros_setup = None
    own = own_packages()
    required = standins(prefixes, complete=content == 'ros' or bool(own))
    build('standins', {**required, TURTLE_GRAPH.name: TURTLE_GRAPH}, mark, ros_setup)
    if content == 'packages':
        build('install', {**PACKAGES, **own}, mark, ros_setup)
    if kind == 'native':
        try:
            virtual_environment.update_extras()
        except SetupError as error:
            common.report(f'turtle_brick: {error} The packages of the assignment are ready.')
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
        common.report(f'turtle_brick: {error}')
    except KeyboardInterrupt:
        common.report('turtle_brick: The build was interrupted. Source env.bash again.')
    except OSError as error:
        common.report(f'turtle_brick: The workspace cannot be built: {error}.'
                      f'{common.owner_hint(ENVIRONMENT)}')
    return 1


if __name__ == '__main__':
    sys.exit(main())
