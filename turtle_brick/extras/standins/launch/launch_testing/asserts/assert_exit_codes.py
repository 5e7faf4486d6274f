# SPDX-License-Identifier: Apache-2.0
"""The assertion assertExitCodes."""

from __future__ import annotations

from collections.abc import Collection

from launch_testing.proc_info_handler import ProcInfoHandler
from launch_testing.util.proc_lookup import Process, resolveProcesses

EXIT_OK = 0
EXIT_SIGINT = 130
EXIT_SIGQUIT = 131
EXIT_SIGKILL = 137
EXIT_SIGSEGV = 139


def assertExitCodes(proc_info: ProcInfoHandler, allowable_exit_codes: Collection[int] = (EXIT_OK,),
                    process: Process | None = None) -> None:
    """Assert that processes (by default, all) have ended with one of the given exit codes."""
    for action in resolveProcesses(proc_info, process=process):
        code = proc_info.exit_code(action)
        assert code in allowable_exit_codes, f'Proc {action.name} exited with code {code}'
