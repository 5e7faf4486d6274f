# SPDX-License-Identifier: Apache-2.0

"""Test the demo's error messages, fault detection and choice of ROS domain."""

from http.server import HTTPServer, SimpleHTTPRequestHandler
from math import dist
import os
import signal
import socket
import sys
from threading import Thread
from types import SimpleNamespace
from unittest.mock import MagicMock

from live_graph import LiveGraph, process, wait_for_exits
import psutil
import pytest
import rclpy
from rclpy.context import Context
from turtle_brick.core.parameters import load
from turtle_brick.core.reachability import resting_height
from turtle_brick_tools import demo
from turtle_brick_tools.graph import executable
from turtle_brick_tools.simulation import fall_time, guaranteed_distance
from turtle_graph.client.domains import DomainError, RANGE_VARIABLES
from turtle_graph.client.geometry import CENTER
from turtlesim.msg import Pose

WAIT = 600.0


def start_unknown_program():
    executable('no_package', 'no_program')


def start_with_invalid_arguments():
    rclpy.init(args=['--ros-args', '-p', 'colors:=[1, red]'], context=Context())


@pytest.mark.parametrize('start, domain, args, words', [
    (start_unknown_program, 'abc', '',
     "ROS_DOMAIN_ID is 'abc', but must be a whole number from 0 to 232"),
    (start_unknown_program, '233', '', "ROS_DOMAIN_ID is '233'"),
    (start_unknown_program, '', '', 'the package no_package is not installed'),
    (start_unknown_program, '', '--place 1 2 3 --place 1 2 -3',
     'z is -3 m, but must be at least 0.06 m so that the'),
    (start_with_invalid_arguments, '', '',
     "failed to initialize rcl: Couldn't parse parameter override rule")])
def test_invalid_input_gives_one_sentence(start, domain, args, words, monkeypatch, capsys):
    monkeypatch.setattr(demo, 'Graph', start)
    monkeypatch.setattr(demo, 'handle_interrupts', lambda: None)
    monkeypatch.setenv('ROS_DOMAIN_ID', domain)
    assert demo.main(args.split()) == 1
    sentence, = capsys.readouterr().err.splitlines()
    assert sentence.startswith(f'demo: {words}') and ', at /' not in sentence


@pytest.mark.parametrize('observed, fault', [
    ({'down': None}, 'the brick did not land'),
    ({'refusals': [1, 2], 'caught': False, 'distance': 9.0},
     'reported as Unreachable more than once'),
    ({'caught': False}, 'neither reported as Unreachable nor caught'),
    ({'refusals': [1], 'distance': 9.0}, 'reported as Unreachable, but caught'),
    ({'refusals': [1], 'caught': False}, 'reported as Unreachable within the guaranteed 1.46 m'),
    ({'floated': None}, 'caught, but not tipped off'),
])
def test_each_fault_is_found(observed, fault):
    def found(**observed):
        return demo.faults(SimpleNamespace(**{
            'distance': 0.0, 'refusals': [], 'down': 1, 'caught': True, 'floated': 2, **observed}),
            1.46)

    assert not found()
    assert not found(refusals=[1], caught=False, distance=1.47)
    assert found(**observed) == [fault]


def test_a_process_that_ends_is_a_fault_and_named_with_its_last_line(
        domain_id, tmp_path, monkeypatch):
    viewer = tmp_path / 'viewer'
    viewer.write_text('#!/bin/sh\necho first\necho "  no page"\nexit 3\n')
    viewer.chmod(0o755)
    monkeypatch.setattr('turtle_brick_tools.graph.executable', lambda *_: str(viewer))
    with LiveGraph(domain_id) as live:
        with pytest.raises(RuntimeError, match='^viewer exited with status 3: no page$'):
            demo.start_viewer(live)


def test_only_a_page_that_responds_is_accepted_and_only_a_free_port_chosen(monkeypatch):
    server = HTTPServer(('127.0.0.1', 0), SimpleHTTPRequestHandler)
    port = server.server_port
    assert demo.free_port(port) > port
    monkeypatch.setattr(demo, 'PAGE_TIMEOUT', 0.1)
    assert not demo.responds(port), 'the server does not respond yet'
    monkeypatch.setattr(demo, 'PAGE_TIMEOUT', WAIT)
    Thread(target=server.serve_forever, daemon=True).start()
    assert demo.responds(port)
    server.shutdown()
    server.server_close()
    assert not demo.responds(port)


def test_an_absent_page_and_other_catches_are_faults(domain_id, monkeypatch, capfd):
    monkeypatch.setattr(demo, 'bricks', lambda *_: [])
    options = SimpleNamespace(drops=0, place=[])
    with socket.create_server(('127.0.0.1', 0)) as server, LiveGraph(domain_id) as live:
        monkeypatch.setattr(demo, 'PAGE_TIMEOUT', 0.1)
        assert not demo.run_scenario(live, options, load(), server.getsockname()[1])
    page, catches, summary = capfd.readouterr().out.splitlines()
    assert page.startswith('FAULT: the page http://127.0.0.1:')
    assert catches == 'FAULT: not exactly the first brick was caught'
    assert summary.endswith('2 faulty')


def test_by_default_one_of_two_bricks_can_be_caught():
    parameters = load()
    near, far = demo.bricks(demo.parse([]), MagicMock(), parameters)
    assert dist(near[:2], CENTER) < guaranteed_distance(near[2], parameters)
    assert far[2] > resting_height(parameters)
    reach = parameters.max_velocity * fall_time(far[2], parameters) + parameters.platform_radius
    assert dist(far[:2], CENTER) > reach


def test_ctrl_c_does_not_hide_a_fault(monkeypatch):
    monkeypatch.setattr(demo, 'Graph', MagicMock(**{
        'return_value.__enter__.return_value.spin_until.side_effect': KeyboardInterrupt}))
    monkeypatch.setattr(demo, 'is_interactive', lambda: True)
    for good in (True, False):
        monkeypatch.setattr(demo, 'run_scenario', lambda *_, good=good: good)
        assert demo.run(demo.parse(['--no-view']), load()) == int(not good)


def test_demo_reserves_and_prints_an_empty_domain(monkeypatch, capsys):
    for name in (*RANGE_VARIABLES, 'ROS_DOMAIN_ID'):
        monkeypatch.setenv(name, '')  # monkeypatch restores this variable after the test.
    with demo.choose_domain() as shared:
        first = os.environ['ROS_DOMAIN_ID']
        assert os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'
        assert not shared
        assert f'export ROS_DOMAIN_ID={first}\n' in capsys.readouterr().out
        os.environ['ROS_DOMAIN_ID'] = ''
        with demo.choose_domain():
            assert os.environ['ROS_DOMAIN_ID'] != first
    for variable in RANGE_VARIABLES:
        os.environ[variable] = 'SUBNET'  # Other machines may run nodes in this domain.
        with demo.choose_domain() as shared:
            assert shared and os.environ.pop(variable) == 'SUBNET'


def test_demo_uses_the_domain_of_the_user(domain_id):
    with demo.choose_domain() as shared:
        assert not shared
        assert os.environ['ROS_DOMAIN_ID'] == str(domain_id)
    with LiveGraph(domain_id), demo.choose_domain() as shared:
        assert shared


DEMO = [sys.executable, '-m', 'turtle_brick_tools.demo', *'--place 5.5 5.5 8'.split() * 18]


def processes_of(demo_process):
    """Return the processes that the demo started, first the viewer, after the first drop."""
    demo_process.wait_for_output('brick is falling', WAIT)
    children = psutil.Process(demo_process.pid).children(recursive=True)
    return sorted(children, key=lambda child: 'viewer' not in ' '.join(child.cmdline()))


def test_a_process_that_dies_is_a_fault(domain_id):
    with process(DEMO, domain_id, stop=None, timeout=WAIT) as program:
        processes_of(program)[0].kill()
        assert program.wait(WAIT) == 1
        assert program.output.splitlines()[-1].startswith('demo: viewer exited with status -9: ')
        assert ' dropped: ' not in program.output


def test_all_processes_end_with_the_demo(domain_id):
    with process(DEMO, domain_id, stop=None, timeout=WAIT) as program:
        ends = [os.pidfd_open(process.pid) for process in processes_of(program)]
        program.send(signal.SIGHUP)
        wait_for_exits(ends, WAIT)


def test_publishers_of_a_robot_are_rejected_but_subscribers_are_not(live, monkeypatch):
    live.listener.create_subscription(Pose, 'turtle1/pose', print, 10)
    monkeypatch.setattr(demo, 'DISCOVERY_TIME', 0.5)
    demo.check_for_other_robots()
    live.listener.create_publisher(Pose, 'turtle1/pose', 10)
    monkeypatch.setattr(demo, 'DISCOVERY_TIME', WAIT)
    with pytest.raises(DomainError, match=f'domain {live.domain_id} .* turtle1/pose'):
        demo.check_for_other_robots()
