# SPDX-License-Identifier: Apache-2.0
"""Compare the stand-in for tf2_geometry_msgs with recordings of the real package."""

import json
from pathlib import Path

from geometry_msgs.msg import (Point32, PointStamped, PolygonStamped, Pose, PoseStamped,
                               PoseWithCovarianceStamped, TransformStamped, TwistStamped,
                               Vector3Stamped)
import pytest
import tf2_geometry_msgs
from tf2_ros import Buffer, LookupException, TypeException

CALLS = json.loads((Path(__file__).parent / 'data/tf2/tf2_geometry_msgs.json').read_text())
MESSAGES = {'point': PointStamped, 'vector3': Vector3Stamped, 'pose': Pose,
            'pose_stamped': PoseStamped, 'polygon_stamped': PolygonStamped,
            'pose_with_covariance_stamped': PoseWithCovarianceStamped}


def fields(message):
    return [name for name in message.get_fields_and_field_types() if name != 'header']


def fill(message, numbers):
    """Set all numbers in a message to those of an iterator, and return the message."""
    if isinstance(message, PolygonStamped):
        message.polygon.points = [Point32(), Point32()]
    for name in fields(message):
        value = getattr(message, name)
        if isinstance(value, float):
            setattr(message, name, next(numbers))
        elif name == 'covariance':
            setattr(message, name, [next(numbers) for _ in value])
        else:
            for each in value if isinstance(value, list) else [value]:
                fill(each, numbers)
    return message


def flat(value):
    """Return all numbers in a message."""
    if isinstance(value, float):
        return [value]
    parts = [getattr(value, name) for name in fields(value)] if hasattr(value, 'SLOT_TYPES') else (
        value)
    return [number for part in parts for number in flat(part)]


def transform(numbers):
    message = TransformStamped(child_frame_id='source')
    message.header.frame_id, message.header.stamp.sec = 'target', 5
    fill(message.transform, iter(numbers))
    return message


@pytest.mark.parametrize('call', CALLS, ids=lambda call: call['function'])
def test_messages_are_transformed_as_by_the_real_package(call):
    function = getattr(tf2_geometry_msgs, call['function'])
    message = fill(MESSAGES[call['function'].removeprefix('do_transform_')](),
                   iter(call['message']))
    result = function(message, transform(call['transform']))
    assert flat(result) == pytest.approx(call['result'], abs=1e-6)
    assert isinstance(result, Pose) or result.header.frame_id == 'target'


def test_buffer_transforms_messages():
    buffer = Buffer()
    buffer.set_transform_static(transform([1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 0.0]), '')
    point = PointStamped()
    point.header.frame_id, point.point.x, point.header.stamp.sec = 'source', 4.0, 7
    result = buffer.transform(point, 'target')
    assert flat(result) == pytest.approx([-3.0, 2.0, 3.0])
    assert result.header.stamp.sec == 7 and result.header.frame_id == 'target'
    with pytest.raises(LookupException, match='"nowhere"'):
        buffer.transform(point, 'nowhere')
    with pytest.raises(TypeException, match='TwistStamped.* is not loaded or supported'):
        buffer.transform(TwistStamped(), 'target')
