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

"""ROS domains on this machine: find a free one, and limit the range of discovery. No ROS."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
import os
import random
import socket

DOMAINS = range(101)  # whose ports are below the range that Linux assigns by itself
LAST_DOMAIN = 232  # that has ports
PARTICIPANTS = 32  # how many of a domain to look for: the first ones may have left

# A process reserves a domain by holding the TCP port of this base plus the domain, as ROS 2's own
# domain_coordinator does, so that the two respect each other.
MARK_PORT_BASE = 32768

RANGE_VARIABLES = ('ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_STATIC_PEERS', 'ROS_LOCALHOST_ONLY')
"""The environment variables that set the range of discovery."""


class DomainError(RuntimeError):
    """A ROS domain cannot be used."""


def restrict_to_localhost() -> None:
    """Limit discovery to this machine, unless the environment sets a range."""
    if not any(os.environ.get(name) for name in RANGE_VARIABLES):
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'


def is_empty(domain: int) -> bool:
    """Tell whether no node on this machine is in a domain."""
    # The i-th DDS participant of a machine listens on the UDP port 7400 + 250 domain + 10 + 2 i.
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
    """
    Reserve a ROS domain that no node on this machine is in and no other process reserves.

    :param candidates: the domains to try, in this order; if None, all in random order but for the
        default domain 0
    :raises DomainError: all of them are in use
    """
    for domain in candidates or random.sample(DOMAINS[1:], len(DOMAINS) - 1):
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as mark:
            try:
                mark.bind(('', MARK_PORT_BASE + domain))
            except OSError:
                continue
            if is_empty(domain):
                yield domain
                return
    raise DomainError('every ROS domain from 0 to 100 is in use on this machine')
