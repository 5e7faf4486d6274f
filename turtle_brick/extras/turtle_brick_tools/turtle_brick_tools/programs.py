# SPDX-License-Identifier: Apache-2.0
"""Start the programs of this package. Ctrl-C while modules are imported ends a program quietly."""

from typing import Any

from turtle_graph.programs import run


def benchmark() -> Any:
    """Run the benchmark."""
    return run('turtle_brick_tools.benchmark')


def demo() -> Any:
    """Run the demo."""
    return run('turtle_brick_tools.demo')


def sweep() -> Any:
    """Run a sweep."""
    return run('turtle_brick_tools.sweep')
