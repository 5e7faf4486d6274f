# SPDX-License-Identifier: Apache-2.0
"""Assertions about processes and their output."""

from launch.missing import missing_name
from launch_testing.asserts.assert_exit_codes import (
    assertExitCodes, EXIT_OK, EXIT_SIGINT, EXIT_SIGKILL, EXIT_SIGQUIT, EXIT_SIGSEGV)
from launch_testing.asserts.assert_output import (
    assertInStderr, assertInStdout, assertInStream)

__all__ = ['assertExitCodes', 'assertInStderr', 'assertInStdout', 'assertInStream', 'EXIT_OK',
           'EXIT_SIGINT', 'EXIT_SIGKILL', 'EXIT_SIGQUIT', 'EXIT_SIGSEGV']
__getattr__ = missing_name('launch_testing')
