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

from graph_view.settings import read_settings, Settings
import pytest
from turtle_brick.core.parameters import default_path

CONFIG = """
Visualization Manager:
  Displays:
  - {Class: rviz_default_plugins/TF}
  - {Class: rviz_default_plugins/RobotModel, Description Source: File, Description File: %s}
  Global Options: {Fixed Frame: map}
"""


def test_settings_are_read_from_the_configuration_files():
    directory = default_path().parent
    assert read_settings(str(directory / 'turtle_arena.rviz')) == Settings('world')
    run_turtle = read_settings(str(directory / 'run_turtle.rviz'))
    assert run_turtle.shows_frames and 'spokes' in run_turtle.hidden_frames
    assert 'odom' not in run_turtle.hidden_frames


def test_robot_description_is_read_from_a_file_and_unreadable_files_are_named(tmp_path):
    robot, path = tmp_path / 'robot.urdf', tmp_path / 'a.rviz'
    for content, named in (('Panels: []', f'{path} is not an'), ('[', f'{path} is not an'),
                           (CONFIG % robot, f'{robot}: No such file')):
        path.write_text(content)
        with pytest.raises(ValueError, match=named):
            read_settings(str(path))
    robot.write_text('<robot/>')
    assert read_settings(str(path)) == Settings('map', shows_frames=True, description='<robot/>')
