# SPDX-License-Identifier: Apache-2.0
"""
Start Python programs with this Python, and end them with their parent, even if it is killed.

    subprocess.Popen([*with_this_python(program), *arguments], preexec_fn=end_with_parent)
"""

import ctypes
import os
import re
import signal
import sys

PR_SET_PDEATHSIG = 1
"""Number of the operation in Linux's prctl() that sets the signal for the death of the parent."""
PR_SET_CHILD_SUBREAPER = 36
"""Number of the operation that makes a process the parent of all orphans among its descendants."""
prctl = ctypes.CDLL(None).prctl  # A new process must not wait for the loader of libraries.


PYTHON_SCRIPT = re.compile(r'#! */\S+[/ ]python[\d.]*( .*)?\n')
"""Pattern for the first line of an executable Python script, with a group for its options."""


def with_this_python(program: str) -> list[str]:
    """
    Return the command that starts a program. A Python script runs with the current Python.

    The first line of a script may name a Python without ROS, for example /usr/bin/python3 in an
    environment that was made without ROS.
    """
    if os.path.isabs(program) and os.access(program, os.R_OK | os.X_OK):
        with open(program, encoding='latin-1', newline='\n') as file:
            match = PYTHON_SCRIPT.match(file.readline())
        if match:
            return [sys.executable, *(match[1] or '').split(), program]
    return [program]


def end_with_parent() -> None:
    """
    Make this new process receive SIGINT when its parent ends, even after SIGKILL.

    Linux sends the signal when the thread ends that started the process, so start processes only
    in a thread that lives as long as the program.
    """
    # After SIGTERM, the real `ros2 launch` would leave its nodes running.
    prctl(PR_SET_PDEATHSIG, signal.SIGINT)


def adopt_orphans() -> None:
    """Make this process the parent of its descendants whose own parents end."""
    prctl(PR_SET_CHILD_SUBREAPER, 1)
