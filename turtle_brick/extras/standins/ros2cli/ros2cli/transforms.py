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
"""The tf2_ros programs `tf2_echo` and `static_transform_publisher`."""

from math import degrees
from random import choices
from string import ascii_letters, digits

from rclpy.time import Time
from ros2cli.graph import open_graph
from tf2_ros import Buffer, StaticTransformBroadcaster, TransformListener
from tf2_ros.buffer_core import stamped
from tf_transformations import euler_from_quaternion, quaternion_from_euler, quaternion_matrix


def describe(transform):
    """Return the text that tf2_echo prints for a transform."""
    def joined(numbers):
        return ', '.join(f'{number:.3f}' for number in numbers)

    t, r = transform.transform.translation, transform.transform.rotation
    position, rotation, stamp = (t.x, t.y, t.z), (r.x, r.y, r.z, r.w), transform.header.stamp
    angles, matrix = euler_from_quaternion(rotation), quaternion_matrix(rotation)
    matrix[:3, 3] = position
    rows = '\n'.join(''.join(f' {number:6.3f}' for number in row) for row in matrix)
    return (f'At time {stamp.sec}.{stamp.nanosec}\n- Translation: [{joined(position)}]\n'
            f'- Rotation: in Quaternion (xyzw) [{joined(rotation)}]\n'
            f'- Rotation: in RPY (radian) [{joined(angles)}]\n'
            f'- Rotation: in RPY (degree) [{joined(map(degrees, angles))}]\n'
            f'- Matrix:\n{rows}')


def tf2_echo(args):
    """Print the pose of one frame in another frame at a fixed rate."""
    buffer, found = Buffer(), False
    frames = args.source_frame, args.target_frame
    with open_graph(lambda _: True, 'tf2_echo', args.ros_args) as graph:
        def on_timer():
            nonlocal found
            exists, reason = buffer.can_transform_core(*frames, Time())
            if exists:
                found = True
                print(describe(buffer.lookup_transform(*frames, Time())))
            elif found:
                print(f'Failure at {graph.get_clock().now().nanoseconds * 1e-9:.3f}\n'
                      f'Exception thrown:{reason}\nThe current list of frames is:\n'
                      f'{buffer.all_frames_as_string()}')
            else:
                graph.get_logger().info('Waiting for transform {} ->  {}: {}'.format(
                    *frames, reason), throttle_duration_sec=1.0)

        graph.listener = TransformListener(buffer, graph)
        on_timer()
        graph.create_timer(1.0 / args.r, on_timer)
        graph.spin_until(lambda: False)


def static_transform_publisher(args):
    """Publish a static transform until Ctrl-C or SIGTERM."""
    quaternion, angles = (args.qx, args.qy, args.qz, args.qw), (args.roll, args.pitch, args.yaw)
    if args.frame_id == args.child_frame_id:
        return f"cannot publish static transform from '{args.frame_id}' to itself, exiting"
    if quaternion != (0.0, 0.0, 0.0, 1.0) and any(angles):
        return 'Cannot specify both quaternion and Euler rotations'
    if any(angles):
        quaternion = quaternion_from_euler(*angles)
    transform = args.x, args.y, args.z, *quaternion
    name = f'static_transform_publisher_{"".join(choices(ascii_letters + digits, k=16))}'
    with open_graph(lambda _: True, name, args.ros_args) as graph:
        broadcaster = StaticTransformBroadcaster(graph)
        broadcaster.sendTransform(stamped(args.frame_id, args.child_frame_id,
                                          graph.get_clock().now().nanoseconds, transform))
        graph.get_logger().info('Spinning until stopped - publishing transform\n' + (
            "translation: ('{:f}', '{:f}', '{:f}')\nrotation: ('{:f}', '{:f}', '{:f}', '{:f}')\n"
            "from '{}' to '{}'").format(*transform, args.frame_id, args.child_frame_id))
        graph.spin_until(lambda: False)
