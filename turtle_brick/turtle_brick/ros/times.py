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

"""Convert the times of rclpy timers and ROS messages to nanoseconds."""

from builtin_interfaces.msg import Time as TimeMessage
from rclpy.timer import Timer
from turtle_brick.core.time_steps import NS_PER_SECOND


def due_time(timer: Timer, now: int) -> int:
    """Return the time (ns) at which the current callback of a timer was due."""
    return now - max(timer.timer_period_ns - timer.time_until_next_call(), 0)


def nanoseconds_of(stamp: TimeMessage) -> int:
    """Convert a timestamp to nanoseconds."""
    return stamp.sec * NS_PER_SECOND + stamp.nanosec
