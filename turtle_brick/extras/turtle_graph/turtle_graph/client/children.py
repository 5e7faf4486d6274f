# SPDX-License-Identifier: Apache-2.0
"""
End the processes that a program has started, even if the program is killed.

    subprocess.Popen(command, preexec_fn=end_with_parent)
"""

import ctypes
import signal

PR_SET_PDEATHSIG = 1
"""Number of the operation in Linux's prctl() that sets the signal for the death of the parent."""
PR_SET_CHILD_SUBREAPER = 36
"""Number of the operation that makes a process the parent of all orphans among its descendants."""
prctl = ctypes.CDLL(None).prctl  # A new process must not wait for the loader of libraries.


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
