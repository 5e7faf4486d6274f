# SPDX-License-Identifier: Apache-2.0
"""The stand-in for launch_yaml 3.4.11, which reads YAML launch files."""

from launch_yaml.entity import Entity
from launch_yaml.parser import Parser

__all__ = ['Entity', 'Parser']
