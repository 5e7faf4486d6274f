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
"""Numbers in the assignment and tolerances of the referee (m, rad, s unless noted otherwise)."""

RATE = 100.0
"""Rate (Hz) of all topics and frames except the brick."""
PHYSICS_RATE = 250.0
"""Rate (Hz) of the physics and of the frame of the brick."""
LIFETIME = 3.0
"""Duration of the text "Unreachable"."""
LIFETIME_TOLERANCE = 0.3
"""Tolerance of the duration of the text."""
RATE_TOLERANCE = 0.02
"""Relative tolerance of a rate or an acceleration."""
EXACT = 1e-3
"""Tolerance of two numbers that should be equal."""
NEAR = 0.01
"""Tolerance of two positions that should be equal."""
PRECISION = 0.05
"""Largest distance of the robot from its goal, from the line to the goal, and beyond the goal."""
SAME_ANGLE = 0.02
"""Tolerance of two angles that should be equal."""
MAX_SLIP = 0.02
"""Largest difference between rolled and driven distance, as a fraction of the drive."""
VELOCITY_TOLERANCE = 0.1
"""Largest difference between the wheel's integrated velocity and rotation, as a fraction."""
MAX_MISALIGNMENT = 5.0
"""Largest angle (degrees) between the motion and the rolling direction of the wheel."""
WALL_TOLERANCE = 0.3
"""Largest distance from the center of a wall to the edge of the arena."""
MARKER_PERIOD = 2.0
"""Longest period of a repeated marker that is not latched."""
FALL_DELAY = 0.5
"""Longest time from the response of the drop service to the fall."""
MAX_LAG = 0.05
"""Largest delay between the transforms of the platform and of the brick on the platform."""
FALL_DEVIATION = 0.02
"""Largest distance of a falling brick from its parabola."""
SLIDE_DEVIATION = 0.04
"""Largest distance of a sliding brick from its computed position."""
EARLY_END, LATE_END = 0.02, 0.08
"""Largest overlap of brick and platform, and their largest distance, at the end of a slide."""
CENTER_DISTANCE = 0.1
"""Largest distance from the arena center at which a brick is tipped off."""
REACTION_TIME = 0.3
"""Time after the release of a brick in which every robot should be able to start."""
