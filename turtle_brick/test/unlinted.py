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
"""What a linter has still to look at: a file that it has accepted is as good the next time."""

from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256
from importlib.metadata import distributions
import os
from pathlib import Path


@contextmanager
def unlinted(linter: str) -> Iterator[list[str]]:
    """
    Yield the files in Python below here that have changed since a linter accepted them.

    Without a home of wheels, which remembers them, these are all. They are accepted by whoever
    leaves without an exception, as long as no other version of anything is installed.
    """
    installed = sorted(f'{found.name} {found.version}' for found in distributions())
    files = {}
    for path in sorted(Path().rglob('*.py')):
        if not any(part.startswith(('.', '_')) for part in path.parent.parts):
            known_by = f'{installed} {path} '.encode() + path.read_bytes()
            files[sha256(known_by).hexdigest()] = str(path)
    home = os.environ.get('TURTLE_BRICK_HOME')
    memory = Path(home, 'linted', linter) if home else Path(os.devnull)
    accepted = set(memory.read_text().split()) if memory.exists() else set()
    yield [path for digest, path in files.items() if digest not in accepted]
    memory.parent.mkdir(parents=True, exist_ok=True)
    memory.write_text('\n'.join(files))
