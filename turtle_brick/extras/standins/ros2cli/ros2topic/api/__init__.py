# SPDX-License-Identifier: Apache-2.0
"""Functions that several verbs of `ros2 topic` use."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection
from typing import Any

from rclpy.expand_topic_name import expand_topic_name
from rclpy.qos import (DurabilityPolicy, HistoryPolicy, LivelinessPolicy, QoSPresetProfiles,
                       QoSProfile, ReliabilityPolicy)
from ros2cli.helpers import Unsupported
from ros2cli.messages import get_interface
from ros2cli.node import direct

PROFILES = (
    'unknown', 'default', 'system_default', 'sensor_data', 'services_default', 'parameters',
    'parameter_events', 'action_status_default', 'best_available')


def complete_topic_name(prefix: str, parsed_args: argparse.Namespace,
                        **kwargs: object) -> list[str]:
    """Return the names of all topics."""
    with direct.open_graph() as graph:
        return list(graph.topic_types(hidden=False))


def complete_message_type(prefix: str, parsed_args: argparse.Namespace,
                          **kwargs: object) -> list[str]:
    """Return the types of the topic on the command line."""
    name = parsed_args.topic_name
    with direct.open_graph(lambda graph: graph.topic_types().get(name)) as graph:
        return graph.topic_types().get(name, [])


def get_topic_class(graph: direct.GraphNode, topic: str) -> Any:
    """Return the message class for a topic, or None if the topic does not exist."""
    name = expand_topic_name(topic, graph.get_name(), graph.get_namespace())
    types = graph.topic_types().get(name)
    if not types:
        return None
    return get_interface(types[0], 'msg', f"The message type '{types[0]}' is invalid")


def make_filter(expression: str | None) -> Callable[[Any], Any]:
    """Return a function that evaluates a Python expression, in which `m` is the message."""
    def passes(m: Any) -> Any:
        if expression is None:
            return True
        try:
            return eval(expression)
        except Exception as error:  # noqa: B902 -- the user's expression can raise any exception
            raise RuntimeError(f"Invalid filter '{expression}': {error}") from None
    return passes


def add_qos_arguments(parser: argparse.ArgumentParser, entity_type: str, default: str) -> None:
    """
    Add the options for the QoS profile.

    :param entity_type: `subscribe` or `publish`
    :param default: name of the default profile
    """
    compatible = 'Compatible profile with running endpoints '
    parser.add_argument(
        '--qos-profile', choices=PROFILES, default=default,
        help=f'Quality of service preset profile to {entity_type} with (default: {default})')
    parser.add_argument(
        '--qos-depth', metavar='N', type=int,
        help=f'Queue size setting to {entity_type} with (overrides depth value of --qos-profile '
        'option)')
    parser.add_argument(
        '--qos-history', choices=('system_default', 'keep_last', 'keep_all', 'unknown'),
        help=f'History of samples setting to {entity_type} with (overrides history value of '
        '--qos-profile option, default: keep_last)')
    parser.add_argument(
        '--qos-reliability',
        choices=('system_default', 'reliable', 'best_effort', 'unknown', 'best_available'),
        help=f'Quality of service reliability setting to {entity_type} with (overrides '
        f'reliability value of --qos-profile option, default: {compatible})')
    parser.add_argument(
        '--qos-durability',
        choices=('system_default', 'transient_local', 'volatile', 'unknown', 'best_available'),
        help=f'Quality of service durability setting to {entity_type} with (overrides durability '
        f'value of --qos-profile option, default: {compatible})')
    parser.add_argument(
        '--qos-liveliness',
        choices=('system_default', 'automatic', 'manual_by_topic', 'unknown', 'best_available'),
        help=f'Quality of service liveliness setting to {entity_type} with (overrides liveliness '
        'value of --qos-profile option')
    parser.add_argument(
        '--qos-liveliness-lease-duration-seconds', action=Unsupported,
        help=f'Quality of service liveliness lease duration setting to {entity_type} with '
        '(overrides liveliness lease duration value of --qos-profile option')


def make_qos_profile(args: argparse.Namespace, publishers: Collection[Any] = ()) -> QoSProfile:
    """
    Return the QoS profile from the options.

    :param publishers: publishers with which the profile is compatible if no option is given
    """
    qos = QoSPresetProfiles.get_from_short_key(args.qos_profile)
    is_chosen = False
    for name, policy in (('history', HistoryPolicy), ('reliability', ReliabilityPolicy),
                         ('durability', DurabilityPolicy), ('liveliness', LivelinessPolicy)):
        value = getattr(args, f'qos_{name}')
        if value is not None:
            setattr(qos, name, policy.get_from_short_key(value))
            is_chosen = True
    if args.qos_depth is not None:
        qos.depth = args.qos_depth
        is_chosen = True
    if publishers and not is_chosen:
        profiles = [publisher.qos_profile for publisher in publishers]
        qos.reliability = ReliabilityPolicy.BEST_EFFORT
        if all(profile.reliability == ReliabilityPolicy.RELIABLE for profile in profiles):
            qos.reliability = ReliabilityPolicy.RELIABLE
        qos.durability = DurabilityPolicy.VOLATILE
        if all(profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for profile in profiles):
            qos.durability = DurabilityPolicy.TRANSIENT_LOCAL
    return qos
