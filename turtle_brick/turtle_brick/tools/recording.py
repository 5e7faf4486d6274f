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
record: makes videos of the viewer's page.

The whole graph runs, live, and bricks are placed and dropped into it; what the viewer would hear
is kept, with the instants at which it came. Then a browser draws the page as it was at each
instant of the video. So the video is smooth even where no graphics card draws the page.

It needs viser, and from the system Chromium and ffmpeg.
"""

import argparse
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
import shutil
import subprocess
import sys
from tempfile import TemporaryDirectory
from typing import Any

from geometry_msgs.msg import PoseStamped
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer
from turtle_brick.core.geometry import Vector
from turtle_brick.core.parameters import load, ParameterError
from turtle_brick.physics import Phase
from turtle_brick.ros.interrupts import INTERRUPTS
from turtle_brick.ros.tf import BRICK
from turtle_brick.tools.browser import BrowserError, Chromium, find_chromium
from turtle_brick.tools.demo import Match, two_bricks
from turtle_brick.tools.graph import Graph
from turtle_brick.view.display import Display
from turtle_brick.view.viewer import Listener, PERIOD, VISER
from turtle_brick.view.viewing import NANOSECONDS
from turtle_brick_interfaces.msg import Tilt
from visualization_msgs.msg import Marker

SIZE = (1280, 720)
"""Width and height of the page and the video (pixels)."""

RATE = 30
"""Pictures per second."""

BEFORE, AFTER = 1.0, 3.5
"""How much is shown (s) before the first brick is placed and after each one is at rest."""

PAGE_SIZE = (1280, 830)
"""Width and height of a picture of the page alone (pixels)."""

PAGE_HEIGHT = 6.0
"""How high the falling brick then is at most (m)."""

ANIMATED_LIMIT = 4_000_000
"""The most bytes that the animated picture may have."""

ANIMATED_KINDS = ((1280, 80), (1280, 65), (1120, 60), (960, 55), (800, 50), (640, 40))
"""Widths (pixels) and qualities (of 100) in which the animated picture is tried, in this order."""


class Log:
    """What was heard, and when."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self.entries: list[tuple[int, str, tuple[Any, ...]]] = []

    def hear_description(self, message: String, now: int) -> None:
        """Keep a robot description."""
        self._keep('hear_description', message, now)

    def hear_transforms(self, message: TFMessage, static: bool, clock: int, now: int) -> None:
        """Keep transforms."""
        self._keep('hear_transforms', message, static, clock, now)

    def hear_marker(self, topic: str, message: Marker, now: int) -> None:
        """Keep a marker."""
        self._keep('hear_marker', topic, message, now)

    def hear_goal(self, message: PoseStamped, now: int) -> None:
        """Keep a goal."""
        self._keep('hear_goal', message, now)

    def hear_tilt(self, message: Tilt, now: int) -> None:
        """Keep a tilt."""
        self._keep('hear_tilt', message, now)

    def hear_of(self, name: str, now: int) -> None:
        """Keep that there was a message."""
        self._keep('hear_of', name, now)

    def _keep(self, method: str, *arguments: Any) -> None:
        self.entries.append((arguments[-1], method, arguments))

    def replay(self, display: Display, start: int, end: int) -> Iterator[int]:
        """
        Let a display hear it all again, and stop at each instant of the video.

        :param display: an empty one
        :param start: the first instant of the video (ns); what came before is heard at once
        :param end: its end (ns)
        :yields: The instants (ns), everything until then heard.
        """
        entries = sorted(self.entries, key=lambda entry: entry[0])
        index = 0
        for number in range(pictures_between(start, end)):
            now = start + number * NANOSECONDS // RATE
            while index < len(entries) and entries[index][0] <= now:
                _, method, arguments = entries[index]
                getattr(display, method)(*arguments)
                index += 1
            yield now


class Recorder(Listener):
    """Keep what is to be seen in the graph."""

    def __init__(self, **node_options: Any) -> None:
        """
        Begin to listen.

        :param node_options: passed on to rclpy.node.Node
        """
        super().__init__('recorder', **node_options)
        self.log = Log()
        self.listen(self.log)
        self.create_timer(PERIOD, self.fetch)


def perform(bricks: Sequence[Vector] | None) -> tuple[Log, int, int]:
    """
    Place and drop bricks in the live graph.

    :param bricks: where each of them is placed (m); None for those of the demo
    :return: What was to be seen, and the first and the last instant (ns) worth showing.
    :raises RuntimeError: a brick was not caught, or not declared out of reach, as it should
    """
    parameters = load()
    with Graph(quiet=True) as graph:
        recorder = graph.add(Recorder, parameters=False)
        match = Match(graph, parameters)
        match.await_graph()
        start = recorder.now()
        graph.spin_for(BEFORE)
        for brick in bricks or two_bricks(parameters):
            outcome = match.show(brick)
            if outcome.faults:
                raise RuntimeError('the graph has not done what it should, as on a machine that '
                                   f'is too busy: {", ".join(outcome.faults)}')
            graph.spin_for(AFTER)
        recorder.fetch()
        return recorder.log, start, recorder.now()


class Studio:
    """A page and a browser that shows it, to take pictures of."""

    def __init__(self, size: tuple[int, int] | None = None) -> None:
        """
        Open the page.

        :param size: its width and height (pixels), those of the video if None
        :raises BrowserError: the browser does not start, or does not show the page
        """
        from turtle_brick.view.web_view import WebView
        self.view = WebView('127.0.0.1', 0, lambda command: None)
        self.display = Display(self.view, Buffer(), lambda _, sentence: print(
            sentence, file=sys.stderr))
        # What tells that the browser has come to show all that was sent before it.
        self._token = self.view.server.gui.add_html('')
        self._frames = 0
        self._picture = b''
        try:
            self._browser = Chromium(*(size or SIZE))
        except BrowserError:
            self.view.close()
            raise
        try:
            self._browser.go_to(f'{self.view.url}/?fixedDpr=1')
            self._browser.wait_for('document.querySelector("canvas")')
            # No note on how it is drawn: the video does not tell.
            self._browser.evaluate(
                'document.head.append(Object.assign(document.createElement("style"), {textContent:'
                '".mantine-Notifications-root { display: none }"}))')
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> 'Studio':
        """Return the studio itself; on leaving it, browser and page end."""
        return self

    def __exit__(self, *_: object) -> None:
        """End browser and page."""
        self.close()

    def close(self) -> None:
        """End browser and page."""
        self._browser.close()
        self.view.close()

    def picture(self, now: int) -> bytes:
        """Return a picture of the page as it was at an instant (ns), as a PNG file."""
        before = self.view.changes
        with self.view.together():
            self.display.draw(now)
            if self._picture and self.view.changes == before:
                return self._picture
        self._picture = self.screenshot()
        return self._picture

    def screenshot(self) -> bytes:
        """Return a picture of the page with all that was drawn, as a PNG file."""
        self._frames += 1
        self._token.content = f'<i data-drawn="{self._frames}"></i>'
        self._browser.wait_for(f'document.querySelector("[data-drawn=\'{self._frames}\']")')
        self._browser.evaluate(
            'new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))')
        return self._browser.screenshot()


def film(log: Log, start: int, end: int, path: Path) -> None:
    """
    Make a video of what was heard.

    :param log: what was heard
    :param start: its first instant (ns)
    :param end: its end (ns)
    :param path: of the MP4
    :raises BrowserError: the browser does not show the page
    :raises RuntimeError: ffmpeg could not make the video
    """
    command = ['ffmpeg', '-y', '-loglevel', 'error', '-f', 'image2pipe', '-c:v', 'png',
               '-r', str(RATE), '-i', '-', '-c:v', 'libx264', '-preset', 'slow', '-crf', '18',
               '-pix_fmt', 'yuv420p', '-movflags', '+faststart', str(path)]
    total = pictures_between(start, end)
    with Studio() as studio, subprocess.Popen(command, stdin=subprocess.PIPE) as encoder:
        pipe = encoder.stdin
        assert pipe is not None
        for number, now in enumerate(log.replay(studio.display, start, end)):
            pipe.write(studio.picture(now))
            print(f'\rdrawing: {number + 1} of {total}', end='', file=sys.stderr, flush=True)
        print(file=sys.stderr)
        pipe.close()
        if encoder.wait() != 0:
            raise RuntimeError('ffmpeg could not make the video')


def picture_page(log: Log, start: int, end: int, path: Path) -> None:
    """
    Make a picture of the page while the first brick falls.

    :param log: what was heard
    :param start: its first instant (ns)
    :param end: its end (ns)
    :param path: of the PNG
    :raises BrowserError: the browser does not show the page
    :raises RuntimeError: no brick falls so far
    """
    with Studio(PAGE_SIZE) as studio:
        for now in log.replay(studio.display, start, end):
            studio.display.draw(now)
            brick = studio.display.drawn(BRICK)
            if (studio.display.phase() is Phase.FALLING and brick is not None
                    and brick.position[2] < PAGE_HEIGHT):
                break
        else:
            raise RuntimeError(f'no brick has fallen below {PAGE_HEIGHT:g} m')
        # The page fades in.
        earlier, picture = b'', studio.screenshot()
        while picture != earlier:
            earlier, picture = picture, studio.screenshot()
        path.write_bytes(picture)


def pictures_between(start: int, end: int) -> int:
    """Return how many pictures a video has that shows the time between two instants (ns)."""
    return (end - start) * RATE // NANOSECONDS


def animate(video: Path, picture: Path) -> None:
    """Make an animated picture of a video, as good as its limit of bytes allows."""
    for width, quality in ANIMATED_KINDS:
        subprocess.run(
            ['ffmpeg', '-y', '-loglevel', 'error', '-i', str(video), '-vf',
             f'scale={width}:-2:flags=lanczos', '-c:v', 'libwebp_anim', '-quality', str(quality),
             '-compression_level', '4', '-loop', '0', str(picture)], check=True)
        if picture.stat().st_size < ANIMATED_LIMIT:
            return
    raise RuntimeError(f'{picture.name} would have more than {ANIMATED_LIMIT} bytes')


def missing() -> str | None:
    """Return what is missing here and how to get it, in a sentence; None if all is there."""
    if find_spec('viser') is None:
        return f'the page is drawn by viser, which is not installed here: pip install {VISER}'
    wanted = [name for name, found in (
        ('chromium', find_chromium()), ('ffmpeg', shutil.which('ffmpeg'))) if not found]
    if wanted:
        return f'{" and ".join(wanted)} not installed here: apt-get install {" ".join(wanted)}'
    return None


def main(args: list[str] | None = None) -> int:
    """Make the videos that are asked for; return the exit status."""
    parser = argparse.ArgumentParser(
        prog='record', description='Make videos of the page that shows the live graph.')
    parser.add_argument(
        'output', type=Path, nargs='?', help='where to put the video, as MP4; beside it comes an '
        'animated picture of the same name, as WebP')
    parser.add_argument(
        '--place', nargs=3, type=float, action='append', metavar=('X', 'Y', 'Z'),
        help='drop a brick from here (m, in the world) instead of the two of the demo; repeatable')
    parser.add_argument(
        '--page', type=Path, help='where to put a picture of the page, as PNG, while the first '
        'brick falls')
    options = parser.parse_args(args)
    if options.output is None and options.page is None:
        parser.error('name a video or --page')
    reason = missing()
    if reason is not None:
        print(f'record: {reason}', file=sys.stderr)
        return 1
    INTERRUPTS.take_over()
    try:
        performance = perform(options.place)
        if options.page is not None:
            picture_page(*performance, options.page)
        if options.output is None:
            return 0
        with TemporaryDirectory() as directory:
            # So that nothing half-made is left where the videos are to be.
            video, picture = Path(directory, 'video.mp4'), Path(directory, 'picture.webp')
            film(*performance, video)
            animate(video, picture)
            shutil.copyfile(video, options.output.with_suffix('.mp4'))
            shutil.copyfile(picture, options.output.with_suffix('.webp'))
    except KeyboardInterrupt:
        return 0
    except (BrowserError, OSError, ParameterError, RuntimeError, TimeoutError, ValueError,
            subprocess.CalledProcessError) as error:
        print(f'record: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
