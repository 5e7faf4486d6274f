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
The executor of every node: rclpy's EventsExecutor.

It takes a third of the processor time of the SingleThreadedExecutor, because it builds no wait set
for each callback. It is in rclpy since 7.1.4 and still called experimental; in an older rclpy, or
to do without it, SingleThreadedExecutor serves as well.
"""

from rclpy.context import Context
from rclpy.executors import Executor, SingleThreadedExecutor


def make_executor(context: Context | None = None) -> Executor:
    """
    Return an EventsExecutor where rclpy has one, else a SingleThreadedExecutor.

    :param context: the context of its nodes; the default one if None
    """
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor(context=context)
    return EventsExecutor(context=context)
