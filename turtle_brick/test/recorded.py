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

from turtle_brick.core.parameters import ArenaParameters, CatcherParameters, RobotParameters

DATA = Path(__file__).parent / 'data' / 'ros2'
USED = {'arena': ArenaParameters, 'catcher': CatcherParameters, 'turtle_robot': RobotParameters}


def records(*files):
    """Return the records of files, by name, with the parameters that our nodes have today."""
    return {record['name']: {**record, 'stdout': with_parameters(record, record['stdout']),
                             'stderr': with_parameters(record, record['stderr'])}
            for file in files
            for record in json.loads((DATA / f'{file}.json').read_text())['records']}


def with_parameters(record, text):
    """Return what was printed, with today's parameters of the node that it is about."""
    then = re.search('missing parameters: ([^;]+)', (DATA / 'cli.json').read_text())[1].split(', ')
    asked = record['command'][-1].strip('/')

    def today(node):
        return sorted(entry.name for entry in fields(USED[node]))

    def listed(match):
        node, names = match[1] or asked, match[2].split()
        if node not in USED:
            return match[0]
        names = sorted(set(names).difference(then).union(today(node)))
        return match[0].replace(match[2], ''.join(f'  {name}\n' for name in names))

    text = re.sub(r'(?:^/(\w+):\n)?((?:  \S*[^\s:]\n)+)', listed, text, flags=re.M)
    return text.replace(', '.join(then), ', '.join(today(asked))) if asked in USED else text


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
