# SPDX-License-Identifier: Apache-2.0

"""
Run the whole ROS graph in one process, with the real node classes, one executor and real DDS.

The stand-ins for turtlesim and robot_state_publisher also run in this process. If the real
packages are installed, their programs replace the stand-ins and run in separate processes.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from gc import freeze
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
from turtle_graph.client.processes import close_all, Process
from turtle_graph.client.spinning import Spinner
import xacro
import yaml

REMOVE_TIMEOUT = 15.0
"""Timeout (s) for removing a node from the executor."""

AnyNode = TypeVar('AnyNode', bound=Node)


def executable(package: str, name: str) -> str:
    """Return the path of an executable in a package, or raise PackageNotFoundError."""
    try:
        return str(Path(get_package_prefix(package), 'lib', package, name))
    except PackageNotFoundError:
        raise PackageNotFoundError(f'the package {package} is not installed') from None


class Graph(Spinner, AbstractContextManager['Graph']):
    """Graph of nodes that run in one process and communicate with all nodes in a ROS domain."""

    def __init__(self, domain_id: int | None = None, namespace: str = '',
                 quiet: bool = False, tf_inside: bool = False) -> None:
        """
        Create an empty graph in a given ROS domain, by default the domain in ROS_DOMAIN_ID.

        :param quiet: whether the nodes log only warnings and errors
        :param tf_inside: whether the namespace of the graph also applies to /tf and /tf_static
        """
        # Without freeze(), garbage collection of all existing objects could pause all nodes.
        freeze()
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

    def __exit__(self, *_: object) -> None:
        close_all(self._processes)
        self.executor.shutdown()
        for node in self.nodes:
            node.destroy_node()
        self.context.try_shutdown()
        self._files.cleanup()

    def add(self, node_type: type[AnyNode], *ros_arguments: str, parameters: bool = True,
            **options: Any) -> AnyNode:
        """
        Add a node and pass `options` to its constructor.

        :param ros_arguments: arguments after --ros-args, such as '-r', 'cmd_vel:=turtle1/cmd_vel'
        :param parameters: whether the node receives the parameter file
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
        """Remove a node from the graph and destroy the node."""
        self.nodes.remove(node)
        self.executor.remove_node(node)
        # The executor removes the node in its next cycle.
        self.spin_until(self.executor.create_task(lambda: None).done, REMOVE_TIMEOUT,
                        'the executor has removed the node')
        node.destroy_node()

    def add_turtlesim(self) -> Node | None:
        """Add a holonomic turtlesim to the graph, and return the node of the stand-in, if used."""
        return self._add_node_or_process('turtlesim', 'turtlesim_node', 'turtlesim_standin.node',
                                         'TurtleSimNode', {'holonomic': True})

    def add_robot_state_publisher(self) -> Node | None:
        """Add robot_state_publisher to the graph, and return the node of the stand-in, if used."""
        return self._add_node_or_process(
            'robot_state_publisher', 'robot_state_publisher', 'robot_state_publisher.node',
            'RobotStatePublisher', self.robot_parameters())

    def robot_parameters(self) -> dict[str, Any]:
        """Return the parameters that the launch files set for robot_state_publisher."""
        path = self.params_file.parents[1] / 'urdf' / 'turtle.urdf.xacro'
        urdf = xacro.process_file(str(path), mappings={'params_file': str(self.params_file)})
        return {'robot_description': urdf.toxml(), 'ignore_timestamp': True}

    def add_robot(self) -> TurtleRobot:
        """Add turtle_robot and connect it to turtlesim, as in the launch files."""
        return self.add(TurtleRobot, '-r', 'cmd_vel:=turtle1/cmd_vel')

    def add_arena(self) -> Arena:
        return self.add(Arena)

    def add_catcher(self) -> CatcherNode:
        return self.add(CatcherNode)

    def add_process(self, package: str, name: str, *arguments: str,
                    listener: Callable[[str], object] = sys.stderr.write) -> Process:
        """Start an installed executable and pass each printed line to a listener."""
        ros_arguments = ['--ros-args', *self._log_level, *self._remaps]
        if self.namespace:
            # rclcpp nodes require a leading slash in the namespace.
            ros_arguments += ['-r', f'__ns:=/{self.namespace.lstrip("/")}']
        domain = {} if self.domain_id is None else {'ROS_DOMAIN_ID': str(self.domain_id)}
        command = [executable(package, name), *arguments, *ros_arguments]
        process = Process(command, domain, listener)
        self._processes.append(process)
        return process

    def spin_once(self) -> None:
        """Execute pending callbacks, or raise RuntimeError if a process of the graph has ended."""
        super().spin_once()
        for process in self._processes:
            if not process.running:
                raise RuntimeError(process.exit_message(count=1))

    def parameter_file(self, parameters: dict[str, Any]) -> Path:
        """Write parameters to a temporary file and return its path."""
        path = Path(self._files.name, f'{len(os.listdir(self._files.name))}.yaml')
        path.write_text(yaml.safe_dump({'/**': {'ros__parameters': parameters}}), encoding='utf-8')
        return path

    def _add_node_or_process(self, package: str, executable: str, module: str, node_type: str,
                             parameters: dict[str, Any]) -> Node | None:
        # A URDF is too complex for a parameter value on the command line.
        arguments = ['--params-file', str(self.parameter_file(parameters))]
        if find_spec(module.partition('.')[0]) is not None:
            stand_in = getattr(importlib.import_module(module), node_type)
            return self.add(stand_in, *arguments, parameters=False)
        self.add_process(package, executable, '--ros-args', *arguments)
        return None
