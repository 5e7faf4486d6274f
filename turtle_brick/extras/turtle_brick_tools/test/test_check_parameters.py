# SPDX-License-Identifier: Apache-2.0

"""Test the check of a parameter file with examples."""

import pytest
from turtle_brick.core.parameters import default_path
from turtle_brick_tools import check_parameters


@pytest.mark.parametrize('before, after, words', [
    ('tilt_angle: 0.7', 'tilt_angle: 1e-1', 'tilt_angle is 1e-1, which YAML reads as text. Write '
     '0.1 without quotes.'),
    ('[7.5, 7.0, 8.0]', '[7, 7.5, 8]', 'brick_start is [7, 7.5, 8], but ROS does not allow lists '
     'that mix integers and floats. Write all numbers with a decimal point.'),
    ('wheel_radius: 0.2', 'wheel_radius: .inf',
     'wheel_radius is inf, but must be a number from 0.01 to 10 m'),
    ('    tilt_angle: 0.7', '    tilt_angle: 0.7\n    tilt_angle: 1.0',
     'tilt_angle appears again in line 16. Remove one of the two lines.'),
    ('/**:', 'arena:', "there are no parameters under '/**: ros__parameters:'"),
])
def test_problem_of_a_file_is_printed_with_its_path(
        tmp_path, monkeypatch, capsys, before, after, words):
    path = tmp_path / 'turtle.yaml'
    monkeypatch.setattr('sys.argv', ['check_parameters', str(path)])
    text = default_path().read_text()
    path.write_text(text)
    assert check_parameters.main() == 0
    path.write_text(text.replace(before, after))
    assert check_parameters.main() == 1
    assert capsys.readouterr() == ('', f'turtle_brick: {path}: {words}\n')
