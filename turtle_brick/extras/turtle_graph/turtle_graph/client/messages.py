# SPDX-License-Identifier: Apache-2.0
"""Convert the messages of geometry_msgs and builtin_interfaces to plain values."""

from typing import Any

from turtle_graph.client.geometry import normalize, Pose, Vector

NS_PER_SECOND = 1_000_000_000
SECONDS_PER_NS = 1e-9


def nanoseconds_of(stamp: Any) -> int:
    """Convert a Time or a Duration to nanoseconds."""
    return stamp.sec * NS_PER_SECOND + stamp.nanosec


def read_vector(message: Any) -> Vector:
    """Convert a Point or a Vector3 to a tuple of its components."""
    return (message.x, message.y, message.z)


def read_pose(position: Any, rotation: Any) -> Pose:
    """Convert a Point or Vector3 (m) and a Quaternion of any length to a pose."""
    quaternion = (rotation.x, rotation.y, rotation.z, rotation.w)
    return Pose(read_vector(position), normalize(quaternion))
