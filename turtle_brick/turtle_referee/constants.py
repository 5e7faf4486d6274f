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
"""Numbers that the assignment and turtlesim set, and the units of time."""

NANOSECONDS = 1_000_000_000
"""Nanoseconds in a second."""

NANO = 1e-9
"""A nanosecond (s)."""

ARENA_SIZE = 499.0 / 45.0
"""Width and height (m) of the arena: turtlesim's window has 500 pixels, 45 of them a meter."""

CENTER = (ARENA_SIZE / 2.0, ARENA_SIZE / 2.0)
"""The center of the arena (m), where turtlesim's first turtle starts."""

RATE = 100.0
"""How often (Hz) the robot publishes and broadcasts: "shall be done at 100 Hz"."""

PHYSICS_RATE = 250.0
"""How often (Hz) the arena steps: "The node should simulate the physics at 250 Hz"."""

LIFETIME = 3.0
"""How long (s) "Unreachable" is to be seen: "a Text marker that lasts for 3 seconds"."""

UNREACHABLE = 'Unreachable'
"""What it says."""
