"""Compiled trajectories against scipy's LSODA with a right-hand side in Python, both against a tight reference."""

import time

import numpy as np
from scipy.integrate import odeint, solve_ivp

from benchmarks.timing import cpu_seconds, line, sine
from identification.damper import law
from identification.damper.coordinates import Coordinates, to_coordinates
from identification.damper.law import Number
from identification.damper.parameter_sets import parameter_set
from identification.simulate import Setting, Stroke, simulate

AMPLITUDE, FREQUENCY, DRIVE, SECONDS = 0.015, 2.5, 1.5, 100.0


class Reference:
    """The same stroke for scipy, with the law called from Python."""

    def __init__(self, c: Coordinates, start: list[float]) -> None:
        self.c, self.start, self.w = c, start, 2 * np.pi * FREQUENCY
        self.alpha, self.c0, self.c1 = c.F_a + c.F_b * DRIVE, c.c0_a + c.c0_b * DRIVE, c.c1_a + c.c1_b * DRIVE
        self.shape = (1 / c.D_y, c.rho / c.D_y, (1 - c.rho) / c.D_y, c.n)

    def y_rate(self, t: Number, y: Number, z: Number) -> Number:
        """Inner velocity [m/s] at a state."""
        x, v = AMPLITUDE * np.sin(self.w * t), AMPLITUDE * self.w * np.cos(self.w * t)
        return law.inner_velocity(x, v, y, z, self.alpha, self.c0, self.c1, self.c.k0)

    def rates(self, t: float, state: np.ndarray) -> tuple[float, float]:
        """Rates of y [m/s] and zeta [1/s]."""
        y_rate = self.y_rate(t, state[0], state[1])
        slip = AMPLITUDE * self.w * np.cos(self.w * t) - y_rate
        return y_rate, law.hysteresis_rate(slip, state[1], *self.shape)

    def force(self, t: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Force [N] (samples,) from the states (2, samples)."""
        return law.force(
            self.y_rate(t, *states), AMPLITUDE * np.sin(self.w * t), self.c1, self.c.k1, self.c.f0 / self.c.k1
        )

    def by_solve_ivp(self, seconds: float, tolerance: float) -> np.ndarray:
        """Force [N] by scipy.integrate.solve_ivp, method LSODA."""
        t = np.arange(round(seconds * 1000)) / 1000
        found = solve_ivp(
            self.rates, (0, t[-1]), self.start, "LSODA", t, rtol=tolerance, atol=tolerance * 1e-2, max_step=1e-2
        )
        return self.force(t, found.y)

    def by_odeint(self, seconds: float, tolerance: float) -> np.ndarray:
        """Force [N] by scipy.integrate.odeint, the older and faster way into LSODA."""
        t = np.arange(round(seconds * 1000)) / 1000
        found = odeint(
            self.rates, self.start, t, tfirst=True, rtol=tolerance, atol=tolerance * 1e-2, hmax=1e-2, mxstep=5000
        )
        return self.force(t, found.T)


def run() -> None:
    """Print time and error of both, and the cost of the slopes."""
    c = to_coordinates(parameter_set("spencer_1997").parameters)
    t, x, v, a = sine(AMPLITUDE, FREQUENCY, SECONDS)
    stroke = Stroke(1000.0, x, v, a, np.full(len(t), DRIVE))
    # The same start as the product's (settled_hysteresis), or the first stroke would differ.
    reference = Reference(c, [0.0, v[0] / (v[0] + 1e-3)])
    exact = simulate(Setting(c), stroke, np.full(len(t) - 1, 200, np.uint8)).force
    check = reference.by_odeint(2.0, 1e-11)
    print(f"simulation: 100 s at 1 kHz, spencer_1997 at {DRIVE} V, 15 mm 2.5 Hz")
    line(
        "200 steps a sample against LSODA rtol 1e-11 over 2 s",
        largest(exact[: len(check)], check),
        "",
        "",
    )
    began = time.process_time()
    slow = reference.by_solve_ivp(SECONDS, 1e-6)
    baseline = time.process_time() - began
    older = cpu_seconds(lambda: reference.by_odeint(SECONDS, 1e-6), 1)
    line("baseline: solve_ivp LSODA, rtol 1e-6, right-hand side in Python", baseline, "s", "")
    line("its largest error, of peak", largest(slow, exact), "", "")
    line("the same by odeint", older, "s", "")
    for fineness, bar in ((0.1, "at least 50, at rms 2e-4"), (0.005, "at least 20, at 1e-4 of peak")):
        found = simulate(Setting(c), stroke, fineness=fineness).force
        spent = cpu_seconds(lambda f=fineness: simulate(Setting(c), stroke, fineness=f))
        line(f"fineness {fineness}: baseline over our time", baseline / spent, "x", bar)
        line(f"fineness {fineness}: odeint over our time", older / spent, "x", "")
        line(f"fineness {fineness}: time", 1e3 * spent, "ms", "")
        line(
            f"fineness {fineness}: rms error, of the deviation",
            (found - exact).std() / exact.std(),
            "",
            "",
        )
        line(f"fineness {fineness}: largest error, of peak", largest(found, exact), "", "")
    plain = cpu_seconds(lambda: simulate(Setting(c), stroke))
    slopes = cpu_seconds(lambda: simulate(Setting(c), stroke, slopes=True))
    line("force and 16 sensitivities over a plain simulation", slopes / plain, "x", "at most 3.5 (14)")


def largest(found: np.ndarray, exact: np.ndarray) -> float:
    """Largest error over the peak force [1]."""
    return float(np.abs(found - exact).max() / np.abs(exact).max())
