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
"""Paths, commands, fingerprints and errors for all steps that create the directory `.ros`."""

from __future__ import annotations

from contextlib import suppress
import hashlib
import os
from pathlib import Path
import pwd
import shlex
import shutil
import signal
import subprocess
import sys
import time

SCRIPTS = Path(__file__).resolve().parents[1]
TOP = SCRIPTS.parents[1]
EXTRAS = TOP / 'turtle_brick' / 'extras'
ENVIRONMENT = TOP / '.ros'
VENV = ENVIRONMENT / 'venv'

VERSION = f'{sys.version_info.major}.{sys.version_info.minor}'
BASE_PYTHON = Path(sys.base_prefix, 'bin', f'python{VERSION}')
"""Python interpreter that creates the virtual environment."""

COMPILERS = (('C compiler', ('cc', 'gcc', 'clang'), 'build-essential'),
             ('C++ compiler', ('c++', 'g++', 'clang++'), 'build-essential'))
COLCON = (('build tool', ('colcon',), 'python3-colcon-common-extensions'),)
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


def is_made(folder: Path, mark: str, name: str = '.made') -> bool:
    """Return whether a folder was completed with this fingerprint."""
    stamp = folder / name
    return stamp.is_file() and stamp.read_text() == mark


def set_made(folder: Path, mark: str, name: str = '.made') -> None:
    """Record in a folder that it was completed with this fingerprint."""
    (folder / name).write_text(mark)


def remove(folder: Path) -> None:
    """Delete a folder, starting with its fingerprint."""
    (folder / '.made').unlink(missing_ok=True)
    shutil.rmtree(folder, ignore_errors=True)


def check_programs(*required: tuple[str, tuple[str, ...], str]) -> None:
    """Check that the required programs are on the PATH."""
    for kind, names, package in required:
        if not any(map(shutil.which, names)):
            raise SetupError(f'No {kind} found: the PATH does not contain {" or ".join(names)}. '
                             f'Install one, for example with "sudo apt install {package}".')


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
