"""A short recording of the laboratory damper with known truth, as the networks are trained on it."""

from functools import cache

import numpy as np

from identification.damper.coordinates import to_coordinates
from identification.damper.parameter_sets import parameter_set
from identification.force_channel import LowPass
from identification.piece import Piece
from identification.pinn.batches import learned, make_batches
from identification.pinn.beginning import FirstStates
from identification.pinn.hidden_layer import HiddenLayer
from identification.pinn.local_rows import LocalLoss
from identification.pinn.mesh import Heads, LocalNetwork, make_mesh
from identification.pinn.quadrature import gauss_points
from identification.problem import Problem
from identification.recordings import ChannelFilter
from identification.search_space import SearchSpace
from identification.simulate import Setting, Stroke

TRUTH = to_coordinates(parameter_set("laboratory").parameters)
RATE, AMPLITUDE, FREQUENCY = 1000.0, 0.010, 1.5
FILTER = ChannelFilter("butterworth", 2, 120.0)


@cache
def problem(levels=(0.0, 0.3, 0.5), seconds=1.5, seed=1, low_pass=False, pieces=1, effects=()) -> Problem:
    """One sine, some seconds at each level of the drive, noise of one per cent on the force.

    Effects are at work in the recording; the problem itself knows the law alone.
    """
    made = [_piece(levels, seconds, seed + k, low_pass, effects) for k in range(pieces)]
    noise = 0.01 * float(np.std(made[0].force))
    return Problem(tuple(made), SearchSpace(min(levels), max(levels)), noise, 1e-4)


def _piece(levels, seconds, seed, low_pass, effects) -> Piece:
    t = np.arange(round(seconds * len(levels) * RATE)) / RATE
    w = 2 * np.pi * FREQUENCY
    x = AMPLITUDE * np.sin(w * t)
    drive = np.array(levels)[np.minimum((t / seconds + 1e-9).astype(int), len(levels) - 1)]
    stroke = Stroke(RATE, x, AMPLITUDE * w * np.cos(w * t), -w * w * x, drive)
    channel = LowPass(FILTER, RATE) if low_pass else None
    clean = Piece(f"piece {seed}", stroke, np.zeros(len(t)), np.ones(len(t)), low_pass=channel)
    force, _ = clean.recorded(Setting(TRUTH, effects=effects))
    force = force + 0.01 * force.std() * np.random.default_rng(seed).standard_normal(len(t))
    train = np.ones(len(t))
    train[:20] = 0.0
    return Piece(clean.name, stroke, force, train, low_pass=channel)


def network_on(given: Problem, rank=10, points=14, residual="means") -> tuple[LocalNetwork, LocalLoss]:
    """A small local network on a problem, with states as its beginning has them."""
    sources = learned(given)
    first = [FirstStates(source, TRUTH) for source in sources]
    mesh = make_mesh(
        [s.inputs for s in sources], [s.span for s in sources], [f.slip_velocity() for f in first],
        TRUTH.D_y, TRUTH.eta, [0.0] * len(sources),
    )  # fmt: skip
    layer = HiddenLayer(40, rank, 1)
    network = LocalNetwork(layer, mesh, Heads.nothing())
    network = network.fitted(mesh, lambda piece, t: first[piece].at(t), gauss_points(points)[0])
    return network, LocalLoss(given, make_batches(sources, network, 0.0, points, residual), 0.0)
