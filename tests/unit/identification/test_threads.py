"""Linear algebra runs on one thread inside the context, and as before afterwards."""

import threadpoolctl

from identification.threads import use_one_thread


def count_threads():
    pools = [pool for pool in threadpoolctl.threadpool_info() if pool["user_api"] == "blas"]
    assert pools
    return [pool["num_threads"] for pool in pools]


def test_every_library_has_one_thread_inside_and_as_many_as_before_afterwards():
    with threadpoolctl.threadpool_limits(2, "blas"):
        before = count_threads()
        for _ in range(2):
            with use_one_thread():
                assert set(count_threads()) == {1}
            assert count_threads() == before
        assert max(before) == 2
