# SPDX-License-Identifier: Apache-2.0
"""The stand-in for the Python module of tf2_geometry_msgs 0.36.4: transforms of messages."""

from math import hypot

from geometry_msgs.msg import (Point, Point32, PointStamped, Polygon, PolygonStamped, Pose,
                               PoseStamped, PoseWithCovarianceStamped, Quaternion,
                               TransformStamped, Vector3, Vector3Stamped)
import numpy as np
from tf2_ros import TransformRegistration
from tf2_ros.buffer_core import canonical, compose, IDENTITY, Transform


def rotation_of(transform: TransformStamped) -> Transform:
    """Return the rotation part of a transform. A zero quaternion is treated as no rotation."""
    q = transform.transform.rotation
    length = hypot(q.x, q.y, q.z, q.w)
    if not length:
        return IDENTITY
    return (0.0, 0.0, 0.0, q.x / length, q.y / length, q.z / length, q.w / length)


def rotate(transform: TransformStamped, vector: Point | Point32 | Vector3) -> list[float]:
    """Return a vector in the target frame of a transform."""
    inner = (vector.x, vector.y, vector.z, 0.0, 0.0, 0.0, 1.0)
    return list(compose(rotation_of(transform), inner)[:3])


def move(transform: TransformStamped, point: Point | Point32) -> dict[str, float]:
    """Return the coordinates of a point in the target frame of a transform."""
    offset = transform.transform.translation
    x, y, z = rotate(transform, point)
    return {'x': x + offset.x, 'y': y + offset.y, 'z': z + offset.z}


def do_transform_point(point: PointStamped, transform: TransformStamped) -> PointStamped:
    return PointStamped(header=transform.header, point=Point(**move(transform, point.point)))


def do_transform_vector3(vector3: Vector3Stamped, transform: TransformStamped) -> Vector3Stamped:
    x, y, z = rotate(transform, vector3.vector)
    return Vector3Stamped(header=transform.header, vector=Vector3(x=x, y=y, z=z))


def do_transform_pose(pose: Pose, transform: TransformStamped) -> Pose:
    q = pose.orientation
    inner = (0.0, 0.0, 0.0, q.x, q.y, q.z, q.w) if any((q.x, q.y, q.z, q.w)) else IDENTITY
    x, y, z, w = canonical(*compose(rotation_of(transform), inner)[3:])
    sign = -1.0 if w < 0.0 else 1.0
    return Pose(position=Point(**move(transform, pose.position)),
                orientation=Quaternion(x=sign * x, y=sign * y, z=sign * z, w=sign * w))


def do_transform_pose_stamped(pose: PoseStamped, transform: TransformStamped) -> PoseStamped:
    return PoseStamped(header=transform.header, pose=do_transform_pose(pose.pose, transform))


def transform_covariance(cov_in: np.ndarray, transform: TransformStamped) -> np.ndarray:
    """Return the covariance (6 x 6, row by row) of a pose in the target frame of a transform."""
    axes = (Vector3(x=1.0), Vector3(y=1.0), Vector3(z=1.0))
    rotation = np.kron(np.eye(2), np.transpose([rotate(transform, axis) for axis in axes]))
    return (rotation @ np.reshape(cov_in, (6, 6)) @ rotation.T).flatten()


def do_transform_pose_with_covariance_stamped(
        pose: PoseWithCovarianceStamped, transform: TransformStamped) -> PoseWithCovarianceStamped:
    result = PoseWithCovarianceStamped(header=transform.header)
    result.pose.pose = do_transform_pose(pose.pose.pose, transform)
    result.pose.covariance = transform_covariance(pose.pose.covariance, transform)
    return result


def do_transform_polygon_stamped(
        polygon: PolygonStamped, transform: TransformStamped) -> PolygonStamped:
    points = [Point32(**move(transform, point)) for point in polygon.polygon.points]
    return PolygonStamped(header=transform.header, polygon=Polygon(points=points))


for message_type, function in (
        (PointStamped, do_transform_point), (Vector3Stamped, do_transform_vector3),
        (PoseStamped, do_transform_pose_stamped), (PolygonStamped, do_transform_polygon_stamped),
        (PoseWithCovarianceStamped, do_transform_pose_with_covariance_stamped)):
    TransformRegistration().add(message_type, function)
