# SPDX-License-Identifier: Apache-2.0

"""Test the website, its build script and the referee's pages in a browser."""

from collections.abc import Iterator
import json
from pathlib import Path
import re
import shutil
import subprocess
import sys
from xml.etree.ElementTree import canonicalize

from browser import Chromium, find_chromium, TIMEOUT
import pytest
from turtle_brick.core.parameters import load
from turtle_graph.client.processes import Process
from turtle_graph.referee import class_table, report
from turtle_graph.referee.rules.rule import FAILED, Judgment, Plot
import xacro

PACKAGE = Path(__file__).resolve().parents[3]
WEBSITE = Path(__file__).resolve().parents[1]
BUILD = [sys.executable, '-I', PACKAGE / 'scripts/website']
ISOLATED = [sys.executable, '-I', '-S']  # Do not import from site-packages.
CATCH = """
import json, sys
sys.path.insert(0, sys.argv[1])
from web_arena import WebArena
arena = WebArena()
arena.call('drop')
print(json.dumps([json.loads(arena.advance(8.0))['texts'], arena.urdf]))
"""
DECISIONS = """
from random import Random
from turtle_brick.core.parameters import Parameters
from turtle_brick_tools.simulation import simulate_drop
random, decisions = Random(1), []
for seed in range(25):
    brick = random.uniform(0.0, 11.0), random.uniform(0.0, 11.0), random.uniform(2.0, 9.0)
    drop = simulate_drop(Parameters(**values), seed, seed, brick)
    decisions.append(drop.result.decision.summary)
str(decisions)
"""


def test_the_modules_of_the_site_catch_a_brick_without_any_packages(tmp_path):
    subprocess.run([*BUILD, tmp_path], check=True)
    shutil.unpack_archive(tmp_path / 'turtle_brick.zip', tmp_path / 'modules')
    output = subprocess.run([*ISOLATED, '-c', CATCH, tmp_path / 'modules'], check=True,
                            capture_output=True).stdout
    texts, urdf = json.loads(output)
    assert texts['drops'] == '1 caught, 0 refused, 0 missed'
    expected = xacro.process_file(str(PACKAGE / 'urdf/turtle.urdf.xacro')).toxml()
    assert canonicalize(urdf) == canonicalize(expected)


@pytest.mark.parametrize(('options', 'reason'), [
    (['site'], r'website: xacro or PyYAML is not installed. .*: pip install pyyaml xacro=='),
    (['--local', 'nothing', 'site'],
     r'website: nothing/\S+ is missing .*: npm install --prefix libraries pyodide@'),
    (['--docs', 'site'], r'website: --docs requires MkDocs, .*: pip install mkdocs=='),
    (['--docs', PACKAGE / 'site'], f'website: OUT is {PACKAGE}/site, but must be outside')])
def test_impossible_options_are_refused_before_anything_is_written(options, reason, tmp_path):
    done = subprocess.run([*ISOLATED, PACKAGE / 'scripts/website', *options], cwd=tmp_path,
                          capture_output=True, text=True)
    assert done.returncode == 1 and re.match(reason, done.stderr), done.stderr
    assert done.stderr.count('\n') == 1 and not any(tmp_path.iterdir())
    assert not (PACKAGE / 'site').exists()


@pytest.fixture(scope='module')
def chromium() -> Iterator[Chromium]:
    """Open a phone-sized browser window."""
    if find_chromium() is None:
        pytest.skip('Chromium is not installed. Run: apt-get install chromium')
    with Chromium(400, 800) as chromium:
        yield chromium


def test_the_pages_of_the_referee_do_not_overflow(chromium, tmp_path):
    judgments = [Judgment('b', 'ж', 'ö', FAILED, 'x' * 300, Plot('', '', '', ([], []), ([], [])))]
    about = {'seconds': 1.5, 'command': 'x', 'versions': {}, 'notes': [], 'date': '2026-11-23'}
    (tmp_path / 'page.html').write_text(report.page(judgments, about))
    (tmp_path / 'ann.json').write_text(report.as_json(judgments, about))
    class_table.summarize(tmp_path, ['b', 'a'], None, tmp_path / 'class.html')
    for name in ('page', 'class'):
        chromium.go_to(f'file://{tmp_path}/{name}.html')
        chromium.wait_for(f'location.href.endsWith("{name}.html") && document.querySelector'
                          '("table") && document.readyState === "complete"')
        assert chromium.evaluate('document.documentElement.scrollWidth') == 400


@pytest.fixture(scope='module')
def page(chromium: Chromium, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chromium]:
    """Open the website with local copies of its libraries from npm."""
    if shutil.which('npm') is None:
        pytest.skip('npm is not installed. Run: apt-get install npm')
    folder = tmp_path_factory.mktemp('web')
    libraries = set(re.findall(r'npm/(.+?@.+?)/', (WEBSITE / 'index.html').read_text()))
    pack = ['npm', 'pack', '--fetch-retries=0', '--fetch-timeout=20000', *libraries]
    if subprocess.run(pack, cwd=folder, capture_output=True, timeout=TIMEOUT).returncode != 0:
        pytest.skip(f'npm cannot download {" and ".join(libraries)}')
    for library in libraries:
        target = folder / library.partition('@')[0]
        target.mkdir()
        subprocess.run(['tar', '-xf', folder / f'{library.replace("@", "-")}.tgz', '-C', target,
                        '--strip-components=1'], check=True)
    subprocess.run([*BUILD, '--local', folder, folder / 'site'], check=True)
    serve = [sys.executable, '-u', '-m', 'http.server', '0', '--bind', '127.0.0.1', '--directory']
    with Process([*serve, str(folder / 'site')]) as server:
        port = server.wait_for_output(r'port (\d+)', TIMEOUT)[1]
        chromium.go_to(f'http://127.0.0.1:{port}/')
        chromium.wait_for('document.readyState === "complete" && loading.hidden')
        yield chromium


def fill_in(page: Chromium, name: str, value: float) -> None:
    page.evaluate(f'form.{name}.value = {value}; '
                  f'form.{name}.dispatchEvent(new Event("input", {{bubbles: true}}))')


def test_a_brick_is_placed_by_a_click_dropped_caught_and_tipped_off(page):
    x, y = page.center_of('document.querySelector("canvas")')
    page.click(x + 30.0, y + 60.0)
    page.wait_for('form.x.value !== "7.5" && brick_state.innerText === "hovering"')
    assert page.evaluate('+form.y.value < +form.x.value'), 'right of the center, near the camera'
    page.evaluate('window.states = []; new MutationObserver(() => states.push('
                  'catcher_state.innerText)).observe(catcher_state, {childList: true})')
    page.click_element('button', 'Drop the brick')
    page.wait_for('/carrying.*tilting.*waiting/.test(states)')
    assert page.evaluate('drops.innerText') == '1 caught, 0 refused, 0 missed'
    assert page.evaluate('catcher_decision.innerText').startswith('reachable: the robot, ')
    assert page.evaluate('plots.offsetTop + plots.offsetHeight - form.offsetTop') < 720, (
        'the plots are visible on a small screen')


def test_all_controls_and_plots_fit_on_a_laptop_screen(page):
    page.resize(1400, 900)
    assert page.evaluate('[plots.children.length, form.scrollHeight, document.body.scrollWidth]'
                         ) == [1, 900, 1400]
    page.resize(400, 800)


def test_an_unreachable_brick_is_refused_with_the_reason(page):
    for name, value in {'x': 0.5, 'y': 0.5, 'z': 2.5}.items():
        fill_in(page, name, value)
    page.click_element('button', 'Drop the brick')
    page.wait_for('!unreachable.hidden && brick_state.innerText === "grounded"')
    assert 'too early' in page.evaluate('catcher_decision.innerText')


def test_an_invalid_address_is_refused_and_the_sliders_have_only_valid_values(page):
    page.evaluate('location.hash = "max_velocty=5"')
    page.wait_for('error.innerText === "unknown settings in the address: max_velocty"')
    page.evaluate('location.hash = "max_velocity=-5&gravity_accel=abc"')
    page.wait_for('error.innerText.startsWith("max_velocity")')
    assert page.evaluate('error.innerText') == (
        'max_velocity is -5.0, but must be a number from 0.01 to 10 m/s')
    assert page.evaluate('form.max_velocity.value') == '3'
    for name, value in {'x': 99.0, 'y': 99.0, 'z': -99.0, 'platform_radius': 8.0}.items():
        fill_in(page, name, value)
        assert page.evaluate('error.innerText') == ''
    assert page.evaluate('arena.parameters.platform_radius') == 1.0
    page.evaluate('location.hash = "last_pose=on"')
    page.wait_for('form.last_pose.checked')
    page.evaluate('location.hash = "platform_radius=0.5"')
    page.wait_for('!form.last_pose.checked')


def test_the_platform_keeps_its_tilt_when_another_slider_moves(page):
    fill_in(page, 'tilt', 0.3)
    fill_in(page, 'platform_radius', 0.6)
    page.wait_for('arena.simulation.tilt_angle === 0.3')
    fill_in(page, 'platform_radius', 0.5)
    fill_in(page, 'tilt', 0.0)


def test_the_robot_overshoots_if_it_steers_by_the_last_pose(page):
    def farthest(goal: float) -> float:
        return max(page.evaluate(
            'arena.random.seed(1); arena.start(arena.parameters, python.toPy([5, 5, 0]));'
            f'arena.simulation.drive_to({goal}, 5); Array.from({{length: 200}}, () => '
            'JSON.parse(arena.advance(0.02)).robot[0])'))

    assert farthest(8.0) == pytest.approx(8.0, abs=0.003)
    page.evaluate('form.last_pose.click()')
    assert farthest(10.0) > 10.1


def test_the_page_makes_the_same_decisions_as_cpython(page):
    code = f'values = {vars(load())}{DECISIONS}'
    scope = {}
    exec(code, scope)
    assert page.evaluate(f'python.runPython({json.dumps(code)})') == str(scope['decisions'])
