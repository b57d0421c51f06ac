"""Short recording of the laboratory damper with known truth, for the training of the networks."""

from functools import cache

import numpy as np

from identification.damper.coordinates import to_coordinates
from identification.damper.parameter_sets import find_parameter_set
from identification.fitting.force_channel import LowPass
from identification.fitting.piece import Piece
from identification.fitting.problem import Problem
from identification.fitting.recording_scales import measure_scales
from identification.fitting.search_space import SearchSpace
from identification.logs import ChannelFilter
from identification.pinn.common.initialisation import InitialStates
from identification.pinn.common.training_pieces import make_training_pieces
from identification.pinn.elements.batches import make_batches
from identification.pinn.elements.hidden_layer import HiddenLayer
from identification.pinn.elements.mesh import ElementNetwork, OutputWeights, make_mesh
from identification.pinn.elements.quadrature import compute_gauss_points
from identification.pinn.elements.residuals import ElementLoss
from identification.simulate import Excitation, SimulationModel

TRUTH = to_coordinates(find_parameter_set("laboratory").parameters)
RATE, AMPLITUDE, FREQUENCY = 1000.0, 0.010, 1.5
FILTER = ChannelFilter("butterworth", 2, 120.0)


@cache
def make_problem(levels=(0.0, 0.3, 0.5), seconds=1.5, seed=1, low_pass=False, pieces=1, effects=()) -> Problem:
    """Return a problem of one sine, some seconds at each drive level, with one per cent of noise on the force.

    Effects act in the recording; the problem itself contains the law alone.
    """
    made = [_make_piece(levels, seconds, seed + k, low_pass, effects) for k in range(pieces)]
    noise = 0.01 * float(np.std(made[0].force))
    return Problem(tuple(made), SearchSpace(min(levels), max(levels), measure_scales(made)), noise, 1e-4)


def _make_piece(levels, seconds, seed, low_pass, effects) -> Piece:
    t = np.arange(round(seconds * len(levels) * RATE)) / RATE
    w = 2 * np.pi * FREQUENCY
    x = AMPLITUDE * np.sin(w * t)
    drive = np.array(levels)[np.minimum((t / seconds + 1e-9).astype(int), len(levels) - 1)]
    excitation = Excitation(RATE, x, AMPLITUDE * w * np.cos(w * t), -w * w * x, drive)
    channel = LowPass(FILTER, RATE) if low_pass else None
    clean = Piece(f"piece {seed}", excitation, np.zeros(len(t)), np.ones(len(t)), low_pass=channel)
    force, _ = clean.simulate(SimulationModel(TRUTH, effects=effects))
    force = force + 0.01 * force.std() * np.random.default_rng(seed).standard_normal(len(t))
    train = np.ones(len(t))
    train[:20] = 0.0
    return Piece(clean.name, excitation, force, train, low_pass=channel)


def make_network(problem: Problem, rank=10, points=14, weighting="galerkin") -> tuple[ElementNetwork, ElementLoss]:
    """Return a small network of elements with its initial states, and its loss."""
    pieces = make_training_pieces(problem)
    initial = [InitialStates(piece, TRUTH) for piece in pieces]
    mesh = make_mesh(
        [p.inputs for p in pieces], [p.span for p in pieces], [i.make_slip_velocity() for i in initial],
        TRUTH.D_y, TRUTH.eta, [0.0] * len(pieces),
    )  # fmt: skip
    network = ElementNetwork(HiddenLayer(40, rank, 1), mesh, OutputWeights.make_empty())
    network = network.refit(mesh, lambda piece, t: initial[piece].evaluate(t), compute_gauss_points(points)[0])
    return network, ElementLoss(problem, make_batches(pieces, network, 0.0, points, weighting), 0.0)


def make_unknowns(problem: Problem, seed=0) -> np.ndarray:
    """Return shared unknowns near the truth, with delays that are not zero."""
    q = problem.space.to_search(TRUTH) + 0.1 * np.random.default_rng(seed).standard_normal(len(TRUTH))
    return np.concatenate([q, [0.3, -0.2]])
