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
"""Numbers in the assignment and the referee's tolerances (m, rad or s unless noted otherwise)."""

RATE = 100.0
"""Rate (Hz) of all topics and frames except the brick."""
PHYSICS_RATE = 250.0
"""Rate (Hz) of the physics and the brick frame."""
LIFETIME = 3.0
"""Lifetime of the text "Unreachable"."""
LIFETIME_TOLERANCE = 0.3
"""Tolerance for LIFETIME."""
RATE_TOLERANCE = 0.02
"""Relative tolerance for rates and accelerations."""
EXACT = 1e-3
"""Tolerance for two equal numbers."""
NEAR = 0.01
"""Tolerance for two equal positions."""
PRECISION = 0.05
"""Tolerance for the distance to a goal, the deviation from a straight line and the overshoot."""
SAME_ANGLE = 0.02
"""Tolerance for two equal angles."""
MAX_SLIP = 0.02
"""Largest relative difference between the rolled distance and the driven distance."""
VELOCITY_TOLERANCE = 0.1
"""Largest relative difference between the wheel's integrated velocity and its rotation."""
MAX_MISALIGNMENT = 5.0
"""Largest angle (degrees) between the robot's motion and the wheel's rolling direction."""
WALL_TOLERANCE = 0.3
"""Largest distance between a wall's center and the arena's edge."""
MARKER_PERIOD = 2.0
"""Longest period of a repeated marker that is not latched."""
FALL_DELAY = 0.5
"""Longest delay between the response of the drop service and the fall."""
MAX_LAG = 0.05
"""Largest delay between the transforms of the platform and a brick on the platform."""
FALL_DEVIATION = 0.02
"""Largest distance between a falling brick and its parabola."""
SLIDE_DEVIATION = 0.04
"""Largest distance between a sliding brick and its computed position."""
EARLY_END, LATE_END = 0.02, 0.08
"""Largest overlap and largest gap between the brick and the platform at the end of a slide."""
CENTER_DISTANCE = 0.1
"""Largest distance from the arena center at which a brick is tipped off."""
REACTION_TIME = 0.3
"""Reaction time that is sufficient for every robot after the release of a brick."""
