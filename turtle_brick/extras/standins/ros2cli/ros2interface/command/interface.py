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
"""The command `ros2 interface`."""

from __future__ import annotations

from ros2cli.command import CommandWithVerbs


class InterfaceCommand(CommandWithVerbs):
    """The command `ros2 interface`."""

    verb_package = 'ros2interface.verb'
    verbs = {
        'list': 'List all interface types available',
        'package': 'Output a list of available interface types within one package',
        'packages': 'Output a list of packages that provide interfaces',
        'proto': 'Output an interface prototype',
        'show': 'Output the interface definition'}
