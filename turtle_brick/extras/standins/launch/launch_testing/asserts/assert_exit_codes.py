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
