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
"""The verbs that describe the ROS graph, and the node that all verbs use to join the graph."""

import contextlib
import ctypes
from functools import partial, reduce
from itertools import zip_longest
import os
import re
import signal
import sys
from time import CLOCK_MONOTONIC, monotonic

from rcl_interfaces import srv
from rcl_interfaces.msg import Parameter
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node, NodeNameNonExistentError
import rclpy.parameter as ros_parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden
import yaml

SPIN_TIME = 0.02
"""Maximum duration (s) of a spin. Signals and conditions are checked after every spin."""

KNOWN, FOUND, MISSING, LIMIT = 40, 25, 100, 400
"""
Time limits for discovery, counted in spins because each spin takes longer on a busy machine.

Participants announce themselves every 0.3 s (fastdds.xml) and when a new participant appears.
Discovery ends when the graph is complete and has not changed for KNOWN spins, or FOUND spins if a
command requires only one node, topic or service. If the graph is incomplete or nothing is found,
discovery ends after MISSING spins without a change. Discovery never takes more than LIMIT spins.
"""

SERVICE_TIMEOUT = 5.0
"""Timeout (s) for the discovery of a parameter service and for the service response."""

LEAVE_TIMEOUT = 10
"""Timeout (s) for leaving the graph. Fast DDS hangs at the end of 1 in 700 commands."""

TYPES = ('not set', 'boolean', 'integer', 'double', 'string', 'byte array', 'boolean array',
         'integer array', 'double array', 'string array')
"""Names of parameter types, indexed by the constants in rcl_interfaces/msg/ParameterType."""


joined: list['GraphNode'] = []
"""List that contains the node of this command until leave() destroys the node."""

_signals: list[int] = []
"""Received signal numbers, stored because rclpy may lose exceptions raised in signal handlers."""


class GraphNode(Node):
    """A node for one command. The node stops spinning after Ctrl-C or SIGTERM."""

    def __init__(self, name):
        """Create the node, which is hidden unless a name is given."""
        super().__init__(name or f'_ros2cli_{os.getpid()}', start_parameter_services=bool(name))
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)
        _signals.clear()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda number, _: _signals.append(int(number)))

    def destroy_node(self):
        self._executor.shutdown()
        super().destroy_node()

    def spin_until(self, condition, timeout=float('inf')):
        """Spin until a condition is true or a timeout (s) expires. Return False on timeout."""
        deadline = monotonic() + timeout
        while not condition():
            if monotonic() >= deadline:
                return False
            self._spin_once()
        return True

    def _spin_once(self):
        self._executor.spin_once(timeout_sec=SPIN_TIME)
        if _signals:
            raise KeyboardInterrupt(_signals.pop(0))

    def result(self, future):
        """Spin until a future is done, and return its result."""
        self.spin_until(future.done)
        return future.result()

    def discover(self, found=None):
        """Spin until the graph (or found(self), if `found` is given) no longer changes."""
        state, unchanged = None, 0
        for _ in range(LIMIT):
            previous, state = state, found(self) if found else (
                self.node_names(), self.topic_types(), self.service_types())
            unchanged = unchanged + 1 if state == previous else 0
            exists, duration = (state, FOUND) if found else (state[0], KNOWN)
            required = duration if exists else MISSING
            if unchanged >= required and (unchanged >= MISSING or is_complete(self)):
                return
            self._spin_once()

    def node_names(self, hidden=False):
        """Return the sorted full names of the nodes."""
        return sorted(f'{namespace.rstrip("/")}/{name}'
                      for name, namespace in self.get_node_names_and_namespaces()
                      if hidden or not name.startswith('_'))

    def topic_types(self, hidden=True):
        return visible(self.get_topic_names_and_types(), hidden)

    def service_types(self, hidden=True):
        return visible(self.get_service_names_and_types(), hidden)


def is_complete(graph):
    """Return whether all services and the nodes of all DDS participants have been discovered."""
    known = participants(graph.get_publishers_info_by_topic('ros_discovery_info', no_mangle=True))
    named = participants(end for end in graph.get_publishers_info_by_topic('/parameter_events')
                         if not end.node_name.startswith('_NODE_NAME_UNKNOWN_'))
    if not known <= named:
        return False
    try:
        return all(has_all_services(graph, *node)
                   for node in graph.get_node_names_and_namespaces())
    except NodeNameNonExistentError:  # A node has just left the graph.
        return False


def participants(publishers):
    """Return the identifiers of the DDS participants that own the given publishers."""
    return {bytes(publisher.endpoint_gid)[:12] for publisher in publishers}


def has_all_services(graph, name, namespace):
    """Return whether each service of a node has a request topic and a response topic."""
    written, read = (
        {match[1] for topic, _ in get(name, namespace, no_demangle=True)
         if (match := re.fullmatch('r[qr](/.*)(Request|Reply)', topic))}
        for get in (graph.get_publisher_names_and_types_by_node,
                    graph.get_subscriber_names_and_types_by_node))
    return written == read and (bool(written) or name.startswith('_'))


@contextlib.contextmanager
def open_graph(found=None, name=None, ros_args=()):
    """Yield a node that has discovered the graph. This node exists until leave() is called."""
    rclpy.init(args=['--ros-args', *ros_args], signal_handler_options=SignalHandlerOptions.NO)
    joined.append(GraphNode(name))
    joined[-1].discover(found)
    yield joined[-1]


def leave(status):
    """Leave the graph, or end this process with a given status if Fast DDS blocks."""
    while joined:
        exit_after(LEAVE_TIMEOUT, status)
        joined.pop().destroy_node()
        rclpy.try_shutdown()


def exit_after(seconds, status):
    """End this process after a timeout (s), even if C++ code blocks all Python threads."""
    libc, timer = ctypes.CDLL('librt.so.1'), ctypes.c_void_p()  # Loading librt also loads libc.
    # When the timer expires, call _exit(status) in a new thread (SIGEV_THREAD = 2).
    event = (ctypes.c_int64 * 8)(status, 2 << 32, ctypes.cast(
        libc._exit, ctypes.c_void_p).value)
    libc.timer_create(CLOCK_MONOTONIC, event, ctypes.byref(timer))
    time = divmod(int(seconds * 1e9), 10 ** 9)
    libc.timer_settime(timer, 0, (ctypes.c_int64 * 4)(0, 0, *time), None)


def visible(names_and_types, hidden):
    """Return topic or service types keyed by name, including hidden names if `hidden` is true."""
    return {name: types for name, types in names_and_types
            if hidden or not topic_or_service_is_hidden(name)}


def node_list(args):
    with open_graph() as graph:
        names = graph.node_names(args.all)
    if args.count_nodes:
        return print(len(names))
    if len(set(names)) < len(names):
        print('WARNING: Be aware that there are nodes in the graph that share an exact name, '
              'which can have unintended side effects.', file=sys.stderr)
    for name in names:
        print(name)


def node_info(args):
    from rclpy import action  # rclpy.action is slow to import and is used only here.

    def exists(graph):
        return args.node_name in graph.node_names(args.include_hidden)

    with open_graph(exists) as graph:
        if not exists(graph):
            return f"Unable to find node '{args.node_name}'"
        namespace, _, name = args.node_name.rpartition('/')
        print(args.node_name)
        for heading, names_and_types in (
                ('Subscribers', graph.get_subscriber_names_and_types_by_node),
                ('Publishers', graph.get_publisher_names_and_types_by_node),
                ('Service Servers', graph.get_service_names_and_types_by_node),
                ('Service Clients', graph.get_client_names_and_types_by_node),
                ('Action Servers', partial(
                    action.get_action_server_names_and_types_by_node, graph)),
                ('Action Clients', partial(
                    action.get_action_client_names_and_types_by_node, graph))):
            print(f'  {heading}:')
            found = visible(names_and_types(name, namespace or '/'), args.include_hidden)
            print(*(f'    {name}: {", ".join(types)}' for name, types in found.items()), sep='\n')


def print_names(get_types, args):
    """Print the names of all topics, services or actions, or only of those with a given type."""
    with open_graph() as graph:
        found = {name: types for name, types in get_types(
            graph, getattr(args, 'hidden', False)).items()
                 if getattr(args, 'type', None) in (None, *types)}
    if args.count:
        return print(len(found))
    for name, types in found.items():
        print(f'{name} [{", ".join(types)}]' if getattr(args, 'show_types', False) else name)


def action_types(graph, hidden):
    from rclpy.action import get_action_names_and_types  # This import is slow.
    return dict(get_action_names_and_types(graph))


action_list = partial(print_names, action_types)
service_find = service_list = partial(print_names, GraphNode.service_types)
topic_find = partial(print_names, GraphNode.topic_types)


def topic_list(args):
    if args.count or not args.verbose:
        return topic_find(args)
    with open_graph() as graph:
        for heading, end, get_count in (('Published', 'publisher', graph.count_publishers),
                                        ('Subscribed', 'subscriber', graph.count_subscribers)):
            print(f'{heading} topics:')
            for name, types in graph.topic_types(args.hidden).items():
                if count := get_count(name):
                    print(f' * {name} [{", ".join(types)}] {count} {end}{"s" * (count > 1)}')
            print()


def print_type(get_types, option, args):
    """Print the types of a topic or service, and return 1 if there are none."""
    name, hidden = getattr(args, option), getattr(args, 'hidden', False)
    with open_graph(lambda graph: get_types(graph, True).get(name)) as graph:
        types = get_types(graph, hidden).get(name, ())
    for each in types:
        print(each)
    return 0 if types else 1


action_type = partial(print_type, action_types, 'action_name')
service_type = partial(print_type, GraphNode.service_types, 'service_name')
topic_type = partial(print_type, GraphNode.topic_types, 'topic_name')


def action_info(args):
    from rclpy import action  # This import is slow.

    print(f'Action: {args.action_name}')
    with open_graph(lambda graph: args.action_name in action_types(graph, True)) as graph:
        for heading, get_types in (
                ('clients', action.get_action_client_names_and_types_by_node),
                ('servers', action.get_action_server_names_and_types_by_node)):
            found = [(f'{namespace.rstrip("/")}/{name}', types)
                     for name, namespace in graph.get_node_names_and_namespaces()
                     for action_name, types in get_types(graph, name, namespace)
                     if action_name == args.action_name]
            print(f'Action {heading}: {len(found)}')
            for node, types in () if args.count else found:
                print(f'    {node} [{", ".join(types)}]' if args.show_types else f'    {node}')


def service_info(args):
    name = args.service_name
    with open_graph(lambda graph: name in graph.service_types() and (
            graph.count_clients(name), graph.count_services(name))) as graph:
        types = graph.service_types().get(name)
        if types is None:
            return f"Unknown service '{name}'"
        print('Type:', types[0] if len(types) == 1 else types)
        print('Clients count:', graph.count_clients(name))
        print('Services count:', graph.count_services(name))


def topic_info(args):
    name, gap = args.topic_name, '\n\n' if args.verbose else '\n'
    with open_graph(lambda graph: name in graph.topic_types() and (
            graph.count_publishers(name), graph.count_subscribers(name))) as graph:
        types = graph.topic_types().get(name)
        if types is None:
            return f"Unknown topic '{name}'"
        print('Type:', types[0] if len(types) == 1 else types, end=gap)
        for kind, count, ends in (
                ('Publisher', graph.count_publishers, graph.get_publishers_info_by_topic),
                ('Subscription', graph.count_subscribers, graph.get_subscriptions_info_by_topic)):
            print(f'{kind} count: {count(name)}', end=gap)
            for info in ends(name) if args.verbose else ():
                print(info, end=gap)


def matching_nodes(graph, args):
    """Return the names of the nodes that match args.node_name (default: all nodes)."""
    return [name for name in dict.fromkeys(graph.node_names(args.include_hidden_nodes))
            if args.node_name in (None, name, name[1:])]


def call_parameter_service(graph, node, service, **request):
    """Call a parameter service of a node and return the response."""
    kind = getattr(srv, service.title().replace('_', ''))
    client = graph.create_client(kind, f'{node}/{service}')
    if not graph.spin_until(client.service_is_ready, SERVICE_TIMEOUT):
        raise RuntimeError(
            f'Wait for service timed out waiting for parameter services for node {node}')
    future = client.call_async(kind.Request(**request))
    if not graph.spin_until(future.done, SERVICE_TIMEOUT):
        raise RuntimeError(f'Exception while calling service of node {node}: no answer')
    return future.result()


@contextlib.contextmanager
def parameter_services(args):
    """Yield a function that calls a parameter service of the selected node."""
    with open_graph(lambda graph: matching_nodes(graph, args)) as graph:
        if not graph.spin_until(lambda: matching_nodes(graph, args), args.timeout):
            raise RuntimeError('Node not found')
        yield partial(call_parameter_service, graph, matching_nodes(graph, args)[0])


def param_list(args):
    with open_graph(lambda graph: matching_nodes(graph, args)) as graph:
        if args.node_name and not matching_nodes(graph, args):
            return 'Node not found'
        for node in matching_nodes(graph, args):
            try:
                names = call_parameter_service(graph, node, 'list_parameters',
                                               prefixes=args.param_prefixes).result.names
            except RuntimeError as error:
                print(error)
                continue
            names = sorted(filter(re.compile(args.filter).match, names))
            if names and not args.node_name:
                print(f'{node}:')
            kinds = [f' (type: {TYPES[each.type]})' for each in call_parameter_service(
                graph, node, 'describe_parameters', names=names).descriptors
                if args.param_type]
            for name, kind in zip_longest(names, kinds, fillvalue=''):
                print(f'  {name}{kind}')


def param_get(args):
    with parameter_services(args) as call:
        values = call('get_parameters', names=[args.parameter_name]).values
    if not values:
        return 'Parameter not set'
    value = ros_parameter.parameter_value_to_python(values[0])
    kind, _, array = TYPES[values[0].type].capitalize().partition(' ')
    if args.hide_type:
        print(value)
    elif value is None:
        print('Parameter not set.')
    else:
        print(f'{kind} {"values are" if array else "value is"}: {value}')


def param_dump(args):
    tree = {}
    with parameter_services(args) as call:
        names = sorted(call('list_parameters').result.names)
        for name, value in zip(names, call('get_parameters', names=names).values):
            *groups, name = name.split('.')
            group = reduce(lambda outer, inner: outer.setdefault(inner, {}), groups, tree)
            group[name] = ros_parameter.parameter_value_to_python(value)
    print(yaml.dump({f'/{args.node_name.lstrip("/")}': {'ros__parameters': tree}}))


def set_parameters(args, parameters, succeeded, failed):
    """Set parameters of the selected node and print the result for each parameter."""
    with parameter_services(args) as call:
        results = call('set_parameters', parameters=parameters).results
    for parameter, result in zip(parameters, results):
        text = (succeeded if result.successful else failed).format(parameter.name)
        print(text, end=f': {result.reason}\n' if result.reason else '\n',
              file=sys.stdout if result.successful else sys.stderr)


def param_set(args):
    value = ros_parameter.get_parameter_value(string_value=args.value)
    set_parameters(args, [Parameter(name=args.parameter_name, value=value)],
                   'Set parameter successful', 'Setting parameter failed')


def param_delete(args):
    set_parameters(args, [Parameter(name=args.parameter_name)],
                   'Deleted parameter successfully', 'Deleting parameter failed')


def param_load(args):
    parameters = ros_parameter.parameter_dict_from_yaml_file(
        args.parameter_file, not args.no_use_wildcard)
    set_parameters(args, list(parameters.values()), 'Set parameter {} successful',
                   'Set parameter {} failed')


def param_describe(args):
    with parameter_services(args) as call:
        descriptors = call('describe_parameters', names=args.parameter_names).descriptors
    for each in descriptors:
        limits = [*each.floating_point_range, *each.integer_range][:1]
        for text, value in (
                ('Parameter name:', each.name), ('  Type:', TYPES[each.type]),
                ('  Description:', each.description or None), ('  Constraints:', ''),
                ('    Read only:', 'true' if each.read_only else None),
                *(('    Min value:', limit.from_value) for limit in limits),
                *(('    Max value:', limit.to_value) for limit in limits),
                *(('    Step:', limit.step or None) for limit in limits),
                ('    Additional constraints:', each.additional_constraints or None)):
            if value is not None:
                print(f'{text} {value}'.rstrip())
