# SPDX-License-Identifier: Apache-2.0

"""Read the supported settings from an rviz2 configuration file."""

from pathlib import Path
from typing import Any, NamedTuple

import yaml


class Settings(NamedTuple):
    """Settings of the page. The defaults apply if there is no configuration file."""

    fixed_frame: str = ''  # The default frame is world or, if world is missing, the root link.
    shows_frames: bool = False  # Whether the axes of the frames are initially visible.
    hidden_frames: frozenset[str] = frozenset()
    description_topic: str = 'robot_description'
    description: str = ''  # Robot description from a file, or ''.


def read_settings(path: str) -> Settings:
    """Read an rviz2 configuration file, or raise ValueError if the file is invalid."""
    settings: dict[str, Any] = {}
    try:
        manager = yaml.safe_load(Path(path).read_text(encoding='utf-8'))['Visualization Manager']
        settings['fixed_frame'] = manager['Global Options']['Fixed Frame']
        for display in manager.get('Displays', ()):
            kind = display['Class'].rpartition('/')[2]
            if kind == 'TF' and display.get('Enabled', True):
                settings['shows_frames'] = True
                settings['hidden_frames'] = frozenset(
                    name for name, frame in display.get('Frames', {}).items()
                    if name != 'All Enabled' and not frame['Value'])
            elif kind == 'RobotModel' and display.get('Description Source') == 'File':
                path = display['Description File']
                settings['description'] = Path(path).read_text(encoding='utf-8')
            elif kind == 'RobotModel':
                settings['description_topic'] = display['Description Topic']['Value']
    except OSError as error:
        raise ValueError(f'{path}: {error.strerror}') from None
    except (AttributeError, LookupError, TypeError, UnicodeDecodeError, yaml.YAMLError):
        raise ValueError(f'{path} is not an rviz2 configuration file') from None
    return Settings(**settings)
