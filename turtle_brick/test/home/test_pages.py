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
What README.md and doc/ say is so: commands run, numbers come out, names and links exist.

A page's commands are the lines of its ```bash blocks, and what stands in `...` and begins like a
command. Each one is run, unless NOT_RUN says why not.
"""

from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from functools import partial
from importlib.util import find_spec
from itertools import pairwise
import os
from pathlib import Path
import re
import shlex
import signal
import subprocess
from threading import Event, Lock
from time import monotonic

from live_graph import NodeProcess
import pytest
from recorded import Command
from turtle_referee.graph_client.domains import reserved_domain
import yaml

PACKAGE = Path(__file__).resolve().parents[2]
ROOT = PACKAGE.parent
PAGES = [ROOT / 'README.md', *sorted(PACKAGE.glob('doc/**/*.md'))]
TIMEOUT = 180.0

PROGRAMS = ('bash', 'colcon', 'export', 'pip', 'python3', 'ros2', 'rosdep', 'source', 'sudo')
"""With what a command in the text begins."""

NOT_RUN = {
    'rosdep install|pip install': 'it installs packages',
    'colcon |bash turtle_brick/scripts/test|python3 -m pytest': 'this is one of its tests',
    'git clone |cd ': 'the address is known to the reader',
    'source install/setup.bash': 'it belongs to a workspace of the reader',
    '(python3 turtle_brick/scripts/|ros2 run turtle_brick )referee': 'it has tests of its own',
    'ros2 run turtle_brick benchmark': 'it takes minutes; see test_benchmark.py',
    'python3 turtle_brick/scripts/record_rviz|ffmpeg ': 'it makes the films; it takes rviz2',
    'ros2 run turtle_brick own_node': 'it belongs to the reader',
    r'ros2 run turtle_brick lesson \w': 'it is a part of the whole lesson',
}
"""Commands, by a pattern of how they begin, that are not run here, and why."""

ARENA = 'ros2 launch turtle_brick turtle_arena.launch.py'
"""The command that starts the graph which others talk to."""

LASTING = {
    'ros2 launch turtle_brick show_turtle': 'Robot initialized',
    'ros2 run turtle_brick sweep': 'drops; output: ',
    'ros2 run turtle_brick viewer': 'http://',
    'ros2 topic hz': 'average rate: ',
    'ros2 run tf2_ros tf2_echo': '- Matrix:',
    'python3 own_node.py': "'caught': 1",
    'bash turtle_brick/scripts/demo': 'http://',
}
"""Commands that go on until Ctrl-C, and what they print when they are up."""

TALKS = 'ros2 (node|param|service|topic|run tf2_ros)|python3 own_node'
"""Commands that talk to that graph, of ARENA."""

NEEDS_VISER = 'ros2 run turtle_brick viewer|bash turtle_brick/scripts/demo'
NEEDS_HOME = '(source|bash) turtle_brick/scripts'


# ------------------------------------------------------------------------------ what they say

def blocks(page):
    """Return the fenced blocks of a page: language and text, in order."""
    return [(language, re.sub(f'^{indent}', '', text, flags=re.M)) for indent, language, text
            in re.findall(r'^( *)```([^\n]*)\n(.*?)^ *```$', page.read_text(), re.M | re.S)]


def block(page, language, word):
    """Return the one block of a page in a language that has a word in it."""
    text, = (text for kind, text in blocks(PACKAGE / 'doc' / page)
             if kind == language and word in text)
    return text


def commands(page):
    """Return the commands of a page: in blocks, and in the text."""
    found = []
    for language, text in blocks(page):
        if language == 'bash':
            found += [re.sub(' +#.*', '', line) for line in text.splitlines()]
    prose = re.sub(r'^ *```.*?^ *```$', '', page.read_text(), flags=re.M | re.S)
    return found + [' '.join(code.split()) for code in re.findall(r'`([^`]+)`', prose)
                    if code.split()[0] in PROGRAMS and len(code.split()) > 1]


COMMANDS = list(dict.fromkeys(command for page in PAGES for command in commands(page)))
LESSON = [text for page in PAGES
          for (language, command), (following, text) in pairwise(blocks(page))
          if (language, following) == ('bash', 'text') and 'lesson' in command]
"""What the parts of the lesson print."""


def begins(command, table):
    """Return the pattern of a table that a command begins with, or None."""
    return next((pattern for pattern in table if re.match(pattern, command)), None)


# ------------------------------------------------------------------------------------ commands

HAS_DAEMON = find_spec('ros2cli.daemon') is not None
"""Whether this is the real `ros2`, which leaves that behind: it is not run in a fork."""


def run(command, domain, directory='/'):
    """Run a command in a domain to the end; return its status and what it has printed."""
    environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain)}
    if not HAS_DAEMON and re.match('ros2 (node|param|service|topic) [^>]*$', command):
        process = Command(shlex.split(command), environment, '', directory, forked=True)
        process.end(TIMEOUT)
        return process.status, process.text + process.error
    done = subprocess.run(
        ['bash', '-c', command], cwd=directory, stdin=subprocess.DEVNULL, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=TIMEOUT, env=environment)
    return done.returncode, done.stdout


def started(command, domain, directory):
    """Start a command in a shell that becomes it."""
    return NodeProcess(['bash', '-c', f'cd {shlex.quote(str(directory))} && exec {command}'],
                       domain, {'TURTLE_BRICK_VIEW': 'none'})


def interrupted(process):
    """Press Ctrl-C, which reaches all that the process has started; return its status."""
    said = None
    while 'ros2 launch' in process.command[-1] and said != process.output:
        said = process.output  # the real one may not survive it at work: test_launch_files.py
        Event().wait(0.3)
    os.killpg(process.pid, signal.SIGINT)
    return process.wait(TIMEOUT)


def try_out(command, domain, directory):
    """Do what the page says, to the command's end, and see that it has done its work."""
    for name in ('turtle_brick', 'turtle_brick_interfaces'):
        (directory / name).symlink_to(ROOT / name)
    (directory / 'own_node.py').write_text(block('changing.md', 'python', 'class OwnNode'))
    if begins(command, LASTING):
        with started(command, domain, directory) as process:
            process.wait_for_output(LASTING[begins(command, LASTING)], TIMEOUT)
            interrupted(process)
            # a real joint_state_publisher ends with a traceback
            assert 'Traceback' not in re.sub(r'\[joint_state.*', '', process.output)
        return
    status, said = run(command, domain, directory)
    assert status == 0 and 'Traceback' not in said, said
    if re.search('/drop|/place', command):
        assert 'success=True' in said
    if 'lesson' in command:
        assert said == ''.join(LESSON)


def lacks(command):
    """Return what a command needs that is not here, if there is something."""
    if re.match(NEEDS_HOME, command) and os.environ.get('TURTLE_BRICK_HOME') != f'{ROOT}/.ros':
        return 'env.bash has not been sourced'
    if re.match(NEEDS_VISER, command) and find_spec('viser') is None:
        return 'viser is not installed'


@contextmanager
def arena(directory):
    """Start the graph in a domain of its own; see in the end that Ctrl-C ends it quietly."""
    with reserved_domain() as domain, started(ARENA, domain, directory) as process:
        process.wait_for_output('waiting for a fall', TIMEOUT)
        if HAS_DAEMON:
            run('ros2 daemon start', domain)  # what it does not know, no command knows
        deadline, listed = monotonic() + TIMEOUT, ''
        while not {'/arena', '/catcher', '/catcher_state', '/odom', '/tf'} <= set(listed.split()):
            assert monotonic() < deadline, listed
            listed = ''.join(run(f'ros2 {what} list', domain)[1] for what in ('node', 'topic'))
        try:
            yield domain
            assert interrupted(process) == 0, process.output
            assert 'Traceback' not in process.output
        finally:
            if HAS_DAEMON:
                run('ros2 daemon stop', domain)


@pytest.fixture(scope='module')
def outcomes(request, tmp_path_factory):
    """Try the commands that the test is asked for, some at a time; return how each ended."""
    found, brick = {}, Lock()

    def alone(command):
        with reserved_domain() as domain:
            try_out(command, domain, tmp_path_factory.mktemp('reader'))

    def beside(domain, command):
        with brick if re.search('/drop|/place|own_node', command) else nullcontext():
            if '/drop' in command:
                run(next(place for place in COMMANDS if ' /place ' in place), domain)
            try_out(command, domain, tmp_path_factory.mktemp('reader'))

    def try_all(commands, workers, attempt):
        with ThreadPoolExecutor(workers) as pool:
            found.update((command, pool.submit(attempt, command)) for command in commands)

    def try_with_the_arena(_):
        # the longest first; most of them wait for it, most of the time
        commands = sorted(talking, key=lambda command: not re.search('own_node|/drop', command))
        with arena(tmp_path_factory.mktemp('arena')) as domain:
            try_all(commands, 6, partial(beside, domain))

    asked = [item.callspec.params['command'] for item in request.session.items
             if getattr(item, 'function', None) is test_command]
    talking = [command for command in asked if re.match(TALKS, command)]
    others = [command for command in asked if command not in (ARENA, *talking)
              and not lacks(command)]
    building = [command for command in others if 'env.bash' in command]
    try_all(building, 1, alone)  # the others would see what is built half done
    try_all([command for command in others if command not in building], 3, alone)
    if talking or ARENA in asked:
        try_all([ARENA], 1, try_with_the_arena)
    return found


@pytest.mark.parametrize('command', [
    command for command in COMMANDS if not begins(command, NOT_RUN)], ids=str)
def test_command(command, outcomes):
    if lacks(command):
        pytest.skip(lacks(command))
    (outcomes.get(command) or outcomes[ARENA]).result()


# --------------------------------------------------------------------------------------- names

def test_every_parameter_is_told_with_its_default():
    page = (PACKAGE / 'doc/graph.md').read_text().split('## Parameters\n')[1]
    told = {name: yaml.safe_load(value) for name, value in re.findall(
        r'^\| `(\w+)` \| (\[.*?\]|[\d.]+) ', page, re.M)}
    content = yaml.safe_load((PACKAGE / 'config/turtle.yaml').read_text())
    assert told == content['/**']['ros__parameters']


def slug(heading):
    """Return the anchor that GitHub gives to a heading."""
    return re.sub(r'[^\w\- ]', '', heading.lower()).replace(' ', '-')


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r'(?:\]\(|<img src=")([^)\s"]+)', page.read_text()):
        if target.startswith('https://'):
            continue
        path, _, anchor = target.partition('#')
        file = (page.parent / path).resolve() if path else page
        assert file.exists(), target
        assert not anchor or anchor in map(
            slug, re.findall('^#+ (.*)', file.read_text(), re.M)), target


def test_every_page_is_in_the_index():
    index = PACKAGE / 'doc' / 'README.md'
    told = {(index.parent / target).resolve()
            for target in re.findall(r'\]\(([^)]+\.md)\)', index.read_text())}
    assert told >= {page for page in PAGES if page not in (index, ROOT / 'README.md')}


def test_a_node_of_your_own_takes_a_line(monkeypatch):
    """The page's line is one of the list that it says."""
    given = {}
    monkeypatch.setattr('setuptools.setup', lambda **arguments: given.update(arguments))
    monkeypatch.chdir(PACKAGE)
    above, line = "'console_scripts': [\n", block('changing.md', 'python', 'own_node:main')
    text = (PACKAGE / 'setup.py').read_text()
    assert text.count(above) == 1
    exec(text.replace(above, above + line), {})
    assert given['entry_points']['console_scripts'][0] == line.strip(" ',\n")
