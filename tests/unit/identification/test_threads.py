"""Linear algebra on one thread, and as before afterwards."""

import threadpoolctl

from identification.threads import one_thread


def threads_of_linear_algebra():
    found = [pool for pool in threadpoolctl.threadpool_info() if pool["user_api"] == "blas"]
    assert found
    return [pool["num_threads"] for pool in found]


def test_within_it_every_library_has_one_thread_and_afterwards_as_many_as_before():
    with threadpoolctl.threadpool_limits(2, "blas"):
        before = threads_of_linear_algebra()
        for _ in range(2):
            with one_thread():
                assert set(threads_of_linear_algebra()) == {1}
            assert threads_of_linear_algebra() == before
        assert max(before) == 2
