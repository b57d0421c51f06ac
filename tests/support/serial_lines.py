"""Rig with a known force, and helpers that wait for samples without sleeping."""

import socket
import threading
import time
from collections.abc import Callable, Sequence

import numpy as np
import serial
import serial.rfc2217

from drivers.channel import SampleBlock

DEADLINE = 10.0
"""Time limit of everything that a test waits for [s]."""


class KnownForce:
    """Force known at every instant, sampled every millisecond; in real time unless a test steps it."""

    def __init__(self, force: Callable[[np.ndarray], np.ndarray], step_ns: int | None = None) -> None:
        self.force = force
        self._start_ns = time.monotonic_ns()
        self.stepped_ns = step_ns
        self._shunt = 0.0

    def now_ns(self) -> int:
        return time.monotonic_ns() - self._start_ns if self.stepped_ns is None else self.stepped_ns

    def read_latest(self, channel: str, count: int, before_ns: int) -> tuple[np.ndarray, np.ndarray]:
        assert channel == "force"
        last = before_ns // 1_000_000
        ticks = np.arange(max(last - count + 1, 0), last + 1)
        return ticks * 1_000_000, self.force(ticks) + self._shunt

    def command(self, channel: str, value: float) -> None:
        assert channel == "shunt"
        self._shunt = value


def saw(ticks: np.ndarray) -> np.ndarray:
    """Return a sawtooth of 4000 different values [N], one per millisecond."""
    return (ticks % 4000) * 0.25 - 500.0


def still(ticks: np.ndarray) -> np.ndarray:
    """Return a constant force of 123.5 N."""
    return np.full(len(ticks), 123.5)


def moving(ticks: np.ndarray) -> np.ndarray:
    """Return the force of a stroke at 2 Hz [N]."""
    return 900.0 * np.sin(4e-3 * np.pi * ticks)


def wait_until(condition: Callable[[], bool], event: str) -> None:
    """Call the condition until it holds; it must itself wait a little."""
    end = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < end, f"{event} did not occur within {DEADLINE} s"


def collect(instrument, samples: int, channel: str = "force") -> list[SampleBlock]:
    """Acquire blocks of a channel until they contain a number of samples."""
    blocks: list[SampleBlock] = []

    def is_enough() -> bool:
        blocks.extend(block for block in instrument.acquire(0.05) if block.channel == channel)
        return sum(len(block.values) for block in blocks) >= samples

    wait_until(is_enough, f"{samples} samples of {channel}")
    return blocks


def join(blocks: Sequence[SampleBlock], field: str) -> np.ndarray:
    return np.concatenate([getattr(block, field) for block in blocks])


def numbers(blocks: Sequence[SampleBlock]) -> np.ndarray:
    return np.concatenate([np.arange(len(block.values)) + block.first for block in blocks])


def is_equal(one: SampleBlock, other: SampleBlock) -> bool:
    """Return whether two blocks are bit-identical."""
    return all(
        np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b for a, b in zip(one, other, strict=True)
    )


class Rfc2217Server:
    """Serial device server of pyserial between one client and a port."""

    def __init__(self, port: str) -> None:
        self._port = port
        self._stopping = threading.Event()

    def __enter__(self) -> str:
        self._server = socket.create_server(("127.0.0.1", 0))
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()
        return f"rfc2217://127.0.0.1:{self._server.getsockname()[1]}"

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        self._thread.join()
        self._server.close()

    def _serve(self) -> None:
        self._server.settimeout(10.0)
        client, _ = self._server.accept()
        client.settimeout(0.005)
        with serial.serial_for_url(self._port, 460800, timeout=0) as device, client:
            manager = serial.rfc2217.PortManager(device, Sender(client))
            while not self._stopping.is_set():
                data = b"".join(manager.escape(device.read(4096)))
                if data:
                    client.sendall(data)
                try:
                    received = client.recv(4096)
                except TimeoutError:
                    continue
                except OSError:
                    return
                device.write(b"".join(manager.filter(received)))


class Sender:
    """Object to which pyserial's server writes its negotiation."""

    def __init__(self, client) -> None:
        self.write = client.sendall
