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

"""The robot's URDF, as xacro makes it of parameters. No ROS."""

from pathlib import Path
from xml.parsers.expat import ExpatError

from turtle_brick.core.parameters import default_path
import xacro


def robot_description(params_file: Path) -> str:
    """
    Return the URDF of the robot that a file of parameters describes.

    :raises ValueError: xacro cannot make it of them
    """
    path = default_path().parents[1] / 'urdf' / 'turtle.urdf.xacro'
    try:
        return xacro.process_file(str(path), mappings={'params_file': str(params_file)}).toxml()
    except (xacro.XacroException, ExpatError) as error:
        raise ValueError(f'{path}: {str(error).splitlines()[0].strip()}') from error
