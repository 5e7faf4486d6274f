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
"""Time units, and constants of turtlesim and the assignment."""

NS_PER_SECOND = 1_000_000_000
"""Nanoseconds in a second."""

SECONDS_PER_NS = 1e-9
"""Seconds in a nanosecond."""

ARENA_SIZE = 499.0 / 45.0
"""Side length (m) of the arena. The turtlesim window has 500 pixels, with 45 pixels per meter."""

CENTER = (ARENA_SIZE / 2.0, ARENA_SIZE / 2.0)
"""Initial position (m) of the first turtle in turtlesim."""

UNREACHABLE = 'Unreachable'
"""Marker text for a brick that cannot be caught."""

STILL = 1e-3
"""Maximum displacement (m) of a brick at rest."""
