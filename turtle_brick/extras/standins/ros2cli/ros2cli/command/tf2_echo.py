# SPDX-License-Identifier: Apache-2.0
"""The program tf2_echo of tf2_ros."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from math import degrees

from geometry_msgs.msg import TransformStamped
from rclpy.time import Time
from ros2cli.command import CommandExtension, Status
from ros2cli.helpers import positive_float
from ros2cli.node import direct
from tf2_ros import Buffer, TransformListener
from tf_transformations import euler_from_quaternion, quaternion_matrix


def join(numbers: Iterable[float]) -> str:
    """Return numbers with three decimals."""
    return ', '.join(f'{number:.3f}' for number in numbers)


def describe(transform: TransformStamped) -> str:
    """Return the text that tf2_echo prints for a transform."""
    translation, rotation = transform.transform.translation, transform.transform.rotation
    position = (translation.x, translation.y, translation.z)
    quaternion = (rotation.x, rotation.y, rotation.z, rotation.w)
    angles = euler_from_quaternion(quaternion)
    matrix = quaternion_matrix(quaternion)
    matrix[:3, 3] = position
    rows = '\n'.join(''.join(f' {number:6.3f}' for number in row) for row in matrix)
    stamp = transform.header.stamp
    return (f'At time {stamp.sec}.{stamp.nanosec}\n- Translation: [{join(position)}]\n'
            f'- Rotation: in Quaternion (xyzw) [{join(quaternion)}]\n'
            f'- Rotation: in RPY (radian) [{join(angles)}]\n'
            f'- Rotation: in RPY (degree) [{join(map(degrees, angles))}]\n'
            f'- Matrix:\n{rows}')


class Tf2EchoCommand(CommandExtension):
    """Prints the pose of one frame in another frame at a fixed rate."""

    def add_arguments(self, parser: argparse.ArgumentParser, cli_name: str,
                      typed: Sequence[str]) -> None:
        parser.add_argument('source_frame', help='frame in which the pose is printed')
        parser.add_argument('target_frame', help='frame whose pose is printed')
        parser.add_argument(
            'echo_rate', nargs='?', type=positive_float, default=1.0,
            help='Echo rate in Hz (default: 1.0)')
        parser.add_argument(
            '-r', metavar='RATE', type=positive_float, help='Another way to set the echo rate')
        parser.add_argument(
            '--ros-args', nargs='...', default=[],
            help='ROS arguments of the node')

    def main(self, *, args: argparse.Namespace) -> Status:
        buffer = Buffer()
        frames = (args.source_frame, args.target_frame)
        found = False
        with direct.open_graph(lambda graph: True, 'tf2_echo', args.ros_args) as graph:
            def on_timer() -> None:
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
                    graph.get_logger().info(
                        f'Waiting for transform {frames[0]} ->  {frames[1]}: {reason}',
                        throttle_duration_sec=1.0)

            TransformListener(buffer, graph)
            on_timer()
            graph.create_timer(1.0 / (args.r or args.echo_rate), on_timer)
            graph.spin_until(lambda: False)
            return None
