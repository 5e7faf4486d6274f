# SPDX-License-Identifier: Apache-2.0
"""The event ProcessStdout."""

from launch.events.process.process_io import ProcessIO


class ProcessStdout(ProcessIO):
    """A process has written text to stdout."""

    from_stdout = True
