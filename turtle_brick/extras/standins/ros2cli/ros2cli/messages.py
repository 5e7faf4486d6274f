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
"""Verbs that send or receive messages, such as `service call` and `topic echo`."""

from array import array
from collections import deque
from functools import partial
from importlib import import_module
from itertools import pairwise
import re
import statistics
import sys

import numpy
from rclpy.duration import Duration
from rclpy.expand_topic_name import expand_topic_name
import rclpy.qos as ros_qos
from rclpy.time import Time
from ros2cli.graph import open_graph
import yaml


def interface(name, kind, problem):
    """Return the Python class of a ROS type. `std_msgs/String` means `std_msgs/msg/String`."""
    try:
        package, *middle, own_name = name.split('/')
        found = getattr(import_module('.'.join([package, *(middle or [kind])])), own_name)
    except (AttributeError, ImportError, TypeError, ValueError):
        raise RuntimeError(problem) from None
    if kind == 'msg' and not hasattr(found, 'SLOT_TYPES'):
        raise RuntimeError(problem)
    return found


def read_values(args):
    return yaml.safe_load(sys.stdin.read() if args.stdin else args.values)


def fill(message, values, stamps=None):
    """Set message fields, but add time fields with the value 'now' or 'auto' to `stamps`."""
    if not isinstance(values, dict):
        raise TypeError(f"Value '{values}' is expected to be a dictionary but is a "
                        f'{type(values).__name__}')
    for name, value in values.items():
        field = getattr(message, name)
        kind = type(field)
        item = re.search(r'\w+/\w+', message.get_fields_and_field_types()[name])
        if kind is array:
            value = array(field.typecode, value)
        elif kind is numpy.ndarray:
            value = numpy.array(value, dtype=field.dtype)
        elif stamps is not None and (kind.__name__, value) in (
                ('Header', 'auto'), ('Time', 'now')):
            stamps.append((field, 'stamp') if value == 'auto' else (message, name))
            continue
        elif hasattr(field, 'SLOT_TYPES'):
            fill(field, value, stamps)
            continue
        elif item:
            value = [(interface(item[0], 'msg', item[0])(), each) for each in value]
            for each in value:
                fill(*each, stamps)
            value = [each for each, _ in value]
        else:
            value = kind(value)
        setattr(message, name, value)


def filled(kind, values, stamps=None):
    """Return a message with the given field values."""
    message = kind()
    try:
        fill(message, values, stamps)
    except Exception as error:  # noqa: B902 -- a message can raise any exception
        raise RuntimeError(f'Failed to populate field: {error}') from None
    return message


class Fields(dict):
    """Message fields, which yaml.dump() writes in block style and in their original order."""


yaml.add_representer(Fields, lambda dumper, fields: dumper.represent_mapping(
    'tag:yaml.org,2002:map', fields.items(), flow_style=False))


def to_yaml(value, length=sys.maxsize, no_arrays=False, kind=None):
    """Convert a message or a field to objects for yaml.dump(). Long values may be shortened."""
    if hasattr(value, 'SLOT_TYPES'):
        return Fields((name, to_yaml(getattr(value, name), length, no_arrays, kind))
                      for name, kind in value.get_fields_and_field_types().items())
    value = value.decode('latin-1') if isinstance(value, bytes) else value
    if isinstance(value, str):
        return value if len(value) <= length else f'{value[:length]}...'
    value = value.tolist() if hasattr(value, 'tolist') else value
    if not isinstance(value, list):
        return value
    if no_arrays and kind:
        item, _, bound = kind.replace('/', '/msg/').rstrip('>').partition(', ')
        if '<' not in item:
            return f'<array type: {item}>'
        bound = f'[{bound}]' if bound else ''
        return f'<{item.replace("<", " type: ")}{bound}, length: {len(value)}>'
    items = [to_yaml(each, length, no_arrays) for each in value[:length]]
    return items if len(value) <= length else [*items, '...']


def to_csv(value):
    """Convert the result of to_yaml() to a string of comma-separated values."""
    if isinstance(value, (dict, list)):
        return ','.join(map(to_csv, value.values() if isinstance(value, dict) else value))
    return str(value)


def interface_proto(args):
    """Print the default values of a message, a service request or an action goal."""
    kind = interface(args.type, '', f"The interface '{args.type}' is invalid")
    text = yaml.dump(to_yaml(getattr(kind, 'Request', getattr(kind, 'Goal', kind))()))
    print(text if args.no_quotes else f'"{text}"')


def message_filter(text):
    """Return a function that evaluates a Python expression, in which `m` is the message."""
    def passes(m):
        try:
            return text is None or eval(text)
        except Exception as error:  # noqa: B902 -- the user's expression can raise any exception
            raise RuntimeError(f"Invalid filter '{text}': {error}") from None
    return passes


def topic_class(graph, topic):
    """Return the message class for a topic, or None if the topic does not exist."""
    name = expand_topic_name(topic, graph.get_name(), graph.get_namespace())
    types = graph.topic_types().get(name, ())
    return interface(
        types[0], 'msg', f"The message type '{types[0]}' is invalid") if types else None


def qos_profile(args, publishers=()):
    """Return the QoS profile from the options (default: one compatible with all publishers)."""
    qos = ros_qos.QoSPresetProfiles.get_from_short_key(args.qos_profile)
    chosen = {name[len('qos_'):]: value for name, value in vars(args).items()
              if name.startswith('qos_') and name != 'qos_profile' and value is not None}
    for name, value in chosen.items():
        if name != 'depth':
            value = getattr(ros_qos, f'{name.capitalize()}Policy').get_from_short_key(value)
        setattr(qos, name, value)
    for name, best, other in (('reliability', 'RELIABLE', 'BEST_EFFORT'),
                              ('durability', 'TRANSIENT_LOCAL', 'VOLATILE')):
        if publishers and not chosen:
            offers = {getattr(info.qos_profile, name).name for info in publishers}
            setattr(qos, name, getattr(ros_qos, f'{name.capitalize()}Policy')[
                best if offers == {best} else other])
    return qos


def topic_echo(args):
    passes, done = message_filter(args.filter_expr), False

    def on_message(message):
        nonlocal done
        for name in filter(None, (args.field or '').split('.')):
            try:
                message = getattr(message, name)
            except AttributeError as error:
                raise RuntimeError(f"Invalid field '{args.field}': {error}") from None
        if not passes(message) or (done and args.once):
            return
        done = True
        length = sys.maxsize if args.full_length else args.truncate_length
        fields = to_yaml(message, length, args.no_arr)
        if not hasattr(message, 'SLOT_TYPES'):
            print(message, end='\n---\n')
        elif args.csv:
            print(to_csv(fields))
        else:
            print(yaml.dump(fields, allow_unicode=True, width=sys.maxsize,
                            default_flow_style=args.flow_style), end='---\n')

    with open_graph(lambda graph: graph.count_publishers(args.topic_name)) as graph:
        kind = topic_class(graph, args.topic_name) if args.message_type is None else interface(
            args.message_type, 'msg', 'The passed message type is invalid')
        if kind is None:
            print(f'WARNING: topic [{args.topic_name}] does not appear to be published yet')
            return 'Could not determine the type for the passed topic'
        graph.create_subscription(
            kind, args.topic_name, on_message,
            qos_profile(args, graph.get_publishers_info_by_topic(args.topic_name)))
        graph.spin_until(lambda: done and args.once, args.timeout or float('inf'))


def topic_pub(args):
    kind = interface(args.message_type, 'msg', 'The passed message type is invalid')
    values, count, stamps = read_values(args), 0, []
    if not isinstance(values, dict):
        return 'The passed value needs to be a dictionary in YAML format'
    times, wanted = 1 if args.once else args.times, args.wait_matching_subscriptions
    wanted = int(times > 0) if wanted is None else wanted
    with open_graph(name=args.node_name) as graph:
        publisher = graph.create_publisher(kind, args.topic_name, qos_profile(args))
        graph.spin_until(lambda: publisher.get_subscription_count() >= graph.count_subscribers(
            args.topic_name), 1.0)
        while publisher.get_subscription_count() < wanted:
            print(f'Waiting for at least {wanted} matching subscription(s)...')
            graph.spin_until(lambda: publisher.get_subscription_count() >= wanted, 1.0)
        message = filled(kind, values, stamps)
        print('publisher: beginning loop')

        def publish():
            nonlocal count
            for owner, name in stamps:
                setattr(owner, name, graph.get_clock().now().to_msg())
            count += 1
            if args.print and count % args.print == 0:
                print(f'publishing #{count}: {message!r}\n')
            publisher.publish(message)

        publish()
        timer = graph.create_timer(1 / args.rate, publish)
        graph.spin_until(lambda: count == times)
        timer.cancel()
        publisher.wait_for_all_acked(Duration(seconds=1))  # Subscribers may be slow.
        graph.spin_until(lambda: False, args.keep_alive)


GOAL_STATES = ('UNKNOWN', 'ACCEPTED', 'EXECUTING', 'CANCELING', 'SUCCEEDED', 'CANCELED', 'ABORTED')
"""Names of goal states, indexed by the constants in action_msgs/msg/GoalStatus."""


def service_call(args):
    kind = interface(args.service_type, 'srv', 'The passed service type is invalid')
    if not hasattr(kind, 'Request'):
        return 'The passed type is not a service'
    request = filled(kind.Request, read_values(args))
    with open_graph(lambda _: True) as graph:
        client = graph.create_client(kind, args.service_name)
        if not graph.spin_until(client.service_is_ready, 1.0):
            print('waiting for service to become available...')
        graph.spin_until(client.service_is_ready)
        repeated = True
        while repeated:
            print(f'requester: making request: {request!r}\n')
            print(f'response:\n{graph.result(client.call_async(request))!r}\n')
            repeated = args.rate and not graph.spin_until(lambda: False, 1.0 / args.rate)


def action_send_goal(args):
    from rclpy.action import ActionClient  # This import is slow.

    def on_feedback(message):
        print(f'Feedback:\n    {yaml.dump(to_yaml(message.feedback))}')

    kind = interface(args.action_type, 'action', 'The passed action type is invalid')
    goal = filled(kind.Goal, read_values(args))
    with open_graph(lambda _: True) as graph:
        client = ActionClient(graph, kind, args.action_name)
        print('Waiting for an action server to become available...')
        graph.spin_until(client.server_is_ready)
        print(f'Sending goal:\n     {yaml.dump(to_yaml(goal))}')
        handle = graph.result(
            client.send_goal_async(goal, on_feedback if args.feedback else None))
        if not handle.accepted:
            return print('Goal was rejected.')
        print(f'Goal accepted with ID: {bytes(handle.goal_id.uuid).hex()}\n')
        try:
            response = graph.result(handle.get_result_async())
        except KeyboardInterrupt:
            print('Canceling goal...')
            graph.result(handle.cancel_goal_async())
            print('Goal canceled.')
            raise
        print(f'Result:\n    {yaml.dump(to_yaml(response.result))}')
        print('Goal finished with status:', GOAL_STATES[response.status])


def measure(sample, report, args, **options):
    """Print statistics about a topic's latest messages once per second."""
    passes = message_filter(getattr(args, 'filter_expr', None))
    samples, last = deque(maxlen=args.window_size + 1), None
    with open_graph(lambda graph: graph.count_publishers(args.topic_name)) as graph:
        def now():
            return graph.get_clock().now().nanoseconds * 1e-9

        def on_message(message):
            if passes(message):
                samples.append((now(), sample(message)))

        def on_timer():
            nonlocal last
            if len(samples) > 1:
                text = report(samples, args.window_size, now(), samples[-1] is not last)
                print(text, end='\n' if text else '')
                last = samples[-1]

        if not topic_class(graph, args.topic_name):
            print(f'WARNING: topic [{args.topic_name}] does not appear to be published yet')
        graph.spin_until(lambda: topic_class(graph, args.topic_name))
        graph.create_subscription(topic_class(graph, args.topic_name), args.topic_name,
                                  on_message, ros_qos.qos_profile_sensor_data, **options)
        if options:
            print(f'Subscribed to [{args.topic_name}]')
        graph.create_timer(1.0, on_timer)
        graph.spin_until(lambda: False)


def spread(durations):
    """Return a line with the minimum, maximum and standard deviation of durations (s)."""
    return (f'\n\tmin: {min(durations):.3f}s max: {max(durations):.3f}s '
            f'std dev: {statistics.pstdev(durations):.5f}s window: {len(durations)}')


def rate_report(samples, window, now, is_new):
    """Return a line with the average message rate, or '' if there are no new messages."""
    if not is_new:
        return ''
    periods = [end - start for (start, _), (end, _) in pairwise(samples)]
    return f'average rate: {1 / statistics.fmean(periods):.3f}{spread(periods)}'


def delay_report(samples, window, now, is_new):
    """Return a line with the average delay from the timestamp of a message to its reception."""
    if not is_new:
        return 'no new messages'
    delays = [time - stamp for time, stamp in samples][1:]
    return f'average delay: {statistics.fmean(delays):.3f}{spread(delays)}'


def bandwidth_report(samples, window, now, is_new):
    """Return a report on the data rate and the sizes of the latest messages."""
    times, sizes = zip(*list(samples)[-window:])
    bandwidth = sum(sizes) / (now - times[0])
    if bandwidth < 1e3:
        unit, text = 1, '{:.0f} B'
    elif bandwidth < 1e6:
        unit, text = 1e3, '{:.2f} KB'
    else:
        unit, text = 1e6, '{:.2f} MB'
    bandwidth, mean, least, most = (text.format(each / unit) for each in (
        bandwidth, statistics.fmean(sizes), min(sizes), max(sizes)))
    return (f'{bandwidth}/s from {len(sizes)} messages\n'
            f'\tMessage size mean: {mean} min: {least} max: {most}')


def header_stamp(message):
    """Return the timestamp (s) in the header of a message."""
    if not hasattr(message, 'header'):
        raise RuntimeError('msg does not have header')
    return Time.from_msg(message.header.stamp).nanoseconds * 1e-9


topic_hz = partial(measure, lambda _: None, rate_report)
topic_delay = partial(measure, header_stamp, delay_report)
topic_bw = partial(measure, len, bandwidth_report, raw=True)
