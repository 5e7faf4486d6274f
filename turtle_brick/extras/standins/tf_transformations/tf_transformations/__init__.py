# SPDX-License-Identifier: Apache-2.0
"""
Conversions between representations of rotations, based on transforms3d.

Quaternions have the order x, y, z, w. Matrices are homogeneous 4 x 4 matrices. Angles are in
radians, and `axes` is one of the 24 Euler angle conventions of transforms3d (default: rotations
about the static x, y and z axes).
"""

from collections.abc import Sequence
from functools import reduce
from math import acos, pi, sin
from typing import Any, NoReturn

import numpy
from transforms3d import affines, axangles, euler, quaternions

SMALL = 4.0 * numpy.finfo(float).eps
"""Greatest difference between the cosines of equal rotations."""


def __getattr__(name: str) -> NoReturn:
    raise (AttributeError if name.startswith('__') else ImportError)(
        f'{name} is not in the stand-in for tf_transformations: check its spelling, use another '
        'function, or install the real ROS 2 Jazzy')


def _w_first(quaternion: Sequence[float]) -> tuple:
    x, y, z, w = quaternion
    return w, x, y, z


def _w_last(quaternion: Sequence[float]) -> tuple:
    w, x, y, z = quaternion
    return x, y, z, w


def _homogeneous(rotation: Any) -> numpy.ndarray:
    return affines.compose(numpy.zeros(3), rotation, numpy.ones(3))


def quaternion_from_euler(ai: float, aj: float, ak: float, axes: str = 'sxyz') -> tuple:
    return _w_last(euler.euler2quat(ai, aj, ak, axes))


def quaternion_from_matrix(matrix: Any) -> tuple:
    return _w_last(quaternions.mat2quat(numpy.asarray(matrix)[:3, :3]))


def quaternion_about_axis(angle: float, axis: Sequence[float]) -> tuple:
    return _w_last(quaternions.axangle2quat(axis, angle))


def quaternion_multiply(quaternion1: Sequence[float], quaternion0: Sequence[float]) -> tuple:
    """Return quaternion1 * quaternion0, which applies the rotation quaternion0 first."""
    return _w_last(quaternions.qmult(_w_first(quaternion1), _w_first(quaternion0)))


def quaternion_conjugate(quaternion: Sequence[float]) -> numpy.ndarray:
    return numpy.multiply(quaternion, (-1.0, -1.0, -1.0, 1.0))


def quaternion_inverse(quaternion: Sequence[float]) -> numpy.ndarray:
    return quaternion_conjugate(quaternion) / numpy.dot(quaternion, quaternion)


def quaternion_slerp(quat0: Sequence[float], quat1: Sequence[float], fraction: float,
                     spin: int = 0, shortestpath: bool = True) -> numpy.ndarray:
    """
    Return the spherical linear interpolation between two quaternions.

    :param fraction: 0 for the first quaternion, 1 for the second one
    :param spin: number of additional half turns
    :param shortestpath: whether the result may pass through the negative of the second quaternion
    """
    first, second = (numpy.divide(one, numpy.linalg.norm(one)) for one in (quat0, quat1))
    if fraction in (0.0, 1.0):
        return second if fraction else first
    cosine = numpy.dot(first, second)
    if 1.0 - abs(cosine) < SMALL:
        return first
    if shortestpath and cosine < 0.0:
        cosine, second = -cosine, -second
    angle = acos(cosine) + spin * pi
    return (sin((1.0 - fraction) * angle) * first + sin(fraction * angle) * second) / sin(angle)


def quaternion_matrix(quaternion: Sequence[float]) -> numpy.ndarray:
    return _homogeneous(quaternions.quat2mat(_w_first(quaternion)))


def euler_from_quaternion(quaternion: Sequence[float], axes: str = 'sxyz') -> tuple:
    return euler.quat2euler(_w_first(quaternion), axes)


def euler_from_matrix(matrix: Any, axes: str = 'sxyz') -> tuple:
    return euler.mat2euler(numpy.asarray(matrix)[:3, :3], axes)


def euler_matrix(ai: float, aj: float, ak: float, axes: str = 'sxyz') -> numpy.ndarray:
    return _homogeneous(euler.euler2mat(ai, aj, ak, axes))


def translation_matrix(direction: Sequence[float]) -> numpy.ndarray:
    return affines.compose(direction, numpy.identity(3), numpy.ones(3))


def translation_from_matrix(matrix: Any) -> numpy.ndarray:
    return numpy.array(matrix)[:3, 3]


def identity_matrix() -> numpy.ndarray:
    return numpy.identity(4)


def inverse_matrix(matrix: Any) -> numpy.ndarray:
    return numpy.linalg.inv(matrix)


def rotation_matrix(angle: float, direction: Sequence[float],
                    point: Sequence[float] | None = None) -> numpy.ndarray:
    """Return the rotation about an axis through a point (default: the origin)."""
    return axangles.axangle2aff(direction, angle, point=point)


def concatenate_matrices(*matrices: Any) -> numpy.ndarray:
    return reduce(numpy.dot, matrices, numpy.identity(4))
