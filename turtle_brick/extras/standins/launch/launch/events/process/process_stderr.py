# SPDX-License-Identifier: Apache-2.0
"""The event ProcessStderr."""

from launch.events.process.process_io import ProcessIO


class ProcessStderr(ProcessIO):
    """A process has written text to stderr."""

    from_stderr = True
