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
