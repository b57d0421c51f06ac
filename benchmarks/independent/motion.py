"""Error of the estimated motion on recordings of the independent simulator, whose motion is known.

    python -m benchmarks.independent.motion [--recordings 20] [--seed 1]

Errors of the velocity are relative to its standard deviation, in motion and at rest. The largest error of the
displacement is relative to its standard deviation. The ends of a recording are left out.
"""

from argparse import ArgumentParser
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.independent.trial import draw_damper, record_case
from identification.signals import differentiate, estimate_motion

_END = 20
"""Samples left out at each end."""
_REST_SPEED = 1e-6
"""Speed over the largest one up to which the rod rests [1]."""


def main() -> None:
    """Print the errors of each recording."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with TemporaryDirectory() as folder:
        rows = [_measure(1000 * options.seed + k, Path(folder)) for k in range(options.recordings)]
    print("| recording | velocity in motion | at rest | largest of displacement |\n| --- | --- | --- | --- |")
    print("\n".join(rows))


def _measure(seed: int, folder: Path) -> str:
    """Return the row of one recording without effects."""
    case = record_case(seed, "none", folder)
    drawn = draw_damper(np.random.default_rng([seed, 41]))
    displacement = drawn.rig.record(drawn.scales.strokes)[0]
    stretch = case.recording.stretches[0]
    velocity, motion = differentiate(displacement, stretch.rate), estimate_motion(stretch)
    inner = slice(_END, -_END)
    error = (motion.velocity - velocity)[inner] / velocity.std()
    rest = np.abs(velocity)[inner] <= _REST_SPEED * np.abs(velocity).max()
    largest = np.abs(motion.displacement - displacement)[inner].max() / displacement.std()
    at_rest = f"{np.sqrt(np.mean(error[rest] ** 2)):.2e}" if rest.any() else "-"
    return f"| {case.label} | {np.sqrt(np.mean(error[~rest] ** 2)):.2e} | {at_rest} | {largest:.1e} |"


if __name__ == "__main__":
    main()
