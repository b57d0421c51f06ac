"""The function that the engine runs in a worker's thread: an order carried out, with its ties to the scheduler."""

import os
import time
from typing import Any

from distributed import Event, get_worker

from bench.jobs.order import Order, Summary
from bench.jobs.work import Following, carry_out

TOPIC = "mrbench-jobs"
"""Where workers say what they do: `{"job": id, "doing": words}`, the words empty when they begin."""


_EVENT: Any = Event
"""Untyped in dask."""


def cancel_flag(job_id: str) -> str:
    """Name of the flag that asks a job to end; dask forgets a cancelled task, but does not stop it."""
    return f"mrbench-cancel-{job_id}"


def carry_out_order(order: Order) -> Summary:
    """Carry out an order in a worker.

    Raises:
        JobError: the work could not be done.
        JobCancelledError: its flag was raised.
    """
    worker = get_worker()
    flag: Any = _EVENT(cancel_flag(order.job_id))

    def say(words: str) -> None:
        worker.log_event(TOPIC, {"job": order.job_id, "doing": words, "worker": os.getpid(), "at": time.time()})

    say("")
    return carry_out(order, Following(say, flag.is_set))
