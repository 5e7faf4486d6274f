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
"""What every buffer of transforms offers."""


from builtin_interfaces.msg import Time as TimeMsg
from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.time import Time


class NotImplementedException(Exception):
    """A buffer lacks a method of BufferInterface."""

    def __init__(self) -> None:
        """Say so."""
        self.errstr = 'CanTransform or LookupTransform not implemented'
        super().__init__(self.errstr)


class BufferInterface:
    """The methods that a buffer must have; Buffer documents them."""

    def lookup_transform(self, target_frame: str, source_frame: str, time: Time | TimeMsg,
                         timeout: Duration = Duration()) -> TransformStamped:
        """Get a transform."""
        raise NotImplementedException()

    def lookup_transform_full(self, target_frame: str, target_time: Time | TimeMsg,
                              source_frame: str, source_time: Time | TimeMsg,
                              fixed_frame: str, timeout: Duration = Duration()
                              ) -> TransformStamped:
        """Get a transform between two times."""
        raise NotImplementedException()

    def can_transform(self, target_frame: str, source_frame: str, time: Time | TimeMsg,
                      timeout: Duration = Duration()) -> bool:
        """Tell whether there is a transform."""
        raise NotImplementedException()

    def can_transform_full(self, target_frame: str, target_time: Time | TimeMsg,
                           source_frame: str, source_time: Time | TimeMsg,
                           fixed_frame: str, timeout: Duration = Duration()) -> bool:
        """Tell whether there is a transform between two times."""
        raise NotImplementedException()
