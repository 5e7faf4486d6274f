# SPDX-License-Identifier: Apache-2.0
"""The parts of the readers of XML and YAML launch files that do not depend on the format."""

from launch.frontend.entity import Entity
from launch.frontend.expose import expose_action, expose_substitution
from launch.frontend.parser import InvalidFrontendLaunchFileError, Parser
from launch.missing import missing_name

__all__ = ['Entity', 'expose_action', 'expose_substitution', 'InvalidFrontendLaunchFileError',
           'Parser']
__getattr__ = missing_name('launch')
