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

"""What can be asked for on the page. Pure: what carries it out knows nothing of the page."""

from typing import NamedTuple


class PlaceAt(NamedTuple):
    """Place the brick at a point of the world (m)."""

    x: float
    y: float
    z: float


class Drop(NamedTuple):
    """Drop the brick."""


class DropAtRandom(NamedTuple):
    """Place the brick at random, and drop it."""


class SetTilt(NamedTuple):
    """Tilt the platform by an angle (rad)."""

    angle: float


class SendTo(NamedTuple):
    """Send the robot to a point of the ground (m in the world)."""

    x: float
    y: float


Command = PlaceAt | Drop | DropAtRandom | SetTilt | SendTo
