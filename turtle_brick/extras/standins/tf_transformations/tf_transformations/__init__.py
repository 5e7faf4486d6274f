# SPDX-License-Identifier: Apache-2.0
"""
Conversions between representations of rotations, based on transforms3d.

Quaternions have the order x, y, z, w. Matrices are homogeneous 4 x 4 matrices. Angles are in
radians, and `axes` is one of the 24 Euler angle conventions of transforms3d (default: rotations
about the static x, y and z axes).
"""

from collections.abc import Sequence
from functools import reduce
from typing import Any, NoReturn

import numpy
from transforms3d import affines, euler, quaternions


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


def concatenate_matrices(*matrices: Any) -> numpy.ndarray:
    return reduce(numpy.dot, matrices, numpy.identity(4))
