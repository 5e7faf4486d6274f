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
"""The command `ros2 param`."""

from __future__ import annotations

from ros2cli.command import CommandWithVerbs


class ParamCommand(CommandWithVerbs):
    """The command `ros2 param`."""

    verb_package = 'ros2param.verb'
    verbs = {
        'delete': 'Delete parameter',
        'describe': 'Show descriptive information about declared parameters',
        'dump': 'Show all of the parameters of a node in a YAML file format',
        'get': 'Get parameter',
        'list': 'Output a list of available parameters',
        'load': 'Load parameter file for a node',
        'set': 'Set parameter'}
