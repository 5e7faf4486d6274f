# SPDX-License-Identifier: Apache-2.0

"""Test the lesson program."""

import pytest
from turtle_brick.core import driving
from turtle_brick.core.parameters import load


@pytest.fixture(scope='module')
def lesson():
    from turtle_brick_tools.lesson import __main__  # Importing matplotlib takes half a second.
    return __main__


def test_the_named_parts_are_printed_and_drawn(lesson, tmp_path, capsys):
    assert lesson.main(['rolling', '--output', str(tmp_path / 'new')]) == 0
    assert [file.name for file in (tmp_path / 'new').iterdir()] == ['lesson-rolling.png']
    printed = capsys.readouterr().out
    assert printed.startswith('rolling:\n') and 'one turn is 1.257 m' in printed


def test_invalid_input_gives_one_sentence(lesson, tmp_path, capsys):
    with pytest.raises(SystemExit, match='2'):
        lesson.main(['flying'])
    assert "'flying' (choose from" in capsys.readouterr().err
    assert lesson.main(['--params-file', str(tmp_path / 'none.yaml')]) == 2
    assert capsys.readouterr().err.startswith('lesson: ')


@pytest.mark.parametrize(('braking_time', 'overshoots'), [(driving.BRAKING_TIME, True),
                                                          (0.2, False)])
def test_a_controller_without_prediction_overshoots_with_a_high_gain(
        monkeypatch, braking_time, overshoots):
    """Exercise 3 describes these overshoots."""
    from turtle_brick_tools.lesson import queueing  # Importing matplotlib takes half a second.
    monkeypatch.setattr(driving, 'BRAKING_TIME', braking_time)
    driver = driving.Driver(load().max_velocity)
    driver.predict = lambda pose: pose[:2]
    overshoot = max(beyond for _, beyond in queueing.approach(driver, load()))
    assert overshoot > 0.05 if overshoots else overshoot < 5e-4
