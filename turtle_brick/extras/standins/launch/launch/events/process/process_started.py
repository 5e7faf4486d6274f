# SPDX-License-Identifier: Apache-2.0
"""The event ProcessStarted."""

from launch.events.process.running_process_event import RunningProcessEvent


class ProcessStarted(RunningProcessEvent):
    """A process has started."""
