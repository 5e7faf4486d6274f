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

"""
record_rviz: films rviz2 and the window of turtlesim, once for each video of the README.

Everything is real and in real time: turtle_arena.launch.py runs on a screen of its own, bricks are
placed and dropped by service, and ffmpeg films the screen. Without a window manager turtlesim
opens in the upper left corner, and rviz2 where its configuration says: it is that of the package,
with a nearer view. Below turtlesim the caption tells what the nodes say.
"""

import argparse
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, ExitStack
from math import inf
import os
from pathlib import Path
import shutil
import subprocess
import sys
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Any, NamedTuple

from ament_index_python.packages import get_package_share_path, get_packages_with_prefixes
from rclpy.node import Node
from std_srvs.srv import Trigger
from turtle_brick.core.geometry import Vector
from turtle_brick.physics import Phase
from turtle_brick.ros.tf import LATCHED
from turtle_brick.tools.graph import Child, Graph
from turtle_brick.tools.interrupts import INTERRUPTS
from turtle_brick_interfaces.msg import Tilt
from turtle_brick_interfaces.srv import Place
from turtle_referee.domains import DomainError, keep_to_this_machine, reserved_domain
from visualization_msgs.msg import Marker
import yaml

SIZE = (1600, 900)
"""Width and height of the screen and the MP4 (pixels)."""

TURTLESIM_SIZE = 500
"""Width and height of turtlesim's window (pixels)."""

SCENE = '700x760', '+870,80'
"""Size and place of a part of the 3D view, in which nothing moves when robot and brick do not."""

VIEW = {'Distance': 6.0, 'Focal Point': {'X': 6.2, 'Y': 6.0, 'Z': 2.1}, 'Pitch': 0.2}
"""What differs from the view of the package's configuration: both bricks in the picture, and a
robot of more than a quarter of its height."""

TITLE = 'rviz2 and turtlesim'

CAPTION = 'fontsize=34:fontcolor=white:line_spacing=12:x=20:y=530'
"""How ffmpeg's drawtext writes the caption."""

BEFORE, AFTER = 1.0, 1.0
"""How much is shown (s) before a brick is dropped and after all is over."""

START_TIME, SCENE_TIME, END_TIME = 60.0, 20.0, 20.0
"""How long (s) the start, a scene and the end may take."""

ANIMATED = ('-vf', 'fps=25,scale=1280:-2:flags=lanczos', '-c:v', 'libwebp_anim', '-quality', '85',
            '-compression_level', '6', '-loop', '0')
"""How ffmpeg makes the animated picture."""

MP4 = ('-c:v', 'libx264', '-preset', 'slow', '-crf', '23', '-pix_fmt', 'yuv420p',
       '-movflags', '+faststart')
"""How ffmpeg makes the video."""


class Scene(NamedTuple):
    """A video."""

    name: str
    """Of its files."""
    brick: Vector
    """Where the brick is dropped (m in the world)."""
    events: set[str]
    """All that is heard in it."""


SCENES = (
    Scene('caught', (7.0, 6.6, 4.1), {
        f'brick: {phase.value}'
        for phase in (Phase.HOVERING, Phase.FALLING, Phase.RIDING, Phase.FLOATING)}),
    Scene('unreachable', (5.5, 9.5, 3.8), {'catcher: Unreachable', *(
        f'brick: {phase.value}' for phase in (Phase.HOVERING, Phase.FALLING, Phase.GROUNDED))}),
)


class Watcher(Node):
    """Hear what happens, write the caption, and call the services of the arena."""

    def __init__(self, caption: Path, **node_options: Any) -> None:
        """
        Begin to listen.

        :param caption: the file for the caption
        :param node_options: passed on to rclpy.node.Node
        """
        super().__init__('record_rviz', **node_options)
        self.events: list[str] = []
        self.angle = 0.0
        self.shown_until = -inf
        self._caption = caption
        self._write()
        self.create_subscription(Marker, 'brick_marker', self._hear_brick, LATCHED)
        self.create_subscription(Marker, 'catcher_marker', self._hear_catcher, 10)
        self.create_subscription(Tilt, 'tilt', self._hear_tilt, 10)
        self.place_client = self.create_client(Place, 'place')
        self.drop_client = self.create_client(Trigger, 'drop')

    def sees_all(self) -> bool:
        """Tell whether the nodes are up and rviz2 listens to all of them."""
        # Of the markers this node is a listener too.
        return (all(self.count_subscribers(topic) >= listeners for topic, listeners in (
                    ('goal_pose', 1), ('robot_description', 1), ('walls', 1), ('brick_marker', 2),
                    ('catcher_marker', 2)))
                and self.count_publishers('tilt') > 0
                and self.place_client.service_is_ready() and self.drop_client.service_is_ready())

    def is_over(self, scene: Scene) -> bool:
        """Tell whether all of a scene has come, the platform is level and no text is shown."""
        return (set(self.events) == scene.events and self.angle == 0.0
                and monotonic() > self.shown_until)

    def _hear_brick(self, marker: Marker) -> None:
        self._note(f'brick: {marker.text}')

    def _hear_catcher(self, marker: Marker) -> None:
        self._note(f'catcher: {marker.text}')
        self.shown_until = monotonic() + marker.lifetime.sec

    def _hear_tilt(self, tilt: Tilt) -> None:
        self.angle = tilt.angle

    def _note(self, event: str) -> None:
        if event not in self.events:
            self.events.append(event)
            self._write()

    def _write(self) -> None:
        """Write the caption, which ffmpeg reads for every picture: so it is replaced at once."""
        draft = self._caption.with_suffix('.draft')
        draft.write_text('\n'.join([TITLE, '', *self.events]), encoding='utf-8')
        draft.replace(self._caption)


@contextmanager
def running(*command: str, **options: Any) -> Iterator[None]:
    """Run a program until the context ends; the options are those of Child."""
    with INTERRUPTS.held():
        child = Child(command, **options)
    try:
        yield
    finally:
        with INTERRUPTS.held():
            child.ask_to_end()
            child.see_end(END_TIME)


@contextmanager
def screen() -> Iterator[str]:
    """Open a screen in memory; return its display."""
    reader, writer = os.pipe()
    with open(reader, encoding='utf-8') as said:
        with running('Xvfb', '-displayfd', str(writer), '-screen', '0',
                     '{}x{}x24'.format(*SIZE), '-nolisten', 'tcp', pass_fds=(writer,),
                     stderr=subprocess.DEVNULL):
            os.close(writer)
            number = said.readline().strip()
            if not number:
                raise RuntimeError('Xvfb does not start')
            yield f':{number}'


def configuration() -> dict[str, Any]:
    """Return the configuration of rviz2: that of the package, but nearer and beside turtlesim."""
    path = get_package_share_path('turtle_brick') / 'config' / 'turtle_arena.rviz'
    content: dict[str, Any] = yaml.safe_load(path.read_text(encoding='utf-8'))
    manager = content['Visualization Manager']
    manager['Views']['Current'].update(VIEW)
    width, height = SIZE
    content['Window Geometry'].update(
        {'X': TURTLESIM_SIZE, 'Y': 0, 'Width': width - TURTLESIM_SIZE, 'Height': height})
    # The panel shows the state of every display that listens.
    content['Panels'][0]['Property Tree Widget']['Expanded'] = ['/Global Status1'] + [
        f'/{display["Name"]}1' for display in manager['Displays'] if 'Topic' in display
        or 'Description Topic' in display]
    return content


def ffmpeg(*arguments: str) -> list[str]:
    """Return a command line of ffmpeg, which says errors only."""
    return ['ffmpeg', '-y', '-loglevel', 'error', *arguments]


def film(scene: Scene, video: Path) -> None:
    """
    Film a scene.

    :param scene: the scene
    :param video: where to put the film
    :raises TimeoutError: something has not come as it should
    """
    with ExitStack() as stack:
        files = Path(stack.enter_context(TemporaryDirectory()))
        (files / 'video.rviz').write_text(yaml.safe_dump(configuration()), encoding='utf-8')
        domain = stack.enter_context(reserved_domain())
        display = stack.enter_context(screen())
        stack.enter_context(running(
            'ros2', 'launch', 'turtle_brick', 'turtle_arena.launch.py', 'view:=rviz',
            'rviz_config:=' + os.path.relpath(
                files / 'video.rviz', get_package_share_path('turtle_brick')),
            environment={'DISPLAY': display, 'QT_QPA_PLATFORM': 'xcb',
                         'ROS_DOMAIN_ID': str(domain), 'ROS_LOG_DIR': str(files),
                         'TMPDIR': str(files), 'XDG_RUNTIME_DIR': str(files)},
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        graph = stack.enter_context(Graph(domain_id=domain, quiet=True))
        caption = files / 'caption.txt'
        watcher = graph.add(Watcher, parameters=False, caption=caption)

        def call(client: Any, request: Any) -> None:
            future = client.call_async(request)
            graph.spin_until(future.done, START_TIME, f'{client.srv_name} answers')
            if not future.result().success:
                raise RuntimeError(f'{client.srv_name}: {future.result().message}')

        pictures: deque[bytes] = deque(maxlen=4)
        size, place = SCENE

        def stands_still() -> bool:
            pictures.append(subprocess.run(
                ffmpeg('-f', 'x11grab', '-video_size', size, '-i', display + place,
                       '-frames:v', '1', '-f', 'rawvideo', '-'),
                check=True, stdout=subprocess.PIPE).stdout)
            return len(pictures) == pictures.maxlen and len(set(pictures)) == 1

        graph.spin_until(watcher.sees_all, START_TIME, 'rviz2 and the nodes see each other')
        request = Place.Request()
        request.location.x, request.location.y, request.location.z = scene.brick
        call(watcher.place_client, request)
        graph.spin_until(stands_still, START_TIME, 'rviz2 shows a picture that stands still')
        with running(*ffmpeg(
                '-f', 'x11grab', '-draw_mouse', '0', '-framerate', '30',
                '-video_size', '{}x{}'.format(*SIZE), '-i', display,
                '-vf', f'drawtext=font=monospace:textfile={caption}:reload=1:expansion=none:'
                + CAPTION, '-c:v', 'libx264', '-preset', 'ultrafast', '-qp', '0',
                '-pix_fmt', 'yuv420p', '-flush_packets', '1', str(video))):
            graph.spin_until(lambda: video.exists() and video.stat().st_size > 0, START_TIME,
                             'ffmpeg films')
            graph.spin_for(BEFORE)
            call(watcher.drop_client, Trigger.Request())
            graph.spin_until(lambda: watcher.is_over(scene), SCENE_TIME,
                             f'{scene.name}: {", ".join(sorted(scene.events))}')
            graph.spin_for(AFTER)


def missing() -> str | None:
    """Return what is missing here and how to get it, in a sentence; None if all is there."""
    wanted = {name: package for name, package, found in (
        ('rviz2', 'ros-jazzy-rviz2', 'rviz2' in get_packages_with_prefixes()),
        ('Xvfb', 'xvfb', shutil.which('Xvfb')),
        ('ffmpeg', 'ffmpeg', shutil.which('ffmpeg'))) if not found}
    if wanted:
        return (f'{" and ".join(wanted)} not installed here: '
                f'apt-get install {" ".join(wanted.values())}')
    return None


def main(args: Sequence[str] | None = None) -> int:
    """Make the videos; return the exit status."""
    parser = argparse.ArgumentParser(
        prog='record_rviz', description='Film rviz2 and turtlesim while a brick is caught, and '
        'while one is not.')
    parser.add_argument(
        'directory', type=Path,
        help='where to put the videos: each as MP4 and as an animated picture (WebP)')
    options = parser.parse_args(args)
    if not options.directory.is_dir():
        parser.error(f'{options.directory} is no directory')
    reason = missing()
    if reason is not None:
        print(f'record_rviz: {reason}', file=sys.stderr)
        return 1
    INTERRUPTS.take_over()
    keep_to_this_machine()
    try:
        with TemporaryDirectory() as directory:
            made = []
            for scene in SCENES:
                film(scene, video := Path(directory, f'{scene.name}.mkv'))
                for suffix, kind in (('.mp4', MP4), ('.webp', ANIMATED)):
                    made.append(video.with_suffix(suffix))
                    subprocess.run(ffmpeg('-i', str(video), *kind, str(made[-1])), check=True)
            # Not before all are made, so that nothing half-made is left where they are to be.
            for path in made:
                print(shutil.copy(path, options.directory))
    except KeyboardInterrupt:
        return 0
    except (DomainError, OSError, RuntimeError, TimeoutError,
            subprocess.CalledProcessError) as error:
        print(f'record_rviz: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
