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

"""The recordings of the real launch and ros2, and the files that were recorded with."""

import json
from pathlib import Path

DATA = Path(__file__).parent / 'data' / 'ros2'


def write_files(top):
    """Write the files that were recorded with into a folder."""
    for name, file in json.loads((DATA / 'files.json').read_text()).items():
        path = top / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(file['text'])
        path.chmod(0o755 if file.get('executable') else 0o644)


def with_paths(words, files):
    """Return the words of a recorded command, with the folder that those files are in now."""
    return [word.replace('$FILES', str(files)).replace('$PROBE', f'{files}/probe')
            for word in words]
