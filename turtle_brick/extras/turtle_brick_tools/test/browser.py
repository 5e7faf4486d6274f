# SPDX-License-Identifier: Apache-2.0

"""Control headless Chromium through DevTools. Viser installs the websockets package."""

from base64 import b64decode
from contextlib import ExitStack
import json
import os
import shutil
from tempfile import TemporaryDirectory
from time import monotonic, sleep
from typing import Any

from turtle_graph.client.processes import Process

NAMES = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable')
"""Possible names of the executable."""

TIMEOUT = 300.0
"""Timeout (s) for each action."""

OPTIONS = (
    '--headless=new', '--no-first-run', '--disable-background-networking', '--hide-scrollbars',
    '--remote-debugging-port=0',
    # Use the slow software renderer SwiftShader only for WebGL.
    '--disable-gpu', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader')

FEW_FRAMES = """
window.requestAnimationFrame = draw => setTimeout(() => draw(performance.now()), 250);
window.cancelAnimationFrame = clearTimeout;
"""
"""Script that limits a page to four frames per second. Sixty would occupy two processors."""


def find_chromium() -> str | None:
    return next(filter(None, map(shutil.which, NAMES)), None)


class Chromium:

    def __init__(self, width: int = 1280, height: int = 720) -> None:
        """Set the width and height (pixels) of the page."""
        self._size = width, height
        self._stack = ExitStack()
        self._connection: Any = None
        self._session = ''
        self._calls = 0

    def __enter__(self) -> 'Chromium':
        from websockets.sync.client import connect
        program = find_chromium()
        assert program is not None
        width, height = self._size
        with self._stack as stack:
            profile = stack.enter_context(TemporaryDirectory(ignore_cleanup_errors=True))
            options = [*OPTIONS, f'--window-size={width},{height}', f'--user-data-dir={profile}']
            if os.geteuid() == 0:
                options.append('--no-sandbox')  # As root, Chromium cannot use its sandbox.
            process = stack.enter_context(Process([program, *options, 'about:blank']))
            address = process.wait_for_output(r'DevTools listening on (ws://\S+)\s', TIMEOUT)[1]
            self._connection = stack.enter_context(
                connect(address, max_size=None, open_timeout=TIMEOUT))
            target = next(target for target in self._call('Target.getTargets')['targetInfos']
                          if target['type'] == 'page')
            self._session = self._call(
                'Target.attachToTarget', targetId=target['targetId'], flatten=True)['sessionId']
            self._call('Page.enable')
            self._call('Page.addScriptToEvaluateOnNewDocument', source=FEW_FRAMES)
            self.resize(width, height)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def resize(self, width: int, height: int) -> None:
        """Set the width and height (pixels) of the page."""
        self._call('Emulation.setDeviceMetricsOverride', width=width, height=height,
                   deviceScaleFactor=1, mobile=False)

    def go_to(self, url: str) -> None:
        answer = self._call('Page.navigate', url=url)
        assert not answer.get('errorText'), f'{url}: {answer["errorText"]}'

    def evaluate(self, expression: str) -> Any:
        answer = self._call('Runtime.evaluate', expression=expression, returnByValue=True)
        assert 'exceptionDetails' not in answer, f'{expression}: {answer["exceptionDetails"]}'
        return answer['result'].get('value')

    def wait_for(self, expression: str) -> None:
        assert self.becomes_true(expression, TIMEOUT), (
            f'{expression} was not true within {TIMEOUT:g} s; the page shows: '
            + self.evaluate('document.body.innerText'))

    def becomes_true(self, expression: str, timeout: float = 1.0) -> bool:
        deadline = monotonic() + timeout
        while not self.evaluate(f'Boolean({expression})'):
            if monotonic() > deadline:
                return False
            sleep(0.1)
        return True

    def click_element(self, tag: str, text: str) -> None:
        """Wait for an element with a given tag and text, and click it."""
        element = (f'[...document.querySelectorAll({tag!r})]'
                   f'.find(candidate => candidate.innerText === {text!r})')
        self.wait_for(element)
        self.click(*self.center_of(
            f'document.getElementById({element}.htmlFor) || {element}'))

    def click(self, x: float, y: float, times: int = 1) -> None:
        """Click a point (pixels) on the page."""
        self._call('Input.dispatchMouseEvent', type='mouseMoved', x=x, y=y)
        for count in range(1, times + 1):
            for kind in ('mousePressed', 'mouseReleased'):
                self._call('Input.dispatchMouseEvent', type=kind, x=x, y=y, button='left',
                           clickCount=count)

    def insert_text(self, text: str) -> None:
        self._call('Input.insertText', text=text)

    def press_enter(self) -> None:
        self._call('Input.dispatchKeyEvent', type='keyDown', key='Enter', code='Enter', text='\r',
                   windowsVirtualKeyCode=13)
        self._call('Input.dispatchKeyEvent', type='keyUp', key='Enter', code='Enter')

    def box_of(self, expression: str) -> list[float]:
        """Scroll to an element and return its left edge, top edge, width and height (pixels)."""
        return self.evaluate(
            '(element => { element.scrollIntoView({block: "nearest"});'
            ' const box = element.getBoundingClientRect();'
            f' return [box.x, box.y, box.width, box.height]; }})({expression})')

    def center_of(self, expression: str) -> tuple[float, float]:
        x, y, width, height = self.box_of(expression)
        return x + width / 2.0, y + height / 2.0

    def screenshot(self, expression: str) -> bytes:
        """Return a PNG screenshot of the element selected by a JavaScript expression."""
        x, y, width, height = self.box_of(expression)
        return b64decode(self._call('Page.captureScreenshot', clip={
            'x': x, 'y': y, 'width': width, 'height': height, 'scale': 1})['data'])

    def _call(self, method: str, **parameters: Any) -> Any:
        self._calls += 1
        message = {'id': self._calls, 'method': method, 'params': parameters}
        if self._session:
            message['sessionId'] = self._session
        self._connection.send(json.dumps(message))
        answer: dict[str, Any] = {}
        while answer.get('id') != self._calls:
            answer = json.loads(self._connection.recv(timeout=TIMEOUT))
        assert 'error' not in answer, f'{method}: {answer["error"]["message"]}'
        return answer['result']
