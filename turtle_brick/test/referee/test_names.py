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
"""What an implementation calls things, as it is said in files and options."""

import sys

import pytest
from turtle_referee import referee
from turtle_referee.names import Profile, ProfileError


@pytest.mark.parametrize('text, complaint', (
    ('topics: {tlit: x}', "topics.tlit: 'x' means nothing; there are: cmd_vel, odom"),
    ('names: {tilt: x}', "names.tilt: 'x' means nothing; there are: topics, services, numbers"),
    ('topics: {tilt: ""}', "topics.tilt: '' means nothing"),
    ('numbers: {platform_radius: true}', 'platform_radius: True means nothing'),
    ('topics: tilt', 'has no attribute'),
    ('{', 'while parsing')))
def test_profiles_that_can_not_be_used(tmp_path, text, complaint):
    path = tmp_path / 'profile.yaml'
    path.write_text(text)
    with pytest.raises(ProfileError) as caught:
        Profile().load(path)
    assert f'{path}: ' in str(caught.value) and complaint in str(caught.value)


def test_what_differs_is_taken_over(tmp_path):
    path = tmp_path / 'profile.yaml'
    path.write_text('topics: {tilt: tray}\nservices: {place: put}\nnumbers: {wheel_radius: 1}')
    profile = Profile()
    profile.load(path)
    assert (profile.topics['tilt'], profile.topics['odom']) == ('tray', 'odom')
    assert (profile.services['place'], profile.numbers) == ('put', {'wheel_radius': 1.0})


@pytest.mark.parametrize('dashes', [['--'], []])
def test_the_command_is_found_behind_dashes_that_ros2_run_may_have_taken(dashes):
    options, command = referee.parse(['--verbose', *dashes, sys.executable, '-c', 'pass'])
    assert (options.verbose, command) == (True, [sys.executable, '-c', 'pass'])
