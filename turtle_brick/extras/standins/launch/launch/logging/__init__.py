# SPDX-License-Identifier: Apache-2.0
"""The loggers and log files of a launch."""

# flake8: noqa: A005 -- the real package has this name too

from __future__ import annotations

from collections.abc import Callable, Iterable
from datetime import datetime
from functools import cache
import logging
import os
import socket
import sys
import time
from typing import TextIO

from launch.missing import missing_name

__getattr__ = missing_name('launch')


class LaunchConfig:
    """The settings of all loggers."""

    def __init__(self) -> None:
        self.level = logging.INFO
        self.on_closed_stdout: Callable[[], None] = lambda: None
        self._log_dir: str | None = None

    @property
    def log_dir(self) -> str:
        """Return the log directory of this launch, which is created if necessary."""
        if self._log_dir is None:
            home = os.environ.get('ROS_HOME') or os.path.join('~', '.ros')
            base = os.environ.get('ROS_LOG_DIR') or os.path.join(home, 'log')
            stamp = datetime.now().strftime('%Y-%m-%d-%H-%M-%S-%f')
            self._log_dir = os.path.join(
                os.path.expanduser(base), f'{stamp}-{socket.gethostname()}-{os.getpid()}')
            os.makedirs(self._log_dir)
        return self._log_dir


launch_config = LaunchConfig()


@cache
def log_file(name: str) -> TextIO:
    """Open and return a file in the log directory."""
    path = os.path.join(launch_config.log_dir, name)
    return open(path, 'a', buffering=1, encoding='utf-8', newline='')


def write(line: str, targets: Iterable[str] = ('screen', 'launch.log')) -> None:
    """Write a line to the given targets: the screen, log files, or both."""
    for name in set(targets) - {'screen'}:
        stamp = f'{time.time():.7f} ' if name == 'launch.log' else ''
        log_file(name).write(f'{stamp}{line}\n')
    if 'screen' in targets:
        try:
            sys.stdout.write(f'{line}\n')
            sys.stdout.flush()
        except OSError:  # The reader of this output has closed the pipe.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            launch_config.on_closed_stdout()


class LaunchHandler(logging.Handler):
    """A handler that writes messages to the screen and to launch.log."""

    def emit(self, record: logging.LogRecord) -> None:
        if record.levelno >= launch_config.level:
            write(f'[{record.levelname}] [{record.name}]: {record.getMessage()}')


@cache
def get_logger(name: str | None = None) -> logging.Logger:
    """Return a logger that writes to the screen and to launch.log."""
    logger = logging.Logger(name or 'root')
    logger.addHandler(LaunchHandler())
    return logger
