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
"""The docstrings are in ament's style, with sections as Google has them."""

from ament_pep257.main import main
import pytest

# of NumPy's sections: a line of dashes under the heading, no colon behind it, a blank line at
# the end of the last one
NUMPY_SECTIONS = ['D406', 'D407', 'D413']


@pytest.mark.linter
@pytest.mark.pep257
def test_pep257():
    assert main(argv=['.', '--add-ignore', *NUMPY_SECTIONS]) == 0, 'docstring style errors'
