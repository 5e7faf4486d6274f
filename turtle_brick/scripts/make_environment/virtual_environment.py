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
"""Install ROS from Python wheels, or what a native machine lacks, in a virtual environment."""

from __future__ import annotations

from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
import importlib.util
from pathlib import Path
import platform
import re
import shutil
import sys
import sysconfig

import common
from common import ENVIRONMENT, SCRIPTS, SetupError, TOP, VENV, VERSION

REQUIREMENTS = SCRIPTS / 'requirements.txt'
OWN_REQUIREMENTS = TOP / '.ros-requirements.txt'
COPIED = (SCRIPTS / 'local_setup.bash', SCRIPTS / 'fastdds.xml')

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

FOREIGN_INCLUDE = re.compile(r'/opt/python/cp\w+-cp\w+/include/python3\.\d+t?')
FOREIGN_PACKAGES = re.compile(r'/opt/python/cp\w+-cp\w+/lib/python3\.\d+t?/site-packages')
"""Paths in the wheels' CMake files that may exist only on the machine that built the wheels."""

NUMPY_HEADERS = re.compile('numpy/_?core/include')
UNQUOTED_TARGET = re.compile(r'(add_custom_target\(\s*ament_cmake_python_\S+(?: ALL)?)')
"""CMake command that fails if the workspace path contains parentheses."""

CMAKE_REPAIRS = {
    # Do not run the interface generators for rclcpp, which the environment does not contain.
    'ament_execute_extensions("rosidl_generate_idl_interfaces")':
        'ament_execute_extensions("rosidl_generate_idl_interfaces" EXCLUDE rosidl_generator_cpp '
        'rosidl_typesupport_cpp rosidl_typesupport_fastrtps_cpp '
        'rosidl_typesupport_introspection_cpp)',
    # Explain why a package that requires an interface in another language fails.
    'set(output_target "${output_target}-NOTFOUND")':
        'message(FATAL_ERROR "The PyPI environment generates interfaces for C and Python, but '
        'this package requires ${typesupport_name}. Nodes in C++ require ROS 2 Jazzy.")',
    # Accept workspace paths with non-ASCII letters.
    'file(STRINGS "${idl_output}" idl_tuples)':
        'file(STRINGS "${idl_output}" idl_tuples ENCODING UTF-8)'}
"""Replacements (values) for commands in the wheels' CMake files (keys)."""


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


def check_disk() -> None:
    """Check that the disk has enough space for the virtual environment."""
    free = shutil.disk_usage(TOP).free / 1e6
    if free < REQUIRED_SPACE:
        raise SetupError(f'The disk that contains {TOP} has {free:.0f} MB of free space, but '
                         f'ROS 2 Jazzy requires {REQUIRED_SPACE} MB. Delete other files first.')


def pip_install(packages: str, *arguments: str, show_output: bool = True) -> None:
    """Install packages in the virtual environment."""
    env = {name: value for name, value in common.clean_environment().items()
           if not name.startswith(('PIP_', 'PYTHON')) or NETWORK_OPTION.search(name)}
    env.update(PYTHONNOUSERSITE='1', PIP_USER='0', PIP_NO_INPUT='1',
               PIP_DISABLE_PIP_VERSION_CHECK='1', _ROS_WHEELS_BOOTSTRAP_COMPLETE='1')
    # Python compiles a module when it is imported. Most modules are never imported.
    common.run(
        [f'{VENV}/bin/python', '-m', 'pip', 'install', '--no-compile', *arguments], env,
        f'downloading and installing {packages}',
        f'pip could not install {packages}.{" See its output above." if show_output else ""} '
        'Check the network connection and the proxy and index of pip, and try again.', show_output)


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
    for command, repaired in CMAKE_REPAIRS.items():
        text = text.replace(command, repaired)
    return UNQUOTED_TARGET.sub(r'\1 VERBATIM', text)


def create(*options: str) -> None:
    """Create the virtual environment without packages."""
    common.run([str(common.BASE_PYTHON), '-I', '-m', 'venv', str(VENV), *options],
               common.clean_environment(),
               f'creating a virtual environment with Python {platform.python_version()}',
               'Python could not create a virtual environment. See its output above.')


def install_wheels() -> None:
    """Create the virtual environment of the PyPI environment and make it a ROS prefix."""
    create()
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


def remove_environment() -> None:
    """Delete the directory `.ros`, starting with the virtual environment."""
    common.remove(VENV)
    shutil.rmtree(ENVIRONMENT, ignore_errors=True)


def update_wheels() -> str:
    """Install ROS again if a requirement has changed, and return the fingerprint."""
    sources = (REQUIREMENTS, *COPIED, Path(__file__))
    mark = common.fingerprint(VENV, common.BASE_PYTHON, *(path.read_bytes() for path in sources))
    if common.is_made(VENV, mark):
        return mark
    check_path()
    check_platform()
    common.check_programs(*common.COMPILERS)
    check_python()
    common.check_owner()
    reason = ('The ROS 2 Jazzy in .ros was installed by an earlier version of these scripts '
              'or with another Python. Installing it again' if VENV.is_dir() else
              'ROS 2 Jazzy is not installed. Installing it once')
    common.report(f'turtle_brick: {reason} from Python wheels into .ros, which takes two to four '
                  'minutes and 600 MB ...')
    try:
        remove_environment()
        check_disk()
        install_wheels()
        common.set_made(VENV, mark)
    except BaseException:
        remove_environment()
        raise
    return mark


def update_own_requirements() -> None:
    """Install the Python packages that the user has listed, if the list has changed."""
    if OWN_REQUIREMENTS.is_file():
        mark = common.fingerprint(OWN_REQUIREMENTS.read_bytes())
        if not common.is_made(VENV, mark, '.made_own'):
            common.check_owner()
            pip_install(OWN_REQUIREMENTS.name, '-r', str(OWN_REQUIREMENTS))
            common.set_made(VENV, mark, '.made_own')


def is_installed(requirement: str) -> bool:
    """Return whether any version of a pinned package is installed for this Python."""
    with suppress(PackageNotFoundError):
        return bool(version(requirement.partition('==')[0]))
    return False


def update_extras() -> None:
    """Install what the folder extras requires and this machine lacks in a virtual environment."""
    _, _, beyond = REQUIREMENTS.read_text().partition(BEYOND_ROS)
    pinned = [line.split()[0] for line in beyond.splitlines()
              if '==' in line and not line.startswith('#')]
    lacking = [requirement for requirement in pinned if not is_installed(requirement)]
    mark = common.fingerprint('native', common.BASE_PYTHON, *lacking)
    if lacking and common.is_made(VENV, mark):
        return
    common.remove(VENV)
    if not lacking:
        return
    check_python()
    common.report(f'turtle_brick: Installing {len(lacking)} Python packages that this machine '
                  'lacks into .ros. They serve the page in the browser, the tools and the tests '
                  '...')
    try:
        create('--system-site-packages')
        pip_install('what this machine lacks', *PINNED, *lacking, show_output=False)
        common.set_made(VENV, mark)
    except BaseException:
        common.remove(VENV)
        raise
