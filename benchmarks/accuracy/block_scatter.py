"""Pure noise whose blocks seem to scatter unlike noise, by the error of white noise and by simulated noise.

    python -m benchmarks.accuracy.block_scatter [--draws 200]

A residual is taken for noise only if the mean square of its blocks scatters as that of noise does. Each draw is
50 s of noise at 500 Hz. The baseline is the error that the scatter of independent blocks of white noise has.
"""

import argparse
import math

import numpy as np

from benchmarks.common.drawn_noise import SPECTRA, draw_noise
from identification.gap.data import Residual, compute_block_squares
from identification.gap.noise import CHANCE_DEVIATIONS, compute_scatter, simulate_scatter

RATE, SAMPLES = 500.0, 25_000
BLOCKS = (0.03, 0.15, 0.6)
"""Lengths of a block [s]."""


def is_refused(values: np.ndarray, block: float) -> tuple[bool, bool]:
    """Return whether noise (N,) is refused by the error of white noise, and by that of simulated noise."""
    zeros = np.zeros(len(values))
    valid = np.ones(len(values), bool)
    residual = Residual(values, zeros, zeros, zeros, valid, ((len(values), RATE),))
    squares = compute_block_squares(residual, block)
    chance, deviation = simulate_scatter(residual, block)
    distance = abs(math.log(compute_scatter(squares) / chance))
    white = math.sqrt(2.0 / (len(squares) - 1))
    return distance > CHANCE_DEVIATIONS * white, distance > CHANCE_DEVIATIONS * deviation


def main() -> None:
    """Print the share of refused draws for each spectrum and length of a block."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=200, help="draws of each row")
    draws = parser.parse_args().draws
    random = np.random.default_rng(5)
    print("| spectrum | block | refused, white noise | refused, simulated noise |\n| --- | ---: | ---: | ---: |")
    for spectrum in SPECTRA:
        for block in BLOCKS:
            refused = [is_refused(draw_noise(spectrum, SAMPLES, RATE, random), block) for _ in range(draws)]
            white, simulated = np.mean(refused, axis=0)
            print(f"| {spectrum} | {block:g} s | {white:.1%} | {simulated:.1%} |", flush=True)


if __name__ == "__main__":
    main()
