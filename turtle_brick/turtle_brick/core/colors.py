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

"""The colors of walls and brick, for the markers and for the legend. Pure, without ROS."""

from turtle_brick.physics import Phase

Color = tuple[float, float, float, float]
"""Red, green, blue and opacity, each in [0, 1]."""

WALL_COLOR: Color = (0.55, 0.62, 0.72, 1.0)

BRICK_COLORS: dict[Phase, Color] = {
    Phase.HOVERING: (0.80, 0.25, 0.15, 1.0),
    Phase.FALLING: (1.00, 0.50, 0.00, 1.0),
    Phase.RIDING: (0.20, 0.70, 0.25, 1.0),
    Phase.FLOATING: (0.65, 0.35, 0.85, 1.0),
    Phase.GROUNDED: (0.45, 0.30, 0.25, 1.0),
}
"""The color tells what the brick does."""
