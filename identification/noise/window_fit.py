"""Fit of one repeated window: what neither the cycle, a slow change nor the motion explains of the force.

The force is fitted by three groups of columns: a periodic spline of the phase with one knot a sample; the same
cycle growing or moving within the window; and the part of the motion that does not repeat. The remainder is noise
of any spectrum, less what these columns take of it. That part is measured: white noise is sent through the same
fit, which gives its gain at every frequency.
"""

import numpy as np
import scipy.sparse as sp
from scipy.interpolate import BSpline
from scipy.sparse.linalg import SuperLU, splu

from identification.arrays import Array
from identification.noise.repeated_windows import RepeatedWindow

_CHANGE_KNOTS, _FEW_CHANGE_KNOTS = 32, 12
"""Knots of the spline that changes within a window, and with few cycles."""
_FEW_CYCLES = 2.5
"""Length up to which a window has few cycles [cycles]."""
_QUADRATIC_CYCLES = 7.5
"""Length from which the change may be quadratic in time [cycles]."""
_REVERSAL_WIDTH = 0.1
"""Width of the region around a reversal, relative to the standard deviation of the velocity [1]."""
_RIDGE = 1e-9
"""Ridge of the least squares, relative to the largest diagonal element [1]."""
_GAIN_SERIES, _FEWEST_GAIN_SERIES = 24, 4
"""White series that measure the gain: in a short window, and at least in a long one."""
_GAIN_SAMPLES = 500_000
"""Samples of white noise from which the number of series decreases."""


class CycleFit:
    """Least squares of the cycle and its slow change within one window."""

    def __init__(self, window: RepeatedWindow) -> None:
        """Factorise the normal equations of a window's valid samples."""
        self.window = window
        self._columns = sp.csc_array(sp.diags_array(window.valid.astype(float)) @ _make_cycle_columns(window))
        self._factors = _factorise_normal(self._columns)

    def remove(self, values: Array) -> Array:
        """Return the remainder of each column of values (N, k) after the fit; invalid samples become 0."""
        known = values * self.window.valid[:, None]
        return np.asarray(known - self._columns @ self._factors.solve(self._columns.T @ known))

    def measure_motion_difference(self) -> Array:
        """Return the root mean square displacement (cycles,) [m] of each cycle that does not repeat."""
        cycle, cycles = self.window.cycle, self.window.cycles
        remainder = self.remove(self.window.motion[:1].T)[:, 0]
        counts = np.maximum(np.bincount(cycle, self.window.valid, cycles), 1.0)
        return np.asarray(np.sqrt(np.bincount(cycle, remainder**2, cycles) / counts))


class WindowFit:
    """Least squares of the cycle, its slow change and the motion that does not repeat, within one window."""

    def __init__(self, cycle_fit: CycleFit) -> None:
        """Prepare the motion's columns and measure the gain."""
        self.window, self._cycle_fit = cycle_fit.window, cycle_fit
        # Only the remainder of the motion after the cycle's fit differs from cycle to cycle.
        columns = cycle_fit.remove(_make_motion_columns(self.window))
        self._columns = np.linalg.qr(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300))[0]
        self.gain: Array = self._measure_gain()
        """(N // 2 + 1,) mean power that the fit leaves of white noise of variance 1, at each frequency [1]."""

    def remove(self, values: Array) -> Array:
        """Return the remainder of each column of values (N, k) after the fit; invalid samples become 0."""
        remainder = self._cycle_fit.remove(values)
        return np.asarray(remainder - self._columns @ (self._columns.T @ remainder))

    def _measure_gain(self) -> Array:
        count = len(self.window.force)
        series = min(_GAIN_SERIES, max(_GAIN_SAMPLES // count, _FEWEST_GAIN_SERIES))
        white = np.random.default_rng(0).standard_normal((count, series))
        return np.asarray((np.abs(np.fft.rfft(self.remove(white), axis=0)) ** 2).mean(axis=1) / count)


def _factorise_normal(columns: sp.csc_array) -> SuperLU:
    normal = sp.csc_array(columns.T @ columns)
    ridge = _RIDGE * normal.diagonal().max() * sp.eye_array(normal.shape[0])
    # The matrix is symmetric and positive definite: this order keeps the factors of the few dense rows small.
    return splu(sp.csc_array(normal + ridge), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})


def _make_cycle_columns(window: RepeatedWindow) -> sp.csc_array:
    """Return the periodic spline, then a coarser one, the cycle and its slope, each times powers of the time."""
    phase = np.arange(len(window.force)) / window.period % 1.0
    spline = _make_periodic_spline(phase, int(window.period))
    knots = _FEW_CHANGE_KNOTS if window.cycles <= _FEW_CYCLES else _CHANGE_KNOTS
    change = _make_periodic_spline(phase, min(knots, int(window.period) // 2))
    mean = _average_cycle(window, spline)
    shapes = np.column_stack([mean, np.gradient(mean)])
    shapes /= np.maximum(shapes.std(axis=0), 1e-300)
    time = np.linspace(-1.0, 1.0, len(phase))
    powers = [time] if window.cycles < _QUADRATIC_CYCLES else [time, time**2 - 1.0 / 3.0]
    changes = [sp.diags_array(power) @ sp.hstack([change, sp.csr_array(shapes)]) for power in powers]
    return sp.csc_array(sp.hstack([spline, *changes]))


def _average_cycle(window: RepeatedWindow, spline: sp.csr_array) -> Array:
    """Return the mean cycle (N,) [N] of a window's force."""
    weighted = sp.csc_array(sp.diags_array(window.valid.astype(float)) @ spline)
    return np.asarray(spline @ _factorise_normal(weighted).solve(weighted.T @ window.force))


def _make_periodic_spline(phase: Array, knots: int) -> sp.csr_array:
    """Return the columns (N, max(knots, 4)) of a periodic cubic spline of a phase in 0 to 1."""
    knots, degree = max(knots, 4), 3
    edges = np.arange(-degree, knots + degree + 1) / knots
    open_spline = BSpline.design_matrix(np.minimum(phase, 1.0 - 1e-12), edges, degree)
    columns = np.arange(knots + degree)
    wrap = sp.coo_array((np.ones(len(columns)), (columns, columns % knots)), shape=(len(columns), knots))
    return sp.csr_array(open_spline @ wrap.tocsr())


def _make_motion_columns(window: RepeatedWindow) -> Array:
    """Return (N, 6) displacement, velocity and acceleration, everywhere and near the reversals."""
    motion = window.motion / np.maximum(window.motion.std(axis=1, keepdims=True), 1e-300)
    slow = np.exp(-((motion[1] / _REVERSAL_WIDTH) ** 2))
    return np.asarray(np.concatenate([motion, motion * slow]).T)
