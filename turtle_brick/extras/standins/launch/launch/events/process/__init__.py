# SPDX-License-Identifier: Apache-2.0
"""Events of processes."""

from launch.events.process.process_exited import ProcessExited
from launch.events.process.process_io import ProcessIO
from launch.events.process.process_started import ProcessStarted
from launch.events.process.process_stderr import ProcessStderr
from launch.events.process.process_stdout import ProcessStdout
from launch.events.process.running_process_event import RunningProcessEvent
from launch.missing import missing_name

__all__ = ['ProcessExited', 'ProcessIO', 'ProcessStarted', 'ProcessStderr', 'ProcessStdout',
           'RunningProcessEvent']
__getattr__ = missing_name('launch')
