# SPDX-License-Identifier: Apache-2.0
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
