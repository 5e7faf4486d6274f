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

"""
The whole graph in one process: the very node classes, one executor, real DDS.

Where turtlesim and robot_state_publisher are stand-ins, they are composed too; where the real
ones are installed, they run beside as processes of their own.
"""

from collections.abc import Callable
import importlib
from importlib.util import find_spec
import os
from pathlib import Path
import sys
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

from ament_index_python.packages import get_package_prefix, PackageNotFoundError
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from turtle_brick.arena import Arena
from turtle_brick.catcher import CatcherNode
from turtle_brick.core.parameters import default_path
from turtle_brick.ros.node_main import make_executor
from turtle_brick.turtle_robot import TurtleRobot
from turtle_referee.graph_client.processes import close_all, Process
from turtle_referee.graph_client.spinning import Spinner
import xacro
import yaml

END_TIME = 15.0
"""How long (s) a node may take to leave the executor."""

AnyNode = TypeVar('AnyNode', bound=Node)


def executable(package: str, name: str) -> str:
    """
    Return the path of an installed executable, which `ros2 run` would start.

    :raises PackageNotFoundError: there is no such package; its argument says so
    """
    try:
        return str(Path(get_package_prefix(package), 'lib', package, name))
    except PackageNotFoundError:
        raise PackageNotFoundError(f'the package {package} is not installed here') from None


class Graph(Spinner):
    """Nodes in one process that see each other, and whoever else is in their ROS domain."""

    def __init__(self, domain_id: int | None = None, namespace: str = '',
                 quiet: bool = False, tf_inside: bool = False) -> None:
        """
        Start with no nodes.

        :param domain_id: the ROS domain; that of the environment if None
        :param namespace: the namespace of all nodes
        :param quiet: whether the nodes log warnings and errors only
        :param tf_inside: whether TF is in the namespace, too, as the launch files have it
        """
        self.namespace = namespace
        self._files = TemporaryDirectory()
        self.params_file = default_path()
        self.domain_id = domain_id
        self.context = Context()
        self._remaps = ['-r', '/tf:=tf', '-r', '/tf_static:=tf_static'] if tf_inside else []
        self._log_level = ['--log-level', 'warn' if quiet else 'info']
        rclpy.init(args=['--ros-args', *self._log_level], context=self.context,
                   domain_id=domain_id, signal_handler_options=SignalHandlerOptions.NO)
        self.executor = make_executor(self.context)
        self.nodes: list[Node] = []
        self._processes: list[Process] = []

    def __enter__(self) -> 'Graph':
        """Return the graph itself; on leaving it, everything ends."""
        return self

    def __exit__(self, *_: object) -> None:
        """End everything."""
        self.close()

    def add(self, node_type: type[AnyNode], *ros_arguments: str, parameters: bool = True,
            **options: Any) -> AnyNode:
        """
        Add a node.

        :param node_type: its class
        :param ros_arguments: what stands behind --ros-args, as '-r', 'cmd_vel:=turtle1/cmd_vel'
        :param parameters: whether to give it the parameter file
        :param options: passed on to the node's class
        """
        arguments = ['--ros-args', *self._remaps, *ros_arguments]
        if parameters:
            arguments += ['--params-file', str(self.params_file)]
        node = node_type(context=self.context, cli_args=arguments, use_global_arguments=False,
                         namespace=self.namespace, **options)
        self.nodes.append(node)
        self.executor.add_node(node)
        return node

    def remove(self, node: Node) -> None:
        """Take a node out of the graph and destroy it."""
        self.nodes.remove(node)
        self.executor.remove_node(node)
        # An executor may have to let go of the node first, which is a piece of work.
        self.spin_until(self.executor.create_task(lambda: None).done, END_TIME,
                        'the executor lets go of a node')
        node.destroy_node()

    def add_turtlesim(self) -> Node | None:
        """Add turtlesim, holonomic; return its node, None if it is the real one."""
        return self._add_foreign('turtlesim', 'turtlesim_node', 'turtlesim_standin.node',
                                 'TurtleSimNode', {'holonomic': True})

    def add_robot_state_publisher(self) -> Node | None:
        """Add robot_state_publisher with our robot; return its node, None if it is real."""
        return self._add_foreign(
            'robot_state_publisher', 'robot_state_publisher', 'robot_state_publisher.node',
            'RobotStatePublisher', self.robot_parameters())

    def robot_parameters(self) -> dict[str, Any]:
        """Return robot_state_publisher's parameters, as in the launch files, for our robot."""
        path = self.params_file.parents[1] / 'urdf' / 'turtle.urdf.xacro'
        urdf = xacro.process_file(str(path), mappings={'params_file': str(self.params_file)})
        return {'robot_description': urdf.toxml(), 'ignore_timestamp': True}

    def add_robot(self) -> TurtleRobot:
        """Add turtle_robot, connected to turtlesim as the launch files do it."""
        return self.add(TurtleRobot, '-r', 'cmd_vel:=turtle1/cmd_vel')

    def add_arena(self) -> Arena:
        """Add the arena."""
        return self.add(Arena)

    def add_catcher(self) -> CatcherNode:
        """Add the catcher."""
        return self.add(CatcherNode)

    def add_process(self, package: str, name: str, *arguments: str,
                    listener: Callable[[str], object] = sys.stderr.write) -> Process:
        """
        Start an executable that belongs to the graph, in a process of its own.

        :param package: the package it belongs to; PackageNotFoundError if there is none
        :param name: its name
        :param arguments: its command line
        :param listener: called with each line that it prints
        """
        ros_arguments = [*self._log_level, *self._remaps]
        if self.namespace:
            # Real nodes refuse a namespace without the slash.
            ros_arguments += ['-r', f'__ns:=/{self.namespace.lstrip("/")}']
        if ros_arguments:
            arguments = (*arguments, '--ros-args', *ros_arguments)
        domain = {} if self.domain_id is None else {'ROS_DOMAIN_ID': str(self.domain_id)}
        process = Process([executable(package, name), *arguments], domain, listener)
        self._processes.append(process)
        return process

    def parameter_file(self, parameters: dict[str, Any]) -> Path:
        """Write parameters for any node into a file of this graph; return its path."""
        path = Path(self._files.name, f'{len(os.listdir(self._files.name))}.yaml')
        path.write_text(yaml.safe_dump({'/**': {'ros__parameters': parameters}}), encoding='utf-8')
        return path

    def _add_foreign(self, package: str, executable: str, module: str, node_type: str,
                     parameters: dict[str, Any]) -> Node | None:
        """Compose a stand-in where there is one, else start the real executable."""
        # A file, since no command line takes a URDF as the value of a parameter.
        arguments = ['--params-file', str(self.parameter_file(parameters))]
        if find_spec(module.partition('.')[0]) is not None:
            stand_in = getattr(importlib.import_module(module), node_type)
            return self.add(stand_in, *arguments, parameters=False)
        self.add_process(package, executable, '--ros-args', *arguments)
        return None

    def close(self) -> None:
        """End every node and process."""
        close_all(self._processes)
        self._processes.clear()
        self.executor.shutdown()
        for node in self.nodes:
            node.destroy_node()
        self.nodes.clear()
        self.context.try_shutdown()
        self._files.cleanup()
