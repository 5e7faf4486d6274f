# SPDX-License-Identifier: Apache-2.0
"""Functions that several actions use."""

from launch.missing import missing_name
from launch_ros.utilities.evaluate_parameters import evaluate_parameter_dict
from launch_ros.utilities.namespace_utils import make_namespace_absolute, prefix_namespace
from launch_ros.utilities.normalize_remap_rule import normalize_remap_rule, normalize_remap_rules

__all__ = ['evaluate_parameter_dict', 'make_namespace_absolute', 'normalize_remap_rule',
           'normalize_remap_rules', 'prefix_namespace']
__getattr__ = missing_name('launch_ros')
