# SPDX-License-Identifier: Apache-2.0
"""The program view_frames of tf2_tools."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
import shutil
import subprocess
from typing import Any

from ros2cli.command import CommandExtension, Status
from ros2cli.node import direct
from tf2_msgs.srv import FrameGraph
from tf2_ros import Buffer, TransformListener
import yaml

FRAME_LABELS = {
    'Broadcaster': 'broadcaster', 'Average rate': 'rate', 'Buffer length': 'buffer_length',
    'Most recent transform': 'most_recent_transform', 'Oldest transform': 'oldest_transform'}
"""Keys of the values of a frame, keyed by label."""


def frame_tree(frames: dict[str, dict[str, Any]] | None, time: float) -> str:
    """Return the Graphviz graph of the frames that were received until a time (s)."""
    if not frames:
        return 'digraph G { "No tf data received" }'
    edges = []
    root = ''
    for name, frame in frames.items():
        label = ''.join(f'{text}: {frame[key]}\\n' for text, key in FRAME_LABELS.items())
        edges.append(f'"{frame["parent"]}" -> "{name}"[label=" {label}"];\n')
        if frame['parent'] not in frames:
            root = frame['parent']
    return (f'digraph G {{\n{"".join(edges)}edge [style=invis];\n'
            ' subgraph cluster_legend { style=bold; color=black; label ="view_frames Result";\n'
            f'"Recorded at time: {time}"[ shape=plaintext ] ;\n}}->"{root}";\n}}')


class ViewFramesCommand(CommandExtension):
    """Writes the frames on /tf and /tf_static to a Graphviz file and, with Graphviz, to a PDF."""

    def add_arguments(self, parser: argparse.ArgumentParser, cli_name: str,
                      typed: Sequence[str]) -> None:
        parser.add_argument(
            '-t', '--wait-time', type=float, default=5.0,
            help='Listen to the /tf topic for this many seconds before rendering the frame tree')
        parser.add_argument('-o', '--output', help='Output filename')
        parser.add_argument(
            '--ros-args', nargs='...', default=[],
            help='ROS arguments of the node')

    def main(self, *, args: argparse.Namespace) -> Status:
        name = args.output or f'frames_{datetime.now():%Y-%m-%d_%H.%M.%S}'
        buffer = Buffer()
        with direct.open_graph(lambda graph: True, 'view_frames', args.ros_args) as graph:
            graph.get_logger().info(f'Listening to tf data for {args.wait_time} seconds...')
            TransformListener(buffer, graph)
            graph.spin_until(lambda: False, args.wait_time)
            graph.get_logger().info('Generating graph...')
            text = buffer.all_frames_as_yaml()
            graph.get_logger().info(f'Result:{FrameGraph.Response(frame_yaml=text)}')
            time = graph.get_clock().now().nanoseconds * 1e-9
        Path(f'{name}.gv').write_text(frame_tree(yaml.safe_load(text), time), encoding='utf-8')
        if not shutil.which('dot'):
            return (f'view_frames wrote {name}.gv. A PDF requires Graphviz, which is not '
                    'installed. Install it, for example with "sudo apt install graphviz".')
        graph.get_logger().info(f'Exporting graph in {name}.pdf file...')
        return subprocess.run(['dot', '-Tpdf', f'{name}.gv', '-o', f'{name}.pdf']).returncode
