# SPDX-License-Identifier: Apache-2.0
"""The stand-in for launch_testing 3.4.11: a pytest plugin and the `launch_test` command."""

from launch.missing import missing_name
from launch_testing import actions
from launch_testing import asserts
from launch_testing import markers
from launch_testing import util
from launch_testing.decorator import post_shutdown_test
from launch_testing.io_handler import ActiveIoHandler, IoHandler
from launch_testing.proc_info_handler import ActiveProcInfoHandler, ProcInfoHandler

__all__ = ['actions', 'ActiveIoHandler', 'ActiveProcInfoHandler', 'asserts', 'IoHandler',
           'markers', 'post_shutdown_test', 'ProcInfoHandler', 'util']
__getattr__ = missing_name('launch_testing')
