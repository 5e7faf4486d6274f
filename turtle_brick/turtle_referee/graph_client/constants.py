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
"""Numbers that the assignment and turtlesim set, how strict the referee is, and units of time."""

NS_PER_SECOND = 1_000_000_000  # in a second
SECONDS_PER_NS = 1e-9  # a nanosecond (s)
ARENA_SIZE = 499.0 / 45.0  # its sides (m): turtlesim's window has 500 pixels, 45 of them 1 m
CENTER = (ARENA_SIZE / 2.0, ARENA_SIZE / 2.0)  # where turtlesim's first turtle starts
RATE = 100.0  # Hz: "All publishing and broadcasting shall be done at 100 Hz"
PHYSICS_RATE = 250.0  # Hz: "The node should simulate the physics at 250 Hz"
LIFETIME = 3.0  # s: "a Text marker that lasts for 3 seconds"
UNREACHABLE = 'Unreachable'  # what it says

# How far what is measured may be from what is demanded: lengths in m, angles in rad, times in s.
RATE_TOLERANCE = 0.02  # the part by which a rate, or an acceleration, may be off
EXACT = 1e-3  # between two numbers that are the same
NEAR = 0.01  # between two statements about one place
PRECISION = 0.05  # from the robot to its goal, beside its line, and beyond its goal
ALIKE = 0.02  # an angle
SLIP = 0.02  # the part of its way, and 5 mm, by which a wheel may roll too much or too little
ROUGHLY = 0.1  # the part by which what rolled may differ from the sum of the wheel's velocity
CROOKED = 5.0  # from the motion to where the wheel rolls, in degrees
WALL_TOLERANCE = 0.3  # from the middle of a wall to the rim of turtlesim's arena
PAUSE = 2.0  # until a marker is repeated that is not latched
STILL = 1e-3  # what does not move
SOON = 0.5  # from the answer until a brick begins to fall
LAG = 0.05  # what moves with the platform is behind it: another node tells where that is
COURSE = 0.02  # from a falling brick to its parabola
SLIDE = 0.04  # from a sliding brick to where it is due
EARLY, OVERDUE = 0.02, 0.08  # before and after it has cleared the platform, the end of a slide
AT_CENTER = 0.1  # from the arena's center to where a brick is tipped off
SHOWN = 0.3  # longer or shorter than LIFETIME, a text
REACTION = 0.3  # from the release of a brick to the robot's motion
