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
"""The interfaces that this home has are the real ones: their type hashes are."""

import json
from pathlib import Path

from ament_index_python.packages import get_package_share_path
import pytest

REAL_HASHES = json.loads(
    (Path(__file__).parents[1] / 'data' / 'tf2' / 'type_hashes.json').read_text())


@pytest.mark.parametrize('interface', REAL_HASHES)
def test_type_hash_is_the_real_one(interface):
    """Field names, types, constants and their order decide on the hash, and it on the wire."""
    package, kind, name = interface.split('/')
    description = json.loads((get_package_share_path(package) / kind / f'{name}.json').read_text())
    hashes = {row['type_name']: row['hash_string'] for row in description['type_hashes']}
    assert hashes[interface] == REAL_HASHES[interface]
