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
"""The verbs that list and describe the graph, and the node with which every verb sees it."""

import contextlib
from functools import partial, reduce
import os
import re
import signal
import sys
from time import monotonic

from rcl_interfaces import srv
from rcl_interfaces.msg import Parameter
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node, NodeNameNonExistentError
import rclpy.parameter as ros_parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden
from ros2cli.cli import undisturbed
import yaml

# How long (s) a Ctrl-C waits at most, which the middleware would miss.
GLANCE = 0.02

# Participants announce themselves every 0.3 s (fastdds.xml) and when a new one appears, so the
# graph is known when nothing in it lacks its other half, and nothing has changed for longer than
# that. What the user asks for is found sooner if it is there. Counted in glances, of which a busy
# machine makes fewer in a second.
KNOWN, FOUND, MISSING, LIMIT = 40, 25, 100, 400

# Topics of every node, also of other commands that come and go.
COMMON = ('/rosout', '/parameter_events')

# How long (s) a parameter service may take to be there, and to answer.
TIMEOUT = 5.0

# By the constants of rcl_interfaces/msg/ParameterType.
TYPES = ('not set', 'boolean', 'integer', 'double', 'string', 'byte array', 'boolean array',
         'integer array', 'double array', 'string array')


class Observer(Node):
    """A hidden node, and what it sees of the graph."""

    def __init__(self, name):
        """Enter the graph."""
        super().__init__(name or f'_ros2cli_{os.getpid()}', start_parameter_services=bool(name))
        self._spinner = SingleThreadedExecutor()
        self._spinner.add_node(self)

    def spin_until(self, condition, timeout=float('inf')):
        """Spin until a condition holds, at most for a time (s); return whether it holds."""
        deadline = monotonic() + timeout
        while not condition():
            if monotonic() >= deadline:
                return False
            self._glance()
        return True

    def _glance(self):
        """Do what has come, or wait a little; what rclpy ends meanwhile may lose a Ctrl-C."""
        with undisturbed():
            self._spinner.spin_once(timeout_sec=GLANCE)

    def discover(self, found=None):
        """Wait until the graph is known, or until what the user asks for is found."""
        seen = quiet = None
        for glance in range(LIMIT):
            before, seen = seen, (
                self.node_names(), self.get_service_names_and_types(),
                [(name, self.count_publishers(name), self.count_subscribers(name))
                 for name, _ in self.get_topic_names_and_types() if name not in COMMON])
            quiet = quiet + 1 if seen == before else 0
            missing = not seen[0] or found and not found(self)
            if quiet >= (FOUND if found else KNOWN) and (
                    glance >= MISSING or not missing) and (
                    quiet >= MISSING or self.is_whole()):
                return
            self._glance()

    def is_whole(self):
        """Tell whether all participants have named their nodes, and each node its services."""
        def participants(topic, **options):
            return {bytes(end.endpoint_gid)[:12]
                    for end in self.get_publishers_info_by_topic(topic, **options)
                    if options or not end.node_name.startswith('_NODE_NAME_UNKNOWN_')}

        def halves(names_and_types, *node):
            found = (re.fullmatch('r[qr](/.*)(Request|Reply)', name)
                     for name, _ in names_and_types(*node, no_demangle=True))
            return {match[1] for match in found if match}

        if not participants('ros_discovery_info', no_mangle=True) <= (
                participants('/parameter_events')):
            return False
        try:
            for node in self.get_node_names_and_namespaces():
                written = halves(self.get_publisher_names_and_types_by_node, *node)
                if written != halves(self.get_subscriber_names_and_types_by_node, *node) or (
                        not written and node[0][0] != '_'):
                    return False
        except NodeNameNonExistentError:  # it has gone meanwhile
            return False
        return True

    def node_names(self, hidden=False):
        """Return the full names of all nodes, sorted."""
        return sorted(f'{namespace.rstrip("/")}/{name}'
                      for name, namespace in self.get_node_names_and_namespaces()
                      if hidden or not name.startswith('_'))

    def topic_types(self, hidden=True):
        """Return the types of all topics by their names."""
        return visible(self.get_topic_names_and_types(), hidden)

    def service_types(self, hidden=True):
        """Return the types of all services by their names."""
        return visible(self.get_service_names_and_types(), hidden)


@contextlib.contextmanager
def observer(found=None, name=None, ros_args=()):
    """Enter the graph, wait until it is known, and leave it afterwards."""
    try:
        with undisturbed():
            rclpy.init(args=['--ros-args', *ros_args],
                       signal_handler_options=SignalHandlerOptions.NO)
            graph = Observer(name)
        graph.discover(found)
        yield graph
    finally:
        signal.alarm(4)  # Fast DDS may wait for ever
        rclpy.try_shutdown()


def visible(names_and_types, hidden):
    """Return types by name, without hidden names if these are not wanted."""
    return {name: types for name, types in names_and_types
            if hidden or not topic_or_service_is_hidden(name)}


def node_list(args):
    """Print the names of the nodes."""
    with observer() as graph:
        names = graph.node_names(args.all)
    if args.count_nodes:
        return print(len(names))
    if len(set(names)) < len(names):
        print('WARNING: Be aware that there are nodes in the graph that share an exact name, '
              'which can have unintended side effects.', file=sys.stderr)
    for name in names:
        print(name)


def node_info(args):
    """Print what a node publishes, subscribes to, serves and calls."""
    # Not at the top, since it takes a while and no other verb needs it.
    from rclpy import action

    def there(graph):
        return args.node_name in graph.node_names(args.include_hidden)

    with observer(there) as graph:
        if not there(graph):
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
            found = visible(names_and_types(name, namespace or '/'), args.include_hidden)
            print(f'  {heading}:')
            print(*(f'    {name}: {", ".join(types)}' for name, types in found.items()), sep='\n')


def print_names(names, args):
    """Print the names of topics or services, of one type if it is given, or how many there are."""
    with observer() as graph:
        found = {name: types for name, types in names(graph, args.hidden).items()
                 if getattr(args, 'type', None) in (None, *types)}
    if args.count:
        return print(len(found))
    for name, types in found.items():
        print(f'{name} [{", ".join(types)}]' if getattr(args, 'show_types', 0) else name)


service_find = service_list = partial(print_names, Observer.service_types)
topic_find = partial(print_names, Observer.topic_types)


def topic_list(args):
    """Print the names of the topics."""
    if args.count or not args.verbose:
        return topic_find(args)
    with observer() as graph:
        for what, end, count in (('Published', 'publisher', graph.count_publishers),
                                 ('Subscribed', 'subscriber', graph.count_subscribers)):
            print(f'{what} topics:')
            for name, types in graph.topic_types(args.hidden).items():
                if count(name):
                    print(f' * {name} [{", ".join(types)}] {count(name)} {end}'
                          + 's' * (count(name) > 1))
            print()


def print_type(names, name, args):
    """Print the types that a topic or service has; the status tells whether it is there."""
    name = getattr(args, name)
    with observer(lambda graph: name in names(graph)) as graph:
        types = names(graph, args.hidden).get(name, ())
    for each in types:
        print(each)
    return 0 if types else 1


service_type = partial(print_type, Observer.service_types, 'service_name')
topic_type = partial(print_type, Observer.topic_types, 'topic_name')


def topic_info(args):
    """Print the type of a topic, and who publishes and subscribes to it."""
    name, gap = args.topic_name, '\n\n' if args.verbose else '\n'
    with observer(lambda graph: name in graph.topic_types()) as graph:
        types = graph.topic_types().get(name)
        if types is None:
            return f"Unknown topic '{name}'"
        print('Type:', types[0] if len(types) == 1 else types, end=gap)
        for what, count, ends in (
                ('Publisher', graph.count_publishers, graph.get_publishers_info_by_topic),
                ('Subscription', graph.count_subscribers, graph.get_subscriptions_info_by_topic)):
            print(f'{what} count: {count(name)}', end=gap)
            for info in ends(name) if args.verbose else ():
                print(info, end=gap)


def wanted(graph, args):
    """Return the names of the nodes whose parameters the command line means."""
    return [name for name in dict.fromkeys(graph.node_names(args.include_hidden_nodes))
            if args.node_name in (None, name, name[1:])]


def ask(graph, node, service, **request):
    """Return what a parameter service of a node answers."""
    kind = getattr(srv, service.title().replace('_', ''))
    client = graph.create_client(kind, f'{node}/{service}')
    if not graph.spin_until(client.service_is_ready, TIMEOUT):
        raise RuntimeError(
            f'Wait for service timed out waiting for parameter services for node {node}')
    future = client.call_async(kind.Request(**request))
    if not graph.spin_until(future.done, TIMEOUT):
        raise RuntimeError(f'Exception while calling service of node {node}: no answer')
    return future.result()


@contextlib.contextmanager
def asking(args):
    """Enter the graph; give what asks the parameter services of the node on the command line."""
    with observer(lambda graph: wanted(graph, args)) as graph:
        if not graph.spin_until(lambda: wanted(graph, args), args.timeout):
            raise RuntimeError('Node not found')
        yield partial(ask, graph, wanted(graph, args)[0])


def param_list(args):
    """Print the names of the parameters of a node, or of all."""
    with observer(lambda graph: wanted(graph, args)) as graph:
        if args.node_name and not wanted(graph, args):
            return 'Node not found'
        for node in wanted(graph, args):
            try:
                names = ask(graph, node, 'list_parameters',
                            prefixes=args.param_prefixes).result.names
            except RuntimeError as error:
                print(error)
                continue
            if names and not args.node_name:
                print(f'{node}:')
            for name in sorted(names):
                print(f'  {name}')


def param_get(args):
    """Print the value of a parameter."""
    with asking(args) as answer:
        values = answer('get_parameters', names=[args.parameter_name]).values
    if not values:
        return 'Parameter not set'
    value = ros_parameter.parameter_value_to_python(values[0])
    kind, _, array = TYPES[values[0].type].capitalize().partition(' ')
    label = f'{kind} {"values are" if array else "value is"}: {value}'
    print(value if args.hide_type else 'Parameter not set.' if value is None else label)


def param_dump(args):
    """Print the parameters of a node as a parameter file."""
    tree = {}
    with asking(args) as answer:
        names = sorted(answer('list_parameters').result.names)
        for name, value in zip(names, answer('get_parameters', names=names).values):
            *groups, name = name.split('.')
            reduce(lambda group, inner: group.setdefault(inner, {}), groups, tree)[name] = (
                ros_parameter.parameter_value_to_python(value))
    print(yaml.dump({f'/{args.node_name.lstrip("/")}': {'ros__parameters': tree}}))


def param_set(args):
    """Set a parameter."""
    value = ros_parameter.get_parameter_value(string_value=args.value)
    with asking(args) as answer:
        result, = answer('set_parameters', parameters=[
            Parameter(name=args.parameter_name, value=value)]).results
    print('Set parameter successful' if result.successful else 'Setting parameter failed',
          end=f': {result.reason}\n' if result.reason else '\n',
          file=sys.stdout if result.successful else sys.stderr)


def param_describe(args):
    """Print what a node tells about parameters."""
    with asking(args) as answer:
        descriptors = answer('describe_parameters', names=args.parameter_names).descriptors
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
