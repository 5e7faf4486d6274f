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
"""The numbers in the assignment, and the tolerances of the referee: m, rad, s unless noted."""

RATE = 100.0
"""Hz: "All publishing and broadcasting shall be done at 100 Hz"."""
PHYSICS_RATE = 250.0
"""Hz: "The node should simulate the physics at 250 Hz"."""
LIFETIME = 3.0
"""Duration of the text: "a Text marker that lasts for 3 seconds"."""
LIFETIME_TOLERANCE = 0.3
"""Tolerance of that duration."""
RATE_TOLERANCE = 0.02
"""Relative tolerance of a rate or an acceleration."""
EXACT = 1e-3
"""Tolerance of two numbers that should be equal."""
NEAR = 0.01
"""Tolerance of two positions that should be equal."""
PRECISION = 0.05
"""Distance of the robot from its goal, from the line to the goal, and beyond the goal."""
SAME_ANGLE = 0.02
"""Tolerance of two angles that should be equal."""
MAX_SLIP = 0.02
"""Fraction of a drive, in addition to 5 mm, by which the rolled distance may differ."""
VELOCITY_TOLERANCE = 0.1
"""Fraction by which the integrated velocity of the wheel may differ from its rotation."""
MAX_MISALIGNMENT = 5.0
"""Angle (degrees) between the motion and the rolling direction of the wheel."""
WALL_TOLERANCE = 0.3
"""Distance from the center of a wall to the edge of turtlesim's arena."""
MARKER_PERIOD = 2.0
"""Longest period of a repeated marker that is not latched."""
FALL_DELAY = 0.5
"""Longest time from the response of the drop service to the fall."""
MAX_LAG = 0.05
"""Delay of an object on the platform, because another node publishes the platform's pose."""
FALL_DEVIATION = 0.02
"""Distance of a falling brick from its parabola."""
SLIDE_DEVIATION = 0.04
"""Distance of a sliding brick from its computed position."""
EARLY_END, LATE_END = 0.02, 0.08
"""Overlap with the platform, and distance from it, at the end of a slide."""
CENTER_DISTANCE = 0.1
"""Distance from the arena center at which a brick is tipped off."""
REACTION_TIME = 0.3
"""Time from the release of a brick to the motion of the robot."""
