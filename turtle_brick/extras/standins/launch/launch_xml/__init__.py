# SPDX-License-Identifier: Apache-2.0
"""The stand-in for launch_xml 3.4.11, which reads XML launch files."""

from launch_xml.entity import Entity
from launch_xml.parser import Parser

__all__ = ['Entity', 'Parser']
