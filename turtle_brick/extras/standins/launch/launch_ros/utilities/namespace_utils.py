# SPDX-License-Identifier: Apache-2.0
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
