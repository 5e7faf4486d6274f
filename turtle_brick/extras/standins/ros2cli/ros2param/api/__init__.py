# SPDX-License-Identifier: Apache-2.0
"""Functions that several verbs of `ros2 param` use."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
import contextlib
from functools import partial
import sys
from typing import Any

from rcl_interfaces import srv
from rcl_interfaces.msg import Parameter
from ros2cli.helpers import complete_with
from ros2cli.node import direct, strategy
from ros2node.api import complete_node_name

SERVICE_TIMEOUT = 5.0
"""Timeout (s) for the discovery of a parameter service and for the service response."""

TYPE_NAMES = ('not set', 'boolean', 'integer', 'double', 'string', 'byte array', 'boolean array',
              'integer array', 'double array', 'string array')
"""Names of parameter types, indexed by the constants in rcl_interfaces/msg/ParameterType."""


def add_node_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the verbs for a single node."""
    strategy.add_arguments(parser)
    node_name = parser.add_argument('node_name', help='Name of the ROS node')
    complete_with(node_name, complete_node_name)
    parser.add_argument(
        '--include-hidden-nodes', action='store_true',
        help='Consider hidden nodes as well')
    parser.add_argument(
        '--timeout', metavar='N', type=int, default=1,
        help='Wait for N seconds until node becomes available (default %(default)s sec)')


def matching_nodes(graph: direct.GraphNode, node_name: str | None, hidden: bool) -> list[str]:
    """Return the names of the nodes that match a name (default: all nodes)."""
    return [name for name in dict.fromkeys(graph.node_names(hidden))
            if node_name in (None, name, name[1:])]


def call_parameter_service(graph: direct.GraphNode, node: str, service: str,
                           **request: Any) -> Any:
    """
    Call a parameter service of a node and return the response.

    :raises RuntimeError: if the node does not respond
    """
    service_type = getattr(srv, service.title().replace('_', ''))
    client = graph.create_client(service_type, f'{node}/{service}')
    if not graph.spin_until(client.service_is_ready, SERVICE_TIMEOUT):
        raise RuntimeError(
            f'Wait for service timed out waiting for parameter services for node {node}')
    future = client.call_async(service_type.Request(**request))
    if not graph.spin_until(future.done, SERVICE_TIMEOUT):
        raise RuntimeError(f'Exception while calling service of node {node}: no answer')
    return future.result()


@contextlib.contextmanager
def parameter_services(args: argparse.Namespace) -> Iterator[Callable[..., Any]]:
    """
    Yield a function that calls a parameter service of the selected node.

    :raises RuntimeError: if there is no such node
    """
    def find(graph: direct.GraphNode) -> list[str]:
        return matching_nodes(graph, args.node_name, args.include_hidden_nodes)

    with direct.open_graph(find) as graph:
        if not graph.spin_until(lambda: find(graph), args.timeout):
            raise RuntimeError('Node not found')
        yield partial(call_parameter_service, graph, find(graph)[0])


def set_parameters(args: argparse.Namespace, parameters: Sequence[Parameter], succeeded: str,
                   failed: str) -> None:
    """
    Set parameters of the selected node and print the result for each parameter.

    :param succeeded: message in which {} stands for the name of the parameter
    :param failed: message in which {} stands for the name of the parameter
    """
    with parameter_services(args) as call:
        results = call('set_parameters', parameters=parameters).results
    for parameter, result in zip(parameters, results):
        text = (succeeded if result.successful else failed).format(parameter.name)
        print(text, end=f': {result.reason}\n' if result.reason else '\n',
              file=sys.stdout if result.successful else sys.stderr)


def complete_parameter_name(prefix: str, parsed_args: argparse.Namespace,
                            **kwargs: object) -> list[str]:
    """Return the names of the parameters of the node on the command line."""
    def find(graph: direct.GraphNode) -> list[str]:
        return matching_nodes(graph, parsed_args.node_name, hidden=True)

    with direct.open_graph(find) as graph:
        return [name for node in find(graph)
                for name in call_parameter_service(graph, node, 'list_parameters').result.names]
