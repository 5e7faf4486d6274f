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
"""Functions for namespaces."""

from __future__ import annotations


def make_namespace_absolute(namespace: str) -> str:
    """
    Return a namespace with a leading slash and without a trailing one.

    :raises InvalidNamespaceException: if the namespace is not valid
    """
    from rclpy.validate_namespace import validate_namespace  # This import is slow.

    absolute = f'/{namespace.strip("/")}'
    validate_namespace(absolute)
    return absolute


def prefix_namespace(base_ns: str | None, ns: str | None) -> str:
    """
    Append a relative namespace to a base namespace. An absolute namespace replaces the base.

    :raises InvalidNamespaceException: if the result is not valid
    """
    if base_ns is None or ns and ns.startswith('/'):
        base_ns = ''
    return make_namespace_absolute(f'{base_ns.rstrip("/")}/{(ns or "").lstrip("/")}')
