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
