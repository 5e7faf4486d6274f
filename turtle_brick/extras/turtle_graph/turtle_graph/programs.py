# SPDX-License-Identifier: Apache-2.0
"""Start the programs of this package. Ctrl-C while modules are imported ends a program quietly."""

from importlib import import_module
import signal
from typing import Any


def run(module: str, function: str = 'main') -> Any:
    """Import a module with the default action for SIGINT, and call one of its functions."""
    handler = signal.signal(signal.SIGINT, signal.SIG_DFL)
    main = getattr(import_module(module), function)
    signal.signal(signal.SIGINT, handler)
    return main()


def referee() -> Any:
    """Run the referee."""
    return run('turtle_graph.referee.referee', 'main_alone')


def viewer() -> Any:
    """Run the viewer."""
    return run('turtle_graph.view.viewer')
