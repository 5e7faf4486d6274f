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
"""How judgements are told, on the terminal, as JSON and as a page."""

from io import StringIO
import json
from math import inf, nan
from xml.etree import ElementTree

import pytest
from rich.console import Console
from turtle_referee import telling
from turtle_referee.rules import BROKEN, Judgement, KEPT, OPEN, Plot, Series

JUDGEMENTS = [
    Judgement('a', 'words <b> & "more"', 'x [red]', KEPT, '1 < 2 & [bold]3[/bold]', Plot(
        'Title <&>', 'x (m)', 'y & z', [Series('<points>', [0.0, 1.0, nan], [1.0, inf, 2.0])],
        Series('line', [0.0, 1.0], [0.0, 1.0]))),
    Judgement('b', 'ж', 'ö', BROKEN, '-' * 300, Plot(
        'Empty', '', '', [], Series('', [], []))),
    Judgement('c', '', '', OPEN, '')]


def test_the_page_is_a_page():
    page = telling.page(JUDGEMENTS, {'seconds': 1.0, 'file': '<tag>'})
    doctype, text = page[:15], page[15:]
    assert doctype == '<!DOCTYPE html>'
    # Every tag but these is closed, so that what is no XML is a mistake.
    for tag in ('meta charset="utf-8"', 'meta name="viewport" content="width=device-width"'):
        text = text.replace(f'<{tag}>', f'<{tag}/>')
    root = ElementTree.fromstring(text.replace('<br>', '<br/>'))
    pytest.importorskip('matplotlib')
    assert len(root.findall('.//{http://www.w3.org/2000/svg}svg')) == 2
    assert len(root.findall('.//table/tr')) == 1 + len(JUDGEMENTS)


def test_the_json_has_everything():
    told = json.loads(telling.as_json(JUDGEMENTS, {'seconds': nan, 'notes': ['ö']}),
                      parse_constant=pytest.fail)
    assert [one['mark'] for one in told['requirements']] == [KEPT, BROKEN, OPEN]
    assert told['requirements'][0]['plot']['points'][0]['y'] == [1.0, None, 2.0]
    assert told['seconds'] is None and told['notes'] == ['ö']


def test_the_table_shows_words_as_they_are():
    told = StringIO()
    telling.print_table(JUDGEMENTS, Console(file=told, width=120))
    assert '[bold]3[/bold]' in told.getvalue() and 'x [red]' in told.getvalue()
    assert telling.summary(JUDGEMENTS) == '1 ✔ kept, 1 ✗ broken, 1 – open'


def test_what_is_not_kept_is_told_again():
    broken, unknown = telling.not_kept(JUDGEMENTS)
    assert broken.startswith(f'{BROKEN} {JUDGEMENTS[1].name}: {JUDGEMENTS[1].measured}')
    assert broken.endswith(f'; expected: {JUDGEMENTS[1].expected}')
    assert unknown == f'{OPEN} {JUDGEMENTS[2].name}: {JUDGEMENTS[2].measured}'
