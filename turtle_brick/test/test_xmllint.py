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
"""Check the XML files in both packages with xmllint."""

from pathlib import Path
import shutil
import subprocess

import pytest

PACKAGE = Path(__file__).resolve().parents[1]
INTERFACES = PACKAGE.parent / 'turtle_brick_interfaces'


@pytest.mark.linter
@pytest.mark.xmllint
def test_xmllint():
    main = pytest.importorskip(
        'ament_xmllint.main', reason='ament_xmllint is not installed').main
    if not shutil.which('xmllint'):
        pytest.skip('xmllint is not installed. Install libxml2-utils.')
    schema = 'http://download.ros.org/schema/package_format3.xsd'
    probe = subprocess.run(
        ['xmllint', '--noout', '--schema', schema, str(PACKAGE / 'package.xml')],
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if 'failed to load' in probe.stdout:
        pytest.skip(f'the schema for package.xml is not available: {schema}')
    assert main(argv=['--extensions', 'xml', 'xacro', '--', str(PACKAGE), str(INTERFACES)]) == 0, \
        'invalid XML'
