# SPDX-License-Identifier: Apache-2.0
"""Reserve an unused ROS domain on this machine, and restrict discovery to this machine."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
import os
import random
import socket

DOMAINS = range(101)
"""ROS domains whose ports are below the range of ports that Linux assigns automatically."""
LAST_DOMAIN = 232
"""Maximum domain number that DDS supports."""
PARTICIPANTS = 32
"""Number of ports to check per domain (the first ports of a domain in use may be free)."""
MARK_PORT_BASE = 32768
"""Lowest TCP port used to reserve a domain, as in the domain_coordinator package of ROS 2."""
RANGE_VARIABLES = ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_STATIC_PEERS', 'ROS_LOCALHOST_ONLY')
"""Environment variables that set the discovery range."""


class DomainError(RuntimeError):
    """Error raised if a ROS domain cannot be used."""


def restrict_to_localhost() -> None:
    """Limit discovery to this machine, unless an environment variable sets the discovery range."""
    if not any(os.environ.get(name) for name in RANGE_VARIABLES):
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'


def is_empty(domain: int) -> bool:
    """Return whether no node on this machine uses the given domain."""
    # DDS participant i on a machine uses UDP port 7400 + 250 * domain + 10 + 2 * i.
    first = 7410 + 250 * domain
    for port in range(first, first + 2 * PARTICIPANTS, 2):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as participant:
            try:
                participant.bind(('', port))
            except OSError:
                return False
    return True


@contextmanager
def reserved_domain(candidates: Iterable[int] | None = None) -> Iterator[int]:
    """Reserve the first unused ROS domain among the candidates (default: 1 to 100, shuffled)."""
    for domain in candidates or random.sample(DOMAINS[1:], len(DOMAINS) - 1):
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as mark:
            try:
                mark.bind(('', MARK_PORT_BASE + domain))
            except OSError:
                continue
            if is_empty(domain):
                yield domain
                return
    raise DomainError('all candidate ROS domains are in use on this machine')
