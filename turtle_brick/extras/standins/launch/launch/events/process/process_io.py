# SPDX-License-Identifier: Apache-2.0
"""The event ProcessIO."""

from __future__ import annotations

from typing import Any

from launch.events.process.running_process_event import RunningProcessEvent


class ProcessIO(RunningProcessEvent):
    """A process has written text."""

    from_stdin = False
    from_stdout = False
    from_stderr = False

    def __init__(self, *, text: bytes, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.text = text
