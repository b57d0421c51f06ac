"""Speed and error of the compiled simulation, compared with LSODA of scipy and a right-hand side in Python."""

import time
from functools import partial

import numpy as np
from scipy.integrate import odeint, solve_ivp

from benchmarks.common import make_sine, measure_cpu_time, print_line
from identification.damper import Coordinates, Number, find_parameter_set, law, to_coordinates
from identification.simulate import Excitation, SimulationModel, simulate

AMPLITUDE, FREQUENCY, DRIVE, SECONDS = 0.015, 2.5, 1.5, 100.0


class ReferenceSimulation:
    """Simulation of the same stroke by scipy, which calls the law in Python."""

    def __init__(self, c: Coordinates, start: list[float]) -> None:
        self.c, self.start, self.w = c, start, 2 * np.pi * FREQUENCY
        self.alpha, self.c0, self.c1 = c.F_a + c.F_b * DRIVE, c.c0_a + c.c0_b * DRIVE, c.c1_a + c.c1_b * DRIVE
        self.shape = (1 / c.D_y, c.rho / c.D_y, (1 - c.rho) / c.D_y, c.n)

    def compute_y_rate(self, t: Number, y: Number, z: Number) -> Number:
        """Compute the inner velocity [m/s] at a state."""
        x, v = AMPLITUDE * np.sin(self.w * t), AMPLITUDE * self.w * np.cos(self.w * t)
        return law.compute_inner_velocity(x, v, y, z, self.alpha, self.c0, self.c1, self.c.k0)

    def compute_rates(self, t: float, state: np.ndarray) -> tuple[float, float]:
        """Compute the rates of y [m/s] and zeta [1/s]."""
        y_rate = self.compute_y_rate(t, state[0], state[1])
        slip = AMPLITUDE * self.w * np.cos(self.w * t) - y_rate
        return y_rate, law.compute_hysteresis_rate(slip, state[1], *self.shape)

    def compute_force(self, t: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Compute the force [N], (N,), from the states (2, N)."""
        force: np.ndarray = law.compute_force(
            self.compute_y_rate(t, *states),
            AMPLITUDE * np.sin(self.w * t),
            self.c1,
            self.c.k1,
            self.c.f0 / self.c.k1,
        )
        return force

    def simulate_with_solve_ivp(self, seconds: float, tolerance: float) -> np.ndarray:
        """Return the force [N] by scipy.integrate.solve_ivp, method LSODA."""
        t = np.arange(round(seconds * 1000)) / 1000
        found = solve_ivp(
            self.compute_rates,
            (0, t[-1]),
            self.start,
            "LSODA",
            t,
            rtol=tolerance,
            atol=tolerance * 1e-2,
            max_step=1e-2,
        )
        return self.compute_force(t, found.y)

    def simulate_with_odeint(self, seconds: float, tolerance: float) -> np.ndarray:
        """Return the force [N] by scipy.integrate.odeint, the older and faster interface of LSODA."""
        t = np.arange(round(seconds * 1000)) / 1000
        found = odeint(
            self.compute_rates,
            self.start,
            t,
            tfirst=True,
            rtol=tolerance,
            atol=tolerance * 1e-2,
            hmax=1e-2,
            mxstep=5000,
        )
        return self.compute_force(t, found.T)


def run() -> None:
    """Print time and error of both, and the cost of the sensitivities."""
    c = to_coordinates(find_parameter_set("spencer_1997").parameters)
    t, x, v, a = make_sine(AMPLITUDE, FREQUENCY, SECONDS)
    stroke = Excitation(1000.0, x, v, a, np.full(len(t), DRIVE))
    # The initial states are those of `simulate`; with others the first stroke would differ.
    reference = ReferenceSimulation(c, [0.0, v[0] / (v[0] + 1e-3)])
    exact = simulate(SimulationModel(c), stroke, np.full(len(t) - 1, 200, np.uint8)).force
    check = reference.simulate_with_odeint(2.0, 1e-11)
    print(f"simulation: 100 s at 1 kHz, spencer_1997 at {DRIVE} V, 15 mm 2.5 Hz")
    print_line(
        "200 steps a sample against LSODA rtol 1e-11 over 2 s",
        find_largest_error(exact[: len(check)], check),
        "",
        "",
    )
    began = time.process_time()
    slow = reference.simulate_with_solve_ivp(SECONDS, 1e-6)
    baseline = time.process_time() - began
    older = measure_cpu_time(lambda: reference.simulate_with_odeint(SECONDS, 1e-6), 1)
    print_line("baseline: solve_ivp LSODA, rtol 1e-6, right-hand side in Python", baseline, "s", "")
    print_line("its largest error over peak", find_largest_error(slow, exact), "", "")
    print_line("baseline by odeint", older, "s", "")
    for max_travel, requirement in ((0.1, "at least 50, at rms 2e-4"), (0.005, "at least 20, at 1e-4 of peak")):
        found = simulate(SimulationModel(c), stroke, max_travel=max_travel).force
        spent = measure_cpu_time(partial(simulate, SimulationModel(c), stroke, max_travel=max_travel))
        print_line(f"max travel {max_travel}: baseline over compiled time", baseline / spent, "x", requirement)
        print_line(f"max travel {max_travel}: odeint over compiled time", older / spent, "x", "")
        print_line(f"max travel {max_travel}: time", 1e3 * spent, "ms", "")
        print_line(
            f"max travel {max_travel}: rms error over standard deviation",
            (found - exact).std() / exact.std(),
            "",
            "",
        )
        print_line(f"max travel {max_travel}: largest error over peak", find_largest_error(found, exact), "", "")
    plain = measure_cpu_time(lambda: simulate(SimulationModel(c), stroke))
    sensitive = measure_cpu_time(lambda: simulate(SimulationModel(c), stroke, sensitivities=True))
    print_line(
        "time with 16 sensitivities over time of the force alone", sensitive / plain, "x", "at most 3.5 (14)"
    )


def find_largest_error(found: np.ndarray, exact: np.ndarray) -> float:
    """Return the largest error over the peak force [1]."""
    return float(np.abs(found - exact).max() / np.abs(exact).max())
