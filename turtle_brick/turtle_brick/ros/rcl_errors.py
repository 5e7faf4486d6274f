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

"""
Errors of rcl, the C library under rclpy.

rclpy raises them but gives two of them no public name: this is the one module that imports them
from its private one.
"""

import re

from rclpy._rclpy_pybind11 import RCLError, UnknownROSArgsError
from rclpy.exceptions import InvalidHandle, NotInitializedException

ARGUMENT_ERRORS = (RCLError, UnknownROSArgsError)
"""What `rclpy.init` raises where it can't use the command line or a parameter file in it."""

SHUTDOWN_ERRORS = (RCLError, InvalidHandle, NotInitializedException)
"""What any call of rclpy may raise after the context was shut down."""


def sentence(error: Exception) -> str:
    """Return what an error of ARGUMENT_ERRORS says, without its place in the source of rcl."""
    if isinstance(error, UnknownROSArgsError):
        return f'unknown ROS arguments {error}'
    return re.sub(r', at [^,]*:\d+', '', str(error))
