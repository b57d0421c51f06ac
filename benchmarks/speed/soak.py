"""Soak test: ten minutes of strokes over the wires with one busy core; lost samples and load of the agent.

python -m benchmarks soak               the paper's six voltages, 100 s each
python -m benchmarks.speed.soak quick   another method
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from bench.log import read_log
from benchmarks.common import print_line

METHOD = "paper_sines"
_BUSY_LOOP = "while True: pass"
_STARTUP_TIMEOUT = 120.0
_CLOCK_TICKS = os.sysconf("SC_CLK_TCK")


def run(method: str = METHOD) -> None:
    """Record a method over the wires of a simulated rig while another process keeps one core busy."""
    with TemporaryDirectory() as folder:
        log = Path(folder) / "soak.mcap"
        shares = record_over_wires(method, log, {"busy process": _BUSY_LOOP})
        _print_report(log, shares)


def record_over_wires(method: str, log: Path, companions: dict[str, str]) -> dict[str, float]:
    """Record a method from a simulated rig into a log.

    Args:
        method: its name.
        log: file to be written; the bench's configuration is written beside it.
        companions: Python programs that run meanwhile, by name.

    Returns:
        Core load [1] of agent, simulated rig and companions.
    """
    bench = log.with_name("bench.toml")
    processes = {"simulated rig": _start_mrbench("sim", "--out", str(bench))}
    for name, program in companions.items():
        processes[name] = subprocess.Popen([sys.executable, "-c", program])
    try:
        _wait_for_file(bench, processes["simulated rig"])
        agent = _start_mrbench("run", method, "--config", str(bench), "--out", str(log))
        return _measure_shares({"agent": agent, **processes}, agent)
    finally:
        for process in processes.values():
            process.terminate()
            process.wait()


def _start_mrbench(*words: str) -> "subprocess.Popen[bytes]":
    return subprocess.Popen(
        [sys.executable, "-m", "bench.cli", *words], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )


def _wait_for_file(file: Path, process: "subprocess.Popen[bytes]") -> None:
    deadline = time.monotonic() + _STARTUP_TIMEOUT
    while not file.is_file():
        if process.poll() is not None or time.monotonic() > deadline:
            sys.exit(f"the simulated rig did not start within {_STARTUP_TIMEOUT:g} s; run `mrbench sim` alone")
        time.sleep(0.1)


def _measure_shares(
    processes: dict[str, "subprocess.Popen[bytes]"], until: "subprocess.Popen[bytes]"
) -> dict[str, float]:
    """Measure the core load [1] of each process from the tenth second until one of them ends."""
    # Imports and connections are complete by then, so that only the strokes are measured.
    time.sleep(10.0)
    begin, began = time.monotonic(), {name: _read_cpu_time(process) for name, process in processes.items()}
    # The times of an ended process cannot be read; the last reading before its end is used.
    latest, end = dict(began), begin
    while until.poll() is None:
        time.sleep(0.5)
        if until.poll() is None:
            latest, end = {name: _read_cpu_time(process) for name, process in processes.items()}, time.monotonic()
    if until.returncode:
        sys.exit(f"the run failed: {until.stderr.read().decode()[-300:] if until.stderr else ''}")
    return {name: (latest[name] - began[name]) / (end - begin) for name in processes}


def _read_cpu_time(process: "subprocess.Popen[bytes]") -> float:
    """Return the processor time [s] of a process so far."""
    # The name may contain spaces and brackets, so fields are counted after it. utime and stime: 14th and 15th.
    words = Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(words[11]) + int(words[12])) / _CLOCK_TICKS


def _print_report(log: Path, shares: dict[str, float]) -> None:
    recorded = read_log(log)
    lost = json.loads(recorded.metadata["outcome"]["lost"])
    seconds = float(recorded.samples["time"][-1] - recorded.samples["time"][0])
    print(f"soak: {seconds:.0f} s recorded, outcome {recorded.outcome}, lost: {lost or 'nothing'}")
    print_line("recorded samples", len(recorded.samples["time"]), "", "")
    for name, share in shares.items():
        print_line(f"processor time of the {name}", 100 * share, "% core", "at most 30" if name == "agent" else "")


if __name__ == "__main__":
    run(*sys.argv[1:])
