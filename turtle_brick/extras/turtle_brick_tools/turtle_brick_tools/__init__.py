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
"""Programs that run, simulate and measure the ROS graph, and plot the results."""

from argparse import ArgumentTypeError
from importlib import invalidate_caches
from importlib.util import find_spec
import os
from pathlib import Path
import subprocess


def install_matplotlib() -> None:
    """Install matplotlib in the PyPI environment, to which env.bash does not add it."""
    environment = os.environ.get('TURTLE_BRICK_ENVIRONMENT')
    if environment and not find_spec('matplotlib'):
        ros = Path(environment).parent / 'turtle_brick/scripts/ros.bash'
        subprocess.run(['bash', '-c', 'source "$1"', 'bash', ros], check=False)
        invalidate_caches()


def positive_int(text: str) -> int:
    """Convert a command-line value to a positive integer."""
    if not text.isdecimal() or int(text) < 1:
        raise ArgumentTypeError(f'{text!r} is not a whole number of at least 1')
    return int(text)
