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
A headless Chromium, to look at pages and to click on them. No ROS.

It is controlled through its DevTools protocol. It needs Chromium, from the system, and websockets,
which comes with viser.
"""

from base64 import b64decode
import json
import os
import re
import shutil
import subprocess
from tempfile import TemporaryDirectory
from threading import Thread
from time import monotonic
from typing import Any

NAMES = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable')
"""Possible names of the program."""

TIMEOUT = 60.0
"""Longest time (s) for any action; without a graphics card it draws slowly."""

OPTIONS = (
    '--headless=new', '--no-first-run', '--disable-background-networking', '--disable-sync',
    '--disable-component-update', '--disable-quic', '--disable-extensions', '--mute-audio',
    '--hide-scrollbars', '--remote-debugging-port=0',
    # Draw in software: no graphics card is needed.
    '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader')


class BrowserError(RuntimeError):
    """The browser does not start, does not answer or does not show what it should."""


def find_chromium() -> str | None:
    """Return the path of Chromium, None if it is not installed."""
    return next(filter(None, map(shutil.which, NAMES)), None)


class Chromium:
    """A browser with one page."""

    def __init__(self, width: int = 1280, height: int = 720) -> None:
        """
        Start it.

        :param width: of the page (pixels)
        :param height: of the page (pixels)
        :raises BrowserError: it is not installed, or does not start
        """
        program = find_chromium()
        if program is None:
            raise BrowserError('Chromium is not installed: apt-get install chromium')
        self._profile = TemporaryDirectory(ignore_cleanup_errors=True)
        options = [*OPTIONS, f'--window-size={width},{height}',
                   f'--user-data-dir={self._profile.name}']
        if os.geteuid() == 0:
            options.append('--no-sandbox')  # it does not work for root
        self._process = subprocess.Popen(
            [program, *options, 'about:blank'], stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors='replace',
            start_new_session=True)
        self._connection: Any = None
        self._session = ''
        self._calls = 0
        try:
            self._connect()
            self._call('Page.enable')
            self._call('Emulation.setDeviceMetricsOverride', width=width, height=height,
                       deviceScaleFactor=1, mobile=False)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> 'Chromium':
        """Return the browser itself; on leaving it, it ends."""
        return self

    def __exit__(self, *_: object) -> None:
        """End it."""
        self.close()

    def go_to(self, url: str) -> None:
        """Go to a page."""
        answer = self._call('Page.navigate', url=url)
        if answer.get('errorText'):
            raise BrowserError(f'{url}: {answer["errorText"]}')

    def evaluate(self, expression: str) -> Any:
        """Return the value of a JavaScript expression, or of the promise that it is."""
        answer = self._call('Runtime.evaluate', expression=expression, awaitPromise=True,
                            returnByValue=True)
        if 'exceptionDetails' in answer:
            raise BrowserError(f'{expression}: {json.dumps(answer["exceptionDetails"])}')
        return answer['result'].get('value')

    def wait_for(self, expression: str, timeout: float = TIMEOUT) -> None:
        """
        Wait until a JavaScript expression is true.

        :param expression: evaluated again and again
        :param timeout: longest time (s) that it may take
        :raises BrowserError: it does not become true in time
        """
        deadline = monotonic() + timeout
        while monotonic() < deadline:
            if self.evaluate(
                    'new Promise(done => { const end = performance.now() + 1000;'
                    f' const look = () => {{ const found = Boolean({expression});'
                    ' if (found || performance.now() > end) done(found);'
                    ' else setTimeout(look, 20); }; look(); })'):
                return
        raise BrowserError(f'{expression}: not true within {timeout:g} s')

    def click(self, x: float, y: float, times: int = 1) -> None:
        """Click at a point of the page (pixels); three times in a text selects it."""
        self._call('Input.dispatchMouseEvent', type='mouseMoved', x=x, y=y)
        for count in range(1, times + 1):
            for kind in ('mousePressed', 'mouseReleased'):
                self._call('Input.dispatchMouseEvent', type=kind, x=x, y=y, button='left',
                           clickCount=count)

    def write(self, text: str) -> None:
        """Write at the cursor, in place of the selection."""
        self._call('Input.insertText', text=text)

    def center_of(self, expression: str) -> tuple[float, float]:
        """Scroll the element of a JavaScript expression into view; return its center (pixels)."""
        x, y, width, height = self.evaluate(
            '(element => { element.scrollIntoView({block: "nearest"});'
            ' const box = element.getBoundingClientRect();'
            f' return [box.x, box.y, box.width, box.height]; }})({expression})')
        return x + width / 2.0, y + height / 2.0

    def screenshot(self) -> bytes:
        """Return a picture of the page, as a PNG file."""
        return b64decode(self._call('Page.captureScreenshot', format='png')['data'])

    def close(self) -> None:
        """End the browser."""
        try:
            if self._connection is not None:
                self._session = ''
                self._call('Browser.close')
                self._connection.close()
            else:
                self._process.terminate()
            self._process.wait(10.0)
        except (BrowserError, OSError, subprocess.TimeoutExpired):
            self._process.kill()
            self._process.wait()
        self._profile.cleanup()

    def _connect(self) -> None:
        """Attach to the page, once the browser prints where it listens."""
        from websockets.sync.client import connect
        output = self._process.stderr
        assert output is not None
        said = []
        for line in output:
            said.append(line.strip())
            address = re.match(r'DevTools listening on (ws://\S+)', line)
            if address:
                break
        else:
            raise BrowserError(f'Chromium does not start: {" ".join(said[-3:])}')
        # Its further output is not needed, but has to be read.
        Thread(target=output.read, daemon=True).start()
        self._connection = connect(address.group(1), max_size=None, open_timeout=TIMEOUT)
        target = next(target for target in self._call('Target.getTargets')['targetInfos']
                      if target['type'] == 'page')
        self._session = self._call(
            'Target.attachToTarget', targetId=target['targetId'], flatten=True)['sessionId']

    def _call(self, method: str, **parameters: Any) -> Any:
        """Call a method of the DevTools protocol."""
        from websockets.exceptions import ConnectionClosed
        self._calls += 1
        message = {'id': self._calls, 'method': method, 'params': parameters}
        if self._session:
            message['sessionId'] = self._session
        try:
            self._connection.send(json.dumps(message))
            while True:
                answer = json.loads(self._connection.recv(timeout=TIMEOUT))
                if answer.get('id') == self._calls:
                    break
        except TimeoutError:
            raise BrowserError(f'{method}: no answer within {TIMEOUT:g} s') from None
        except ConnectionClosed:
            if method == 'Browser.close':
                return {}
            raise BrowserError(f'{method}: Chromium has ended') from None
        if 'error' in answer:
            raise BrowserError(f'{method}: {answer["error"]["message"]}')
        return answer['result']
