# SPDX-License-Identifier: Apache-2.0
"""Compare the stand-in for robot_state_publisher with recordings of the real node."""

import json
from pathlib import Path

from builtin_interfaces.msg import Time
from live_graph import LATCHED, process, TIMEOUT
import pytest
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data, QoSProfile
from robot_state_publisher.description import FIXED, MOVING, parse
from robot_state_publisher.node import RobotStatePublisher
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage
from tf2_ros.buffer_core import canonical
from turtle_brick_tools.graph import executable

DATA = Path(__file__).parent / 'data' / 'tf2'
URDF = (DATA / 'r2.urdf').read_text()
RECORDINGS = [json.loads(path.read_text()) for path in sorted(DATA.glob('rsp_*.json'))]
URDFS = json.loads((DATA / 'urdf_verdicts.json').read_text())
"""URDFs with the result of urdfdom 4.0.2 and transforms at joint positions of 0.5 (rad or m)."""

NS_PER_SECOND = 1_000_000_000


def nanoseconds(stamp):
    return stamp[0] * NS_PER_SECOND + stamp[1]


def joint_state(row, shift):
    """Return a recorded JointState message with its timestamp shifted by `shift` (ns)."""
    message = JointState(name=row['name'], position=[float(value) for value in row['position']])
    if nanoseconds(row['stamp']):
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(
            nanoseconds(row['stamp']) + shift, NS_PER_SECOND)
    return message


def assert_transforms(message, recorded, shift=0, stamps=True):
    """Compare a message with recorded transforms whose timestamps are shifted by `shift` (ns)."""
    assert len(message.transforms) == len(recorded)
    for found, wanted in zip(message.transforms, recorded):
        t, r = found.transform.translation, found.transform.rotation
        assert (found.header.frame_id, found.child_frame_id) == (
            wanted['frame_id'], wanted['child_frame_id'])
        assert [t.x, t.y, t.z, r.x, r.y, r.z, r.w] == pytest.approx(
            wanted['t'] + wanted['q'], abs=1e-9)
        if stamps:
            stamp = found.header.stamp
            assert nanoseconds((stamp.sec, stamp.nanosec)) == nanoseconds(wanted['stamp']) + shift


def start(live, **parameters):
    overrides = [Parameter(name, value=value) for name, value in parameters.items()]
    node = live.add(RobotStatePublisher, parameters=False, parameter_overrides=overrides)
    tf = live.record('/tf', TFMessage, QoSProfile(depth=500))
    live.wait_for(lambda: node.count_subscribers('/tf') == 1, TIMEOUT, 'a listener')
    return node, tf


@pytest.mark.parametrize('recording', RECORDINGS, ids=lambda recording: recording['name'])
def test_joint_states_cause_the_recorded_transforms(recording, live):
    urdf = (DATA / recording.get('urdf', 'r2.urdf')).read_text()
    node, tf = start(live, robot_description=urdf, **recording['params'])
    static = live.record('/tf_static', TFMessage, LATCHED)
    # The timestamps are shifted so that the last one is one second old.
    shift = (live.listener.get_clock().now().nanoseconds - NS_PER_SECOND
             - nanoseconds(recording['sent'][-1]['stamp']))
    for row in recording['sent']:
        node.joint_states_callback(joint_state(row, shift))
    # When the transform for this message arrives, all earlier transforms have arrived.
    end = JointState(name=['j3'], position=[0.25], header=Header(
        stamp=live.listener.get_clock().now().to_msg()))
    live.publisher('joint_states', JointState, qos_profile_sensor_data).publish(end)
    live.wait_for(lambda: tf.messages and tf.last.transforms
                  and tf.last.transforms[0].header.stamp == end.header.stamp, TIMEOUT, 'the end')
    live.wait_for(lambda: static.messages, TIMEOUT, 'the static transforms')
    assert len(tf.messages) == len(recording['tf']) + 1
    for message, (_, recorded) in zip(tf.messages, recording['tf']):
        assert_transforms(message, recorded, shift)
    assert len(static.messages) == len(recording['tf_static']) == 1
    assert_transforms(static.last, recording['tf_static'][0][1], stamps=False)


@pytest.mark.parametrize('parameter, stamps', [
    ({'publish_frequency': 0.0}, (5, 5, 6)), ({'ignore_timestamp': True}, (5, 0, 4))])
def test_all_messages_are_published_without_limit_or_stamps(live, parameter, stamps):
    node, tf = start(live, robot_description=URDF, **parameter)
    for stamp in stamps:
        node.joint_states_callback(JointState(
            name=['j1'], position=[1.0], header=Header(stamp=Time(sec=stamp))))
    live.wait_for(lambda: len(tf.messages) == 3, TIMEOUT, 'three messages')


def test_invalid_parameter_ends_node_with_one_line(tmp_path, domain_id):
    file = tmp_path / 'parameters.yaml'
    file.write_text(json.dumps({'/**': {'ros__parameters': {
        'robot_description': URDF, 'publish_frequency': 2000.0}}}))
    with process([executable('robot_state_publisher', 'robot_state_publisher'), '--ros-args',
                  '--params-file', str(file)], domain_id, stop=None) as running:
        assert running.wait(TIMEOUT) == 1
    assert '2000' in running.output
    assert len(running.output.strip().splitlines()) == 1


@pytest.mark.parametrize('case', URDFS, ids=lambda case: case['name'])
def test_urdf_has_the_recorded_verdict_warnings_and_transforms(case):
    warnings = []
    if not case['alive']:
        with pytest.raises(ValueError):
            parse(case['urdf'], warnings.append)
        return
    joints = parse(case['urdf'], warnings.append).values()
    assert bool(warnings) == case['warns']
    for kinds, position, recorded in ((FIXED, 0.0, 'fixed'), (MOVING, 0.5, 'moving')):
        poses = {f'{joint.parent} -> {joint.child}': joint.pose(position)
                 for joint in joints if joint.kind in kinds}
        assert poses.keys() == case.get(recorded, {}).keys()
        for name, pose in poses.items():
            assert (*pose[:3], *canonical(*pose[3:])) == pytest.approx(
                case[recorded][name], abs=1e-6, nan_ok=True)


@pytest.mark.parametrize('name, reason', [
    ('xml_unquoted', 'robot_description is not valid XML: not well-formed'),
    ('two_roots', r"the roots are \['a', 'b'\]"),
    ('loop_below_the_root', r"the links \['a', 'b', 'c', 'b'\] form a loop"),
    ('joint_no_parent', r'joint \[j\]: link \[\] does not exist'),
    ('material_twice', r'material \[m\] is defined more than once'),
    ('limit_no_velocity', r'joint \[j\]: <limit> has no velocity'),
    ('origin_comma', r"joint \[j\]: <origin> xyz: '0,5' is not a number"),
    ('axis_four_numbers', "xyz: '0 0 1 0' has 4 instead of 3 numbers"),
])
def test_reason_names_the_invalid_part(name, reason):
    urdf, = (case['urdf'] for case in URDFS if case['name'] == name)
    with pytest.raises(ValueError, match=reason):
        parse(urdf, print)
