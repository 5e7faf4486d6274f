# SPDX-License-Identifier: Apache-2.0
"""Functions for tests."""

from launch.missing import missing_name
from launch_testing.util.proc_lookup import NoMatchingProcessException, resolveProcesses

__all__ = ['NoMatchingProcessException', 'resolveProcesses']
__getattr__ = missing_name('launch_testing')
