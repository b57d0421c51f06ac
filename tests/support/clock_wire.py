"""Device clock with a rate deviation, read over a wire with random delays."""

import numpy as np

from drivers.channel import ClockReading

BENCH = 5_000_000_000_000
DEVICE = 77_000_000_000


class ClockWire:
    """Wire to a device whose clock deviates; request and reply return delays [s] from a random generator."""

    def __init__(self, ppm, request, reply, seed=1):
        self.ppm, self._request, self._reply = ppm, request, reply
        self.random = np.random.default_rng(seed)

    def find_device_time(self, bench_ns):
        return DEVICE + int((bench_ns - BENCH) * (1 + self.ppm * 1e-6))

    def find_bench_time(self, device_ns):
        return BENCH + (np.asarray(device_ns) - DEVICE) / (1 + self.ppm * 1e-6)

    def read_clock(self, bench_ns):
        """Return a reading that was requested at an instant of the bench clock [ns]."""
        read_ns = bench_ns + int(self._request(self.random) * 1e9)
        received_ns = read_ns + int(self._reply(self.random) * 1e9)
        return ClockReading(self.find_device_time(read_ns) // 1000 * 1000, bench_ns, received_ns)
