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
"""The stand-in for launch_ros 0.26.12: nodes with parameters, remappings and namespaces."""

from launch.missing import missing_name
from launch_ros import actions
from launch_ros import descriptions
from launch_ros import parameter_descriptions
from launch_ros import substitutions
from launch_ros import utilities

__all__ = ['actions', 'descriptions', 'parameter_descriptions', 'substitutions', 'utilities']
__getattr__ = missing_name('launch_ros')
