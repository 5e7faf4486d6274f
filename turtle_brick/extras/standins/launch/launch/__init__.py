# SPDX-License-Identifier: Apache-2.0
"""The stand-in for launch 3.4.11, with the modules and names of the real package."""

from launch import actions
from launch import conditions
from launch import descriptions
from launch import event_handlers
from launch import events
from launch import frontend
from launch import launch_description_sources
from launch import logging
from launch import substitutions
from launch import utilities
from launch.action import Action
from launch.condition import Condition
from launch.event import Event
from launch.event_handler import EventHandler
from launch.invalid_launch_file_error import InvalidLaunchFileError
from launch.launch_context import LaunchContext
from launch.launch_description import LaunchDescription
from launch.launch_description_entity import LaunchDescriptionEntity
from launch.launch_description_source import LaunchDescriptionSource
from launch.launch_service import LaunchService
from launch.missing import missing_name
from launch.some_entities_type import SomeEntitiesType
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitution import Substitution

__all__ = [
    'actions', 'conditions', 'descriptions', 'event_handlers', 'events', 'frontend',
    'launch_description_sources', 'logging', 'substitutions', 'utilities', 'Action', 'Condition',
    'Event', 'EventHandler', 'InvalidLaunchFileError', 'LaunchContext', 'LaunchDescription',
    'LaunchDescriptionEntity', 'LaunchDescriptionSource', 'LaunchService', 'SomeEntitiesType',
    'SomeSubstitutionsType', 'Substitution']
__getattr__ = missing_name('launch')
