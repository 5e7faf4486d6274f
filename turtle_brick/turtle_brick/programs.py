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
"""Start the nodes. Ctrl-C while the modules of a node are imported ends the node quietly."""

from importlib import import_module
import os
import signal


def arena() -> None:
    """Run the arena."""
    run('turtle_brick.arena')


def catcher() -> None:
    """Run the catcher."""
    run('turtle_brick.catcher')


def turtle_robot() -> None:
    """Run turtle_robot."""
    run('turtle_brick.turtle_robot')


def run(module: str) -> None:
    """Import a module, which takes one second, and call its function main."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os._exit(0))  # until `run_node` replaces the handlers
    import_module(module).main()
