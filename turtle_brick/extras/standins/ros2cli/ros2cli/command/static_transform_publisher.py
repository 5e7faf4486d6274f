# SPDX-License-Identifier: Apache-2.0
"""The program static_transform_publisher of tf2_ros."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from random import choices
from string import ascii_letters, digits

from ros2cli.command import CommandExtension, Status
from ros2cli.node import direct
from tf2_ros import StaticTransformBroadcaster
from tf2_ros.buffer_core import stamped, Transform
from tf_transformations import quaternion_from_euler

ROTATIONS = {8: ('yaw', 'pitch', 'roll'), 9: ('qx', 'qy', 'qz', 'qw')}
"""Names of the rotation arguments, keyed by the number of old-style arguments."""


class StaticTransformPublisherCommand(CommandExtension):
    """Publishes a static transform until Ctrl-C or SIGTERM."""

    def add_arguments(self, parser: argparse.ArgumentParser, cli_name: str,
                      typed: Sequence[str]) -> None:
        parser.add_argument('--x', type=float, default=0.0, help='translation (m)')
        parser.add_argument('--y', type=float, default=0.0, help='translation (m)')
        parser.add_argument('--z', type=float, default=0.0, help='translation (m)')
        parser.add_argument('--roll', type=float, default=0.0, help='rotation (rad)')
        parser.add_argument('--pitch', type=float, default=0.0, help='rotation (rad)')
        parser.add_argument('--yaw', type=float, default=0.0, help='rotation (rad)')
        parser.add_argument(
            '--qx', type=float, default=0.0,
            help='component of the rotation quaternion')
        parser.add_argument(
            '--qy', type=float, default=0.0,
            help='component of the rotation quaternion')
        parser.add_argument(
            '--qz', type=float, default=0.0,
            help='component of the rotation quaternion')
        parser.add_argument(
            '--qw', type=float, default=1.0,
            help='component of the rotation quaternion')
        parser.add_argument('--frame-id', help='parent frame')
        parser.add_argument('--child-frame-id', help='child frame id')
        parser.add_argument(
            'values', nargs='*',
            help='old-style arguments: x y z yaw pitch roll frame_id child_frame_id, or x y z qx '
            'qy qz qw frame_id child_frame_id')
        parser.add_argument(
            '--ros-args', nargs='...', default=[],
            help='ROS arguments of the node')

    def main(self, *, args: argparse.Namespace) -> Status:
        if args.values:
            names = ('x', 'y', 'z', *ROTATIONS.get(len(args.values), ()))
            if len(args.values) != len(names) + 2:
                return ('error parsing command line arguments: Extra unparsed arguments on '
                        'command-line')
            *numbers, args.frame_id, args.child_frame_id = args.values
            for name, number in zip(names, numbers):
                setattr(args, name, float(number))
        if not args.frame_id or not args.child_frame_id:
            kind = 'Child frame' if args.frame_id else 'Frame'
            return f'error parsing command line arguments: {kind} id must not be empty'
        if args.frame_id == args.child_frame_id:
            return f"cannot publish static transform from '{args.frame_id}' to itself, exiting"
        quaternion = (args.qx, args.qy, args.qz, args.qw)
        angles = (args.roll, args.pitch, args.yaw)
        if any(angles):
            if quaternion != (0.0, 0.0, 0.0, 1.0):
                return 'Cannot specify both quaternion and Euler rotations'
            quaternion = quaternion_from_euler(*angles)
        self._publish(args, (args.x, args.y, args.z, *quaternion))
        return None

    def _publish(self, args: argparse.Namespace, transform: Transform) -> None:
        """Publish a transform, which consists of a translation (m) and a quaternion."""
        name = f'static_transform_publisher_{"".join(choices(ascii_letters + digits, k=16))}'
        with direct.open_graph(lambda graph: True, name, args.ros_args) as graph:
            if args.values:
                graph.get_logger().warning(
                    'Old-style arguments are deprecated; see --help for new-style arguments')
            broadcaster = StaticTransformBroadcaster(graph)
            broadcaster.sendTransform(stamped(args.frame_id, args.child_frame_id,
                                              graph.get_clock().now().nanoseconds, transform))
            graph.get_logger().info('Spinning until stopped - publishing transform\n' + (
                "translation: ('{:f}', '{:f}', '{:f}')\n"
                "rotation: ('{:f}', '{:f}', '{:f}', '{:f}')\nfrom '{}' to '{}'").format(
                    *transform, args.frame_id, args.child_frame_id))
            graph.spin_until(lambda: False)
