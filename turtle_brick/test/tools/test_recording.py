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
"""Videos of the page: what is heard again, a picture, and a short one for real."""

import shutil
import subprocess

from geometry_msgs.msg import TransformStamped
from hypothesis import given
from hypothesis import strategies as st
import pytest
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from turtle_brick.arena import brick_marker
from turtle_brick.physics import Phase
from turtle_brick.tools import recording
from turtle_brick.tools.recording import Log
from turtle_brick.view.viewing import NANOSECONDS
from turtle_brick_interfaces.msg import Tilt

START = 1_700_000_000 * NANOSECONDS

ROBOT = """
<robot name="small">
  <link name="base_link">
    <visual><origin xyz="0 0 0.5"/><geometry><box size="1 1 1"/></geometry></visual>
  </link>
</robot>
"""


class Ear:
    """A display that only listens."""

    def __init__(self):
        """Begin with nothing."""
        self.heard = []

    def hear_of(self, name, now):
        """Take note of a message."""
        self.heard.append(now)

    def hear_tilt(self, message, now):
        """Take note of a tilt."""
        self.heard.append(now)


@given(st.lists(st.integers(-10 * NANOSECONDS, 3 * NANOSECONDS)))
def test_every_picture_is_of_all_that_was_heard_until_then(offsets):
    log = Log()
    for number, offset in enumerate(offsets):
        if number % 2:
            log.hear_tilt(Tilt(), START + offset)
        else:
            log.hear_of('odom', START + offset)
    ear, instants = Ear(), []
    for now in log.replay(ear, START, START + 2 * NANOSECONDS):
        instants.append(now)
        assert ear.heard == sorted(START + offset for offset in offsets if START + offset <= now)
    assert len(instants) == 2 * recording.RATE
    gaps = {after - before for before, after in zip(instants, instants[1:])}
    assert instants[0] == START
    assert gaps <= {NANOSECONDS // recording.RATE, NANOSECONDS // recording.RATE + 1}


def test_what_is_missing_is_named_with_the_way_to_get_it(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(recording, 'find_spec', lambda name: None)
    assert recording.main([str(tmp_path / 'video')]) == 1
    assert f'pip install {recording.VISER}' in capsys.readouterr().err
    monkeypatch.setattr(recording, 'find_spec', lambda name: object())
    monkeypatch.setattr(recording, 'find_chromium', lambda: None)
    monkeypatch.setattr(recording.shutil, 'which', lambda name: None)
    assert recording.main([str(tmp_path / 'video')]) == 1
    assert 'apt-get install chromium ffmpeg' in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def log_of(frame, positions):
    """Return a log of a robot, and of a frame that has some positions, 100 per second."""
    log = Log()
    log.hear_description(String(data=ROBOT), START)
    for step, (x, z) in enumerate(positions):
        transform = TransformStamped()
        transform.header.frame_id, transform.child_frame_id = 'world', frame
        transform.header.stamp.sec = 1_700_000_000
        transform.header.stamp.nanosec = step * 10_000_000
        transform.transform.translation.x, transform.transform.translation.z = x, z
        transform.transform.rotation.w = 1.0
        now = START + step * 10_000_000
        log.hear_transforms(TFMessage(transforms=[transform]), False, now, now)
    return log


@pytest.mark.skipif(recording.missing() is not None, reason=str(recording.missing()))
def test_a_picture_of_the_page_is_made_while_a_brick_falls(tmp_path):
    from PIL import Image
    log = log_of('brick', [(5.0, 6.5 - step / 20.0) for step in range(20)])
    path, end = tmp_path / 'page.png', START + NANOSECONDS // 5
    with pytest.raises(RuntimeError, match='no brick has fallen'):
        recording.picture_page(log, START, end, path)
    assert not path.exists()
    log.hear_marker('brick_marker', brick_marker(Phase.FALLING, (0.4, 0.2, 0.12)), START)
    recording.picture_page(log, START, end, path)
    with Image.open(path) as image:
        assert (image.format, image.size) == ('PNG', recording.PAGE_SIZE)


@pytest.mark.skipif(recording.missing() is not None, reason=str(recording.missing()))
def test_a_video_is_made(tmp_path, monkeypatch):
    monkeypatch.setattr(recording, 'SIZE', (640, 360))
    log = log_of('base_link', [(0.1 * (step // 10), 0.0) for step in range(40)])
    video, picture = tmp_path / 'a.mp4', tmp_path / 'a.webp'
    recording.film(log, START, START + NANOSECONDS // 5, video)
    recording.animate(video, picture)
    if shutil.which('ffprobe'):
        found = subprocess.run(
            ['ffprobe', '-v', 'error', '-count_frames', '-show_entries',
             'stream=nb_read_frames,r_frame_rate,width,height', '-of', 'csv=p=0', str(video)],
            check=True, capture_output=True, text=True).stdout
        assert found.strip().split(',') == ['640', '360', f'{recording.RATE}/1', '6']
    from PIL import Image
    with Image.open(picture) as image:
        assert image.format == 'WEBP'
        assert image.n_frames >= 2, 'the robot has moved'
