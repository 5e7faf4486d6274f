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
"""The conversion of remapping rules to substitutions."""

from __future__ import annotations

from typing import Any

from launch.utilities import normalize_to_list_of_substitutions
from launch_ros.remap_rule_type import RemapRule, SomeRemapRules


def normalize_remap_rule(remap_rule: Any) -> RemapRule:
    """
    Convert a remapping rule to substitutions.

    :raises TypeError: if the rule is not a tuple of two names
    """
    if not isinstance(remap_rule, tuple) or len(remap_rule) != 2:
        raise TypeError(f'A remapping is {remap_rule!r}, but must be a tuple of two names')
    source, target = remap_rule
    return normalize_to_list_of_substitutions(source), normalize_to_list_of_substitutions(target)


def normalize_remap_rules(remap_rules: SomeRemapRules) -> list[RemapRule]:
    """Convert remapping rules to substitutions."""
    return [normalize_remap_rule(rule) for rule in remap_rules]
