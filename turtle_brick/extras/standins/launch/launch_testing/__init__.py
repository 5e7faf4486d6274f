# Copyright 2026 the turtle_brick developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
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
