# SPDX-License-Identifier: Apache-2.0
"""
Test the commands, output, parameters and links in README.md and doc/.

A command is a line in a ```bash block, or inline code that begins with one of PROGRAMS.
The test runs each command that does not match a pattern in NOT_RUN.
"""

from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib.util import find_spec
from itertools import pairwise
import os
from pathlib import Path
import re
import shlex
import signal
import subprocess
from threading import Event
from time import monotonic

from live_graph import NodeProcess
import pytest
from turtle_graph.client.domains import reserved_domain
import yaml

PACKAGE = Path(__file__).resolve().parents[3]
ROOT = PACKAGE.parent
PAGES = [ROOT / 'README.md', *sorted(PACKAGE.glob('doc/**/*.md'))]
TIMEOUT = 600.0

PROGRAMS = ('bash', 'colcon', 'export', 'pip', 'python3', 'ros2', 'rosdep', 'source', 'sudo')

NOT_RUN = {
    'rosdep install|pip install|npm install|sudo apt': 'it installs packages',
    'colcon |bash turtle_brick/scripts/test|python3 -m pytest': 'it would run this test',
    'source (install|/opt/ros/jazzy)/setup.bash': 'it belongs to another workspace',
    '(python3 turtle_brick/scripts/|ros2 run turtle_graph )referee': 'it has its own tests',
    'ros2 launch turtle_brick_tools namespaced_arena': 'test_turtle_arena.py runs it',
    'ros2 pkg create my_package|python3 own_node.py':
        'test_own_package_starts_with_the_arena runs it',
    'ros2 run turtle_brick_tools benchmark': 'it takes minutes; test_benchmark.py runs it',
    'ros2 run turtle_brick_tools sweep': 'it takes minutes; test_sweep.py runs it',
    'python3 turtle_brick/scripts/record_rviz|ffmpeg ': 'it requires rviz2',
    'python3 turtle_brick/scripts/website --local': 'it requires npm; test_website.py runs it',
    'python3 -m http.server': 'it uses a fixed port',
    'bash turtle_brick/scripts/demo': 'test_demo.py runs the demo',
    'ros2 run turtle_brick own_node': 'it requires a change of setup.py',
    'ros2 launch my_package': 'it requires the package that another test creates',
    r'ros2 run turtle_brick_tools lesson \w': 'it is part of the complete lesson',
}
"""Patterns for commands that the test does not run, with reasons."""

ARENA = 'ros2 launch turtle_brick turtle_arena.launch.py'

LASTING = {
    'ros2 launch turtle_brick show_turtle': 'Robot initialized',
    'ros2 run turtle_graph viewer': 'http://',
    'ros2 run turtlesim turtlesim_node': 'Spawning turtle',
    'ros2 topic hz': 'average rate: ',
    'ros2 run tf2_ros tf2_echo': '- Matrix:',
}
"""Patterns for commands that run until Ctrl-C, with their expected output."""

REQUIRES_ARENA = 'ros2 (node|param|service|topic|run tf2_ros)'

SKIPPED = {}
"""Patterns for commands that cannot run in this environment, with reasons."""
if os.environ.get('TURTLE_BRICK_ENVIRONMENT') != f'{ROOT}/.ros':
    SKIPPED['(source|bash) turtle_brick/scripts'] = 'env.bash has not been sourced'
if find_spec('viser') is None:
    SKIPPED['ros2 run turtle_graph viewer'] = 'viser is missing'


def blocks(page):
    """Return the language and the text of each code block on a page."""
    return [(language, re.sub(f'^{indent}', '', text, flags=re.M)) for indent, language, text
            in re.findall(r'^( *)```([^\n]*)\n(.*?)^ *```$', page.read_text(), re.M | re.S)]


def block(page, language, word):
    return next(text for kind, text in blocks(PACKAGE / 'doc' / page)
                if kind == language and word in text)


def commands(page):
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
"""Expected output of each part of the lesson program."""


def matching(command, patterns):
    return next((pattern for pattern in patterns if re.match(pattern, command)), None)


def run(command, domain, directory='/'):
    done = subprocess.run(
        ['bash', '-c', command], cwd=directory, stdin=subprocess.DEVNULL, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=TIMEOUT,
        env={**os.environ, 'ROS_DOMAIN_ID': str(domain)})
    return done.returncode, done.stdout


def started(command, domain, directory):
    if command.startswith('ros2 launch'):
        # On an overloaded machine, a node may need more than five seconds to exit.
        command += ' view:=none sigterm_timeout:=120'
    return NodeProcess(['bash', '-c', f'cd {shlex.quote(str(directory))} && exec {command}'],
                       domain)


def interrupt(process):
    output = None
    while 'ros2 launch' in process.command[-1] and output != process.output:
        output = process.output  # `ros2 launch` may fail if it is interrupted while busy.
        Event().wait(0.3)
    os.killpg(process.pid, signal.SIGINT)
    return process.wait(TIMEOUT)


def check_command(command, domain, directory):
    for name in ('turtle_brick', 'turtle_brick_interfaces'):
        (directory / name).symlink_to(ROOT / name)
    if matching(command, LASTING):
        with started(command, domain, directory) as process:
            process.wait_for_output(LASTING[matching(command, LASTING)], TIMEOUT)
            interrupt(process)
            # The real joint_state_publisher prints a traceback when it exits.
            assert 'Traceback' not in re.sub(r'\[joint_state.*', '', process.output)
        return
    status, output = run(command, domain, directory)
    assert status == 0 and 'Traceback' not in output, output
    if re.search('/drop|/place', command):
        assert 'success=True' in output
    if 'lesson' in command:
        assert output == ''.join(LESSON)


@contextmanager
def arena(directory):
    """Start an arena in a ROS domain. Check that SIGINT stops the arena without a traceback."""
    with reserved_domain() as domain, started(ARENA, domain, directory) as process:
        process.wait_for_output('Waiting for the brick', TIMEOUT)
        has_daemon = find_spec('ros2cli.daemon') is not None
        deadline, listed = monotonic() + TIMEOUT, ''
        while has_daemon and not {'/arena', '/catcher', '/odom', '/tf'} <= set(listed.split()):
            assert monotonic() < deadline, listed
            _, listed = run('ros2 node list & ros2 topic list & wait', domain)
        try:
            yield domain
            assert interrupt(process) == 0, process.output
            assert 'Traceback' not in process.output
        finally:
            if has_daemon:
                run('ros2 daemon stop', domain)


@pytest.fixture(scope='module')
def outcomes(tmp_path_factory):
    """Run the commands on all pages, and return a future for each command."""
    futures = {}

    def check(domain, command):
        check_command(command, domain, tmp_path_factory.mktemp('reader'))

    def check_alone(command):
        with reserved_domain() as domain:
            check(domain, command)

    def check_all(commands, workers, check):
        with ThreadPoolExecutor(workers) as pool:
            futures.update((command, pool.submit(check, command)) for command in commands)

    def check_with_arena(_):
        with arena(tmp_path_factory.mktemp('arena')) as domain, \
                ThreadPoolExecutor(1) as in_order, ThreadPoolExecutor(20) as several:
            for command in talking:
                # Only one command at a time may place or drop the brick.
                pool = in_order if re.search('/place|/drop', command) else several
                futures[command] = pool.submit(check, domain, command)

    possible = [command for command in COMMANDS
                if not matching(command, [*NOT_RUN, *SKIPPED])]
    talking = [command for command in possible if re.match(REQUIRES_ARENA, command)]
    building = [command for command in possible if 'env.bash' in command]
    check_all(building, 1, check_alone)  # First run the commands that build the workspace.
    check_all([command for command in possible
               if command not in (ARENA, *talking, *building)], 3, check_alone)
    check_all([ARENA], 1, check_with_arena)
    return futures


@pytest.mark.parametrize('command', [
    command for command in COMMANDS if not matching(command, NOT_RUN)], ids=str)
def test_command(command, outcomes):
    if matching(command, SKIPPED):
        pytest.skip(SKIPPED[matching(command, SKIPPED)])
    (outcomes.get(command) or outcomes[ARENA]).result()


def test_graph_page_lists_the_default_of_each_parameter():
    page = (PACKAGE / 'doc/graph.md').read_text().split('## Parameters\n')[1]
    listed = {name: yaml.safe_load(value) for name, value in re.findall(
        r'^\| `(\w+)` \| (\[.*?\]|[\d.]+) ', page, re.M)}
    content = yaml.safe_load((PACKAGE / 'config/turtle.yaml').read_text())
    assert listed == content['/**']['ros__parameters']


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_links_have_targets(page):
    for target in re.findall(r'(?:\]\(|<img src=")([^)\s"]+)', page.read_text()):
        if target.startswith('https://'):
            continue
        path, _, anchor = target.partition('#')
        file = (page.parent / path).resolve() if path else page
        assert file.exists(), target
        if anchor:
            headings = re.findall('^#+ (.*)', file.read_text().lower(), re.M)
            # GitHub removes punctuation from anchors and replaces spaces with hyphens.
            assert anchor in [re.sub(r'[^\w\- ]', '', heading).replace(' ', '-')
                              for heading in headings], target


@pytest.mark.parametrize('page', [*PAGES, PACKAGE / 'extras/website/index.html'],
                         ids=lambda page: page.name)
def test_files_are_served_only_on_this_machine(page):
    for command in re.findall('python3 -m http.server.*', page.read_text()):
        assert '--bind 127.0.0.1' in command


def test_the_index_lists_all_pages():
    index = PACKAGE / 'doc' / 'README.md'
    listed = {(index.parent / target).resolve()
              for target in re.findall(r'\]\(([^)]+\.md)\)', index.read_text())}
    assert listed >= {page for page in PAGES if page not in (index, ROOT / 'README.md')}


def test_own_node_fits_into_the_list_of_console_scripts():
    setup = (PACKAGE / 'setup.py').read_text()
    scripts = re.search(r"'console_scripts': \[\n(.*?) +\]", setup, re.S)[1]
    line = block('changing.md', 'python', 'own_node:main')
    assert re.fullmatch(r"( {12}'\w+ = [\w.]+:\w+',\n)+", scripts + line)


def test_own_package_starts_with_the_arena(tmp_path):
    """The steps in the section "Your own package" lead to a node that drops bricks."""
    create = next(command for command in COMMANDS if re.match('ros2 pkg create .* ', command))
    status, output = run(create, 0, tmp_path)
    assert status == 0, output
    package = tmp_path / 'my_package'
    (package / 'my_package/own_node.py').write_text(
        block('changing.md', 'python', 'class OwnNode'))
    (package / 'launch').mkdir()
    (package / 'launch/own.launch.py').write_text(
        block('changing.md', 'python', "executable='own_node'"))
    setup = (package / 'setup.py').read_text()
    manifest = "        ('share/' + package_name, ['package.xml']),\n"
    assert manifest in setup
    (package / 'setup.py').write_text(setup.replace(
        manifest, manifest + block('changing.md', 'python', "'launch/own.launch.py'")))
    status, output = run('colcon build', 0, tmp_path)
    assert status == 0, output
    command = 'source install/local_setup.bash && exec ros2 launch my_package own.launch.py'
    with reserved_domain() as domain, started(
            f'bash -c "{command} view:=none"', domain, tmp_path) as process:
        process.wait_for_output("'(caught|missed|unreachable)': 1", TIMEOUT)
        interrupt(process)
        assert 'Traceback' not in process.output
