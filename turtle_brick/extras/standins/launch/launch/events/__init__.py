# SPDX-License-Identifier: Apache-2.0
"""Events that event handlers react to."""

from launch.events import process
from launch.events.execution_complete import ExecutionComplete
from launch.events.shutdown import Shutdown
from launch.missing import missing_name

__all__ = ['ExecutionComplete', 'process', 'Shutdown']
__getattr__ = missing_name('launch')
