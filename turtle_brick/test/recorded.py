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

from dataclasses import fields
import json
from pathlib import Path
import re

from turtle_brick.core.parameters import Parameters

DATA = Path(__file__).parent / 'data' / 'ros2'


def records(*files):
    """Return the records of files, by name, with the parameters that our nodes have today."""
    return {record['name']: {**record, 'stdout': with_parameters(record['stdout']),
                             'stderr': with_parameters(record['stderr'])}
            for file in files
            for record in json.loads((DATA / f'{file}.json').read_text())['records']}


def with_parameters(text):
    """Return what was printed, with today's parameters of our nodes where they all are named."""
    then = re.search('missing parameters: ([^;]+)', (DATA / 'cli.json').read_text())[1].split(', ')
    today = sorted(entry.name for entry in fields(Parameters))

    def listed(lines):
        names = set(lines[0].split())
        return lines[0] if not names.issuperset(then) else ''.join(
            f'  {name}\n' for name in sorted(names.difference(then).union(today)))

    text = re.sub(r'(  \S+\n)+', listed, text)
    return text.replace(', '.join(then), ', '.join(today))


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
