# SPDX-License-Identifier: Apache-2.0
"""Compare the tf2_ros stand-in and interface type hashes with recordings of the real packages."""

import json
from pathlib import Path
from threading import Timer
from time import monotonic

from ament_index_python.packages import get_package_share_path
from builtin_interfaces.msg import Duration as DurationMessage
from live_graph import LATCHED, TIMEOUT
import pytest
import rclpy
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rclpy.time import Time
from tf2_msgs.msg import TFMessage
import tf2_ros
from tf2_ros import (Buffer, LookupException, StaticTransformBroadcaster, TransformBroadcaster,
                     TransformListener)
from turtle_brick.core.geometry import IDENTITY, Pose
from turtle_brick.core.time_steps import NS_PER_SECOND
from turtle_brick.ros.tf import transform_message

DATA = Path(__file__).parent / 'data' / 'tf2'
RECORDED = json.loads((DATA / 'tf2_recorded.json').read_text())
RANDOM = json.loads((DATA / 'tf2_random.json').read_text())
"""Recordings of random tf2 calls, including duplicate timestamps, old data and loops."""

REAL_HASHES = json.loads((DATA / 'type_hashes.json').read_text())
"""Type hashes of the real tf2_msgs and turtlesim interfaces."""

CACHE_TIME = {'single_and_cache_expiry': 2.0,
              **{script['name']: script['cache_time'] for script in RANDOM}}
"""Cache time (s) of each recording that does not use the default of 10 s."""

LATEST = Time()


def stamped(parent, child, time, translation=(0.0, 0.0, 0.0), rotation=IDENTITY):
    return transform_message(
        parent, child, Pose(translation, rotation), Time(nanoseconds=time).to_msg())


def numbers(message):
    t, r = message.transform.translation, message.transform.rotation
    return [t.x, t.y, t.z, r.x, r.y, r.z, r.w]


def seconds(time):
    return Time(nanoseconds=round(time * NS_PER_SECOND))


@pytest.mark.parametrize('script', RECORDED + RANDOM, ids=lambda script: script['name'])
def test_calls_return_the_recorded_results(script):
    buffer = Buffer(Duration(seconds=CACHE_TIME.get(script['name'], 10.0)))
    for call in script['ops']:
        if call['op'] in ('set', 'set_static'):
            tf = call['tf']
            sec, nanosec = tf['stamp']
            message = stamped(
                tf['frame_id'], tf['child'], sec * NS_PER_SECOND + nanosec, tf['t'], tf['q'])
            add = buffer.set_transform if call['op'] == 'set' else buffer.set_transform_static
            assert add(message, 'oracle') is None
        elif call['op'] == 'clear':
            buffer.clear()
        elif call['op'] == 'all_frames_string':
            assert buffer.all_frames_as_string() == call['text']
        else:
            if 'can' in call:
                possible, reason = buffer.can_transform(
                    call['target'], call['source'], seconds(call['t']), return_debug_tuple=True)
                assert [bool(possible), reason] == call['can'], call
            if 'exc' in call:
                with pytest.raises(getattr(tf2_ros, call['exc'])) as raised:
                    buffer.lookup_transform(call['target'], call['source'], seconds(call['t']))
                assert type(raised.value).__name__ == call['exc']
                assert str(raised.value) == call['text']
            else:
                expected, found = call['ok'], buffer.lookup_transform(
                    call['target'], call['source'], seconds(call['t']))
                assert numbers(found) == pytest.approx(
                    expected['t'] + expected['q'], abs=1e-9), call
                stamp = found.header.stamp
                assert [stamp.sec, stamp.nanosec] == expected['stamp']
                assert found.header.frame_id == expected['frame_id']
                assert found.child_frame_id == expected['child']


def test_lookup_waits_until_timeout():
    buffer, begin = Buffer(), monotonic()
    with pytest.raises(LookupException):
        buffer.lookup_transform('w', 'x', LATEST, Duration(seconds=0.2))
    assert 0.19 < monotonic() - begin < TIMEOUT
    Timer(0.1, buffer.set_transform, [
        stamped('w', 'x', NS_PER_SECOND, (1.0, 2.0, 3.0)), 'test']).start()
    found = buffer.lookup_transform('w', 'x', LATEST, Duration(seconds=2.0 * TIMEOUT))
    assert numbers(found)[:3] == [1.0, 2.0, 3.0]
    assert monotonic() - begin < TIMEOUT


@pytest.mark.parametrize('timeout', [1.0, None, DurationMessage(sec=1)])
def test_a_timeout_of_another_type_is_refused(timeout):
    """The real buffer adds it to a Time, which also raises a TypeError."""
    buffer = Buffer()
    buffer.set_transform_static(stamped('w', 'x', 0), 'test')
    for function in (buffer.lookup_transform, buffer.can_transform):
        with pytest.raises(TypeError, match=r'^timeout is .*, but must be an rclpy.*Duration$'):
            function('w', 'x', LATEST, timeout)


def test_future_completes_when_the_transform_is_available():
    buffer = Buffer()
    future = buffer.wait_for_transform_async('w', 'x', LATEST)
    coroutine = buffer.lookup_transform_async('w', 'x', LATEST)
    assert coroutine.send(None) is None and not future.done()
    buffer.set_transform_static(stamped('w', 'y', 0), 'test')
    assert not future.done()
    buffer.set_transform(stamped('y', 'x', NS_PER_SECOND, (1.0, 2.0, 3.0)), 'test')
    assert numbers(future.result())[:3] == [1.0, 2.0, 3.0]
    with pytest.raises(StopIteration) as returned:
        coroutine.send(None)
    assert returned.value.value == future.result()
    assert buffer.wait_for_transform_async('w', 'x', LATEST).result() == future.result()


def test_missing_features_are_explained():
    reason = 'is not in the stand-in for tf2_ros: check its spelling'
    for use in (lambda: Buffer().lookup_transform_full, lambda: tf2_ros.convert):
        with pytest.raises((AttributeError, TypeError), match=reason):
            use()
    with pytest.raises(ImportError, match=f'BufferInterface {reason}'):
        from tf2_ros.buffer_interface import BufferInterface  # noqa: F401


def test_a_listener_can_spin_its_node_in_a_thread(domain_id):
    context = Context()
    rclpy.init(context=context, domain_id=domain_id)
    node = rclpy.create_node('spun', context=context)
    buffer = Buffer()
    TransformListener(buffer, node, spin_thread=True)
    StaticTransformBroadcaster(node).sendTransform(stamped('w', 'x', 0, (1.0, 2.0, 3.0)))
    found = buffer.lookup_transform('w', 'x', LATEST, Duration(seconds=TIMEOUT))
    rclpy.shutdown(context=context)
    assert numbers(found)[:3] == [1.0, 2.0, 3.0]


def test_broadcast_transforms_can_be_looked_up(live):
    """One latched message contains the first static transform of each child frame."""
    moving = TransformBroadcaster(live.listener)
    static = StaticTransformBroadcaster(live.listener)
    static.sendTransform(stamped('a', 'tip', 0, (0.0, 0.0, 7.0)))
    static.sendTransform((stamped('b', 'end', 0, (2.0, 0.0, 0.0)),))
    static.sendTransform(stamped('a', 'tip', 0, (9.0, 0.0, 0.0)))
    buffer = Buffer(node=live.listener)
    listener = TransformListener(buffer, live.listener)
    late = live.record('/tf_static', TFMessage, LATCHED)
    live.wait_for(lambda: moving.pub_tf.get_subscription_count() == 1, TIMEOUT, 'a listener')
    moving.sendTransform(stamped('world', 'a', NS_PER_SECOND, (1.0, 0.0, 0.0)))
    moving.sendTransform([stamped('world', 'a', 2 * NS_PER_SECOND, (3.0, 0.0, 0.0)),
                          stamped('world', 'b', 2 * NS_PER_SECOND, (0.0, 1.0, 0.0))])
    live.wait_for(lambda: buffer.can_transform('end', 'tip', LATEST), TIMEOUT, 'TF')
    assert numbers(buffer.lookup_transform('world', 'tip', seconds(1.5)))[:3] == [2.0, 0.0, 7.0]
    live.wait_for(lambda: late.messages, TIMEOUT, 'the static transforms')
    assert [(t.child_frame_id, numbers(t)[:3]) for t in late.last.transforms] == [
        ('tip', [0.0, 0.0, 7.0]), ('end', [2.0, 0.0, 0.0])]
    assert len(late.messages) == 1

    def subscriptions():
        return [end for topic in ('/tf', '/tf_static')
                for end in live.listener.get_subscriptions_info_by_topic(topic)
                if end.node_name == 'listener']

    for durability, broadcaster, end in zip(
            (DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL), (moving, static),
            live.wait_for(lambda: len(subscriptions()) == 2 and subscriptions(), TIMEOUT,
                          'the subscriptions')):
        for qos in (broadcaster.pub_tf.qos_profile, end.qos_profile):
            assert qos.reliability == ReliabilityPolicy.RELIABLE
            assert qos.durability == durability
    listener.unregister()
    live.wait_for(lambda: not subscriptions(), TIMEOUT, 'the end of the subscriptions')


@pytest.mark.parametrize('interface', REAL_HASHES)
def test_type_hash_is_the_real_one(interface):
    package, kind, name = interface.split('/')
    description = json.loads((get_package_share_path(package) / kind / f'{name}.json').read_text())
    hashes = {row['type_name']: row['hash_string'] for row in description['type_hashes']}
    assert hashes[interface] == REAL_HASHES[interface]
