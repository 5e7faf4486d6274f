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
"""Find out which packages are installed."""

import contextlib
from pathlib import Path


def is_standin(package: str) -> bool:
    """Return whether an installed package is a stand-in."""
    with contextlib.suppress(ModuleNotFoundError, LookupError):
        from ament_index_python.packages import get_package_share_directory
        manifest = Path(get_package_share_directory(package), 'package.xml')
        return '<description>Stands in for' in manifest.read_text()
    return False
