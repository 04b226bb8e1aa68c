"""What the harnesses call the same."""

import hypothesis.extra.numpy as arrays
import numpy as np
from benchmarks.harness.endings import digests, same
from hypothesis import given
from hypothesis import strategies as st

ARRAYS = st.one_of(
    arrays.arrays(np.float32, st.integers(0, 3), elements=st.sampled_from([0.0, -0.0, 1.0, np.nan, np.inf])),
    arrays.arrays(np.int32, st.integers(0, 3), elements=st.integers(0, 1)),
)


@given(ARRAYS, ARRAYS)
def test_digests_are_equal_exactly_where_arrays_are_the_same(one, other):
    assert (digests({"a": one}) == digests({"a": other})) == same(one, other)


def test_payloads_of_nan_do_not_count():
    odd = np.array([0x7FC00001], np.uint32).view(np.float32)
    assert digests({"a": odd}) == digests({"a": np.array([np.nan], np.float32)})
