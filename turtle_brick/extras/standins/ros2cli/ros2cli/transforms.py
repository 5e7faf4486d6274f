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
"""The programs `tf2_echo`, `static_transform_publisher` and `view_frames`."""

from datetime import datetime
from math import degrees
from pathlib import Path
from random import choices
import shutil
from string import ascii_letters, digits
import subprocess

from rclpy.time import Time
from ros2cli.graph import open_graph
from tf2_msgs.srv import FrameGraph
from tf2_ros import Buffer, StaticTransformBroadcaster, TransformListener
from tf2_ros.buffer_core import stamped
from tf_transformations import euler_from_quaternion, quaternion_from_euler, quaternion_matrix
import yaml


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


ROTATIONS = {8: ('yaw', 'pitch', 'roll'), 9: ('qx', 'qy', 'qz', 'qw')}
"""Names of the rotation arguments, keyed by the number of old-style arguments."""


def static_transform_publisher(args):
    """Publish a static transform until Ctrl-C or SIGTERM."""
    if args.values:
        names = ('x', 'y', 'z', *ROTATIONS.get(len(args.values), ()))
        if len(args.values) != len(names) + 2:
            return 'error parsing command line arguments: Extra unparsed arguments on command-line'
        *numbers, args.frame_id, args.child_frame_id = args.values
        vars(args).update(zip(names, map(float, numbers)))
    if not args.frame_id or not args.child_frame_id:
        kind = 'Child frame' if args.frame_id else 'Frame'
        return f'error parsing command line arguments: {kind} id must not be empty'
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
        if args.values:
            graph.get_logger().warning(
                'Old-style arguments are deprecated; see --help for new-style arguments')
        broadcaster = StaticTransformBroadcaster(graph)
        broadcaster.sendTransform(stamped(args.frame_id, args.child_frame_id,
                                          graph.get_clock().now().nanoseconds, transform))
        graph.get_logger().info('Spinning until stopped - publishing transform\n' + (
            "translation: ('{:f}', '{:f}', '{:f}')\nrotation: ('{:f}', '{:f}', '{:f}', '{:f}')\n"
            "from '{}' to '{}'").format(*transform, args.frame_id, args.child_frame_id))
        graph.spin_until(lambda: False)


def view_frames(args):
    """Write the frames on /tf and /tf_static to a Graphviz file and, with Graphviz, to a PDF."""
    name = args.output or f'frames_{datetime.now():%Y-%m-%d_%H.%M.%S}'
    buffer = Buffer()
    with open_graph(lambda _: True, 'view_frames', args.ros_args) as graph:
        graph.get_logger().info(f'Listening to tf data for {args.wait_time} seconds...')
        graph.listener = TransformListener(buffer, graph)
        graph.spin_until(lambda: False, args.wait_time)
        graph.get_logger().info('Generating graph...')
        text = buffer.all_frames_as_yaml()
        graph.get_logger().info(f'Result:{FrameGraph.Response(frame_yaml=text)}')
        time = graph.get_clock().now().nanoseconds * 1e-9
    Path(f'{name}.gv').write_text(frame_tree(yaml.safe_load(text), time), encoding='utf-8')
    if not shutil.which('dot'):
        return (f'view_frames wrote {name}.gv. A PDF requires Graphviz, which is not installed. '
                'Install it, for example with "sudo apt install graphviz".')
    graph.get_logger().info(f'Exporting graph in {name}.pdf file...')
    return subprocess.run(['dot', '-Tpdf', f'{name}.gv', '-o', f'{name}.pdf']).returncode


FRAME_LABELS = {
    'Broadcaster': 'broadcaster', 'Average rate': 'rate', 'Buffer length': 'buffer_length',
    'Most recent transform': 'most_recent_transform', 'Oldest transform': 'oldest_transform'}


def frame_tree(frames, time):
    """Return the Graphviz graph that view_frames writes for frames received until a time (s)."""
    if not frames:
        return 'digraph G { "No tf data received" }'
    edges, root = [], ''
    for name, frame in frames.items():
        label = ''.join(f'{text}: {frame[key]}\\n' for text, key in FRAME_LABELS.items())
        edges.append(f'"{frame["parent"]}" -> "{name}"[label=" {label}"];\n')
        root = root if frame['parent'] in frames else frame['parent']
    return (f'digraph G {{\n{"".join(edges)}edge [style=invis];\n'
            ' subgraph cluster_legend { style=bold; color=black; label ="view_frames Result";\n'
            f'"Recorded at time: {time}"[ shape=plaintext ] ;\n}}->"{root}";\n}}')
