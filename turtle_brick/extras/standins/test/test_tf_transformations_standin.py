# SPDX-License-Identifier: Apache-2.0
"""Compare results of the tf_transformations stand-in with recordings of the real package."""

import json
from pathlib import Path

import numpy
import pytest
import tf_transformations

CALLS = json.loads(
    (Path(__file__).parent / 'data/tf2/tf_transformations.json').read_text())


@pytest.mark.parametrize('call', CALLS, ids=lambda call: call['function'])
def test_results_equal_those_of_the_real_package(call):
    result = getattr(tf_transformations, call['function'])(*call['arguments'])
    assert type(result).__name__ == call['type']
    assert numpy.asarray(result) == pytest.approx(numpy.array(call['result']), abs=1e-9)


def test_a_missing_function_is_explained():
    with pytest.raises(ImportError, match='is not in the stand-in for tf_transformations'):
        from tf_transformations import decompose_matrix  # noqa: F401
