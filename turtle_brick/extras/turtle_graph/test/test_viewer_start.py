# SPDX-License-Identifier: Apache-2.0
"""Test the errors at the start of the viewer, and signals during the start of a program."""

from importlib.util import find_spec
from pathlib import Path
import sys

import pytest
from turtle_graph.client.processes import Process
from turtle_graph.client.spinning import STOP_SIGNALS
from turtle_graph.view import viewer

# A module-level skip would make the launch_testing plugin skip other modules too.
if find_spec('viser') is not None:
    from turtle_graph.view.server import check_address

TIMEOUT = 120.0
"""Timeout (s) for the start and the end of a program."""


def test_without_viser_the_viewer_prints_how_to_install_it(monkeypatch, capsys):
    monkeypatch.setattr(viewer, 'find_spec', lambda name: None)
    assert viewer.main([]) == 1
    error = capsys.readouterr().err
    assert error.count('\n') == 1 and f'pip install {viewer.VISER}' in error
    requirements = Path(__file__).parents[3] / 'scripts' / 'requirements.txt'
    assert f'\n{viewer.VISER} ' in requirements.read_text()


@pytest.mark.parametrize('number', STOP_SIGNALS)
def test_signal_during_the_creation_of_a_node_ends_the_program(number):
    # Python may run the handler of a signal that another thread receives only when the main thread
    # waits the next time, so this node waits for short times, as nodes do.
    code = """
import time

from turtle_graph.client.spinning import run_node

def create():
    print("creating", flush=True)
    while True:
        time.sleep(0.01)

run_node(create, "test")
"""
    with Process([sys.executable, '-c', code]) as running:
        running.wait_for_output('creating', TIMEOUT)
        assert running.stop(number, TIMEOUT) == 0


@pytest.mark.skipif(find_spec('viser') is None, reason='viser is not installed')
def test_invalid_address_is_named_in_the_error():
    for host, port, named in (('127.0.0.1', 65536, 'port is 65536'), ('x' * 64, 8080, 'x' * 64),
                              ('192.0.2.1', 8080, "host is '192.0.2.1'")):
        with pytest.raises(ValueError, match=named):
            check_address(host, port)
