# SPDX-License-Identifier: Apache-2.0
"""Event handlers."""

from launch.event_handlers.on_execution_complete import OnExecutionComplete
from launch.event_handlers.on_process_exit import OnProcessExit
from launch.event_handlers.on_process_io import OnProcessIO
from launch.event_handlers.on_process_start import OnProcessStart
from launch.event_handlers.on_shutdown import OnShutdown
from launch.missing import missing_name

__all__ = ['OnExecutionComplete', 'OnProcessExit', 'OnProcessIO', 'OnProcessStart', 'OnShutdown']
__getattr__ = missing_name('launch')
