"""Sums of what repeated kills have shown, and their repetition on one bench after another."""

import sys
import time
from collections import Counter
from dataclasses import fields
from pathlib import Path


class Tally:
    """Base of data classes whose fields are added when the results of several benches are."""

    def __add__(self, other):
        return type(self)(**{
            one.name: getattr(self, one.name) + getattr(other, one.name) for one in fields(self)
        })  # fmt: skip

    def list_rows(self):
        """Return name and value of each row of the table."""
        values = {one.name.replace("_", " "): getattr(self, one.name) for one in fields(self)}
        return {name: dict(value) if isinstance(value, Counter) else value for name, value in values.items()}


def repeat(kill, total, most):
    """Kill as often as the command line wants, and print the sums after each bench.

    The words of the command line are a folder, the number of kills and a seed.

    Args:
        kill: kills on one bench, and returns a tally; takes a folder, the number of kills and a seed.
        total: empty tally with the counter `kills`.
        most: largest number of kills on one bench.
    """
    folder, kills, seed = Path(sys.argv[1]).absolute(), int(sys.argv[2]), int(sys.argv[3])
    began, benches = time.monotonic(), 0
    while (done := total.kills.total()) < kills:
        place = folder / f"bench-{benches}"
        place.mkdir(parents=True)
        total += kill(place, min(kills - done, most), seed + benches)
        benches += 1
        print(f"\n{benches} benches, {time.monotonic() - began:.0f} s")
        for name, value in total.list_rows().items():
            print(f"{name}: {value}", flush=True)
