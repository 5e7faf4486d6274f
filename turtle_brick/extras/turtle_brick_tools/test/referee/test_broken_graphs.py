# SPDX-License-Identifier: Apache-2.0
"""Test that the referee finds the faults of a broken graph, and no other faults."""

from broken_graphs import BrokenGraph, Fault, FAULTS, wrong_marks
from live_graph import observe, PROGRAM
from turtle_graph.referee.referee import RULES
from turtle_graph.referee.rules.rule import FAILED, Judgment, MET, OPEN
from turtle_graph.referee.trial import FAR_OUT

NAMES = [fault.name for fault in FAULTS]


def test_four_faults_of_one_graph_are_found(domain_id):
    faults = [fault for fault in FAULTS if fault.name in (
        'wheel backward', 'odom without twist', 'walls 0.5 m off', 'text for 5 s')]
    with BrokenGraph(faults, domain_id) as graph:
        graph.add_nodes()
        record = observe(graph, program=PROGRAM._replace(drops=(FAR_OUT,)))
    all_faults = Fault('', [name for fault in faults for name in fault.fails], firm=True)
    assert wrong_marks(all_faults, RULES.judge(record), bool(record.load_summary())) == []


def test_the_table_contains_different_faults_of_existing_requirements():
    assert len(set(NAMES)) == len(NAMES) > 24
    assert {name for fault in FAULTS for name in fault.fails} <= {rule.name for rule in RULES}


def test_a_wrong_mark_is_reported():
    fault = FAULTS[NAMES.index('wheel backward')]
    rolling, place = (Judgment(name, '', '', FAILED, 'off') for name in (*fault.fails, 'place'))
    assert wrong_marks(fault, [rolling, place._replace(mark=MET)], False) == []
    assert wrong_marks(fault, [rolling, place._replace(follows=['drop'])], False) == []
    assert wrong_marks(fault, [rolling, place], False) == ['false: place (off)']
    assert wrong_marks(fault, [rolling._replace(mark=MET)], True) == [
        'missing: drive: rolling (off)']
    opened = [place._replace(mark=OPEN)]
    assert wrong_marks(FAULTS[0], opened, True) == []
    assert wrong_marks(FAULTS[0], opened, False) == ['open: place (off)']


def test_what_depends_on_an_open_requirement_may_fail():
    fault = FAULTS[NAMES.index('brick not carried')]
    rides, angle = (Judgment(name, '', '', FAILED, 'off') for name in (
        *fault.fails, 'brick: angle'))
    assert wrong_marks(fault, [rides._replace(mark=OPEN), angle], True) == []
    assert wrong_marks(fault, [rides, angle], True) == ['false: brick: angle (off)']
