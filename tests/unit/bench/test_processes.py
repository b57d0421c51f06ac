"""Child processes and signals."""

import os
import queue
import signal
import subprocess
import sys
import threading

import pytest

from bench.processes import set_on_signals, start_line_reader, terminate


def start_python(code, **more):
    return subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True, **more)


def test_the_output_of_a_process_is_read_line_by_line_until_its_end():
    with start_python("import sys; print('one\\ntwo', file=sys.stderr)") as process:
        lines, reader = start_line_reader(process)
        assert [lines.get(timeout=10) for _ in range(3)] == ["one\n", "two\n", None]
        reader.join(10)
    assert not reader.is_alive()
    with pytest.raises(queue.Empty):
        lines.get_nowait()


@pytest.mark.parametrize(("handles", "status"), [(True, -signal.SIGTERM), (False, -signal.SIGKILL)])
def test_a_process_is_terminated_and_killed_if_it_does_not_end(handles, status):
    ignore = "" if handles else "signal.signal(signal.SIGTERM, signal.SIG_IGN);"
    with start_python(
        f"import signal, sys, time; {ignore} print('up', file=sys.stderr, flush=True); time.sleep(60)"
    ) as process:
        lines, reader = start_line_reader(process)
        assert lines.get(timeout=10) == "up\n"
        terminate(process, 10 if handles else 0.05)
        assert process.returncode == status
        reader.join(10)


def test_a_signal_sets_the_event_and_the_former_handlers_are_restored():
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    stopping = threading.Event()
    with set_on_signals(stopping):
        os.kill(os.getpid(), signal.SIGTERM)
        assert stopping.wait(10)
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before
