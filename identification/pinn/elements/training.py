"""Training of the network of elements: stages of increasing law weight, new meshes, multipliers at the end."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array, BoolArray
from identification.damper import Coordinates
from identification.fitting import COMMON_COUNT, COORDINATE_COUNT, Piece, Problem
from identification.pinn.common import (
    Y_UNIT,
    EffectTerms,
    ElementSettings,
    InitialStates,
    ScheduleStage,
    SlipVelocity,
    States,
    TrainingMonitor,
    TrainingPiece,
    TrainingRecord,
    TrainingStart,
    approximate_filters,
    compute_effect_delay,
    make_training_pieces,
)
from identification.pinn.elements.batches import make_batches
from identification.pinn.elements.elimination import Factorisation, NodePrior, factorise
from identification.pinn.elements.hidden_layer import HiddenLayer
from identification.pinn.elements.mesh import ElementNetwork, OutputWeights, make_mesh
from identification.pinn.elements.quadrature import compute_gauss_points
from identification.pinn.elements.residuals import ElementLoss, LossWeights, WeightedResiduals
from identification.pinn.elements.trained_network import Misfit, TrainedNetwork, compute_misfit

_LARGEST_STEP = 0.7
"""Largest change of a search coordinate in one step [1]."""
_STEP_REDUCTION, _MAX_REDUCTIONS = 0.4, 8
_COST_TOLERANCE = 1e-5
"""Threshold on the relative decrease of the cost in a step [1]: below it, a mesh is finished."""
_INITIAL_DAMPING, _FINAL_DAMPING = 1e-3, 1e-5
"""Damping of the shared unknowns per sample [1]: on the first two meshes, and later."""
_MAX_SLIP_SPACING = 1e-3
"""Largest distance of the points at which the slip velocity is evaluated [s]."""
_SETTLED_DEVIATIONS = 0.3
"""Threshold on the change of the shared unknowns on a mesh [standard deviations]: below it, a stage ends."""
_FIRST_STATE_STEPS, _LATER_STATE_STEPS = 3, 1
"""Multiplier updates with fixed shared unknowns, before their first and before each later move."""
_FINAL_MESHES, _RESTART_MESHES = 2, 4
"""Largest number of meshes in the last stage: from a nearby solution, and from initial states."""


class ElementTraining:
    """Training of one network on one problem, from one start."""

    def __init__(
        self, problem: Problem, settings: ElementSettings, monitor: TrainingMonitor, start: TrainingStart
    ) -> None:
        self.problem, self.settings, self.monitor = problem, settings, monitor
        coordinates, per_log = problem.space.to_search(start.coordinates), np.zeros(problem.layout.per_log_count)
        self.unknowns = np.concatenate([coordinates, np.zeros(2), start.effects, per_log])
        # The misfit of a start counts as noise; else the network would fit it at the law's expense.
        self.noise = max(problem.noise, start.misfit)
        self.steps = 0
        self.history: list[TrainingRecord] = []
        self.phase = ""
        self.layer_size = settings.layers[0]
        self.network = self._initialise(problem)
        self.misfit = Misfit(np.inf, np.inf, np.inf, 0.0)
        self.information = np.zeros((len(self.unknowns), len(self.unknowns)))

    def _initialise(self, problem: Problem) -> ElementNetwork:
        """Return a network with initial states for the present coordinates."""
        c = problem.space.to_coordinates(self.unknowns[:COORDINATE_COUNT])
        pieces = make_training_pieces(approximate_filters(problem))
        effect_terms = EffectTerms(problem, pieces, self.unknowns) if problem.effects else None
        initial = [
            InitialStates(
                p,
                problem.find_correction(self.unknowns, p.number).apply(c),
                effect_terms.evaluate_piece(p).values["parallel_force"] if effect_terms else 0.0,
            )
            for p in pieces
        ]
        slips = [states.make_slip_velocity() for states in initial]
        return self._make_network(pieces, slips, None, self._make_layer(), lambda i, t: initial[i].evaluate(t))

    def run(self) -> TrainedNetwork:
        """Train through all stages of the schedule."""
        for number, stage in enumerate(self.settings.schedule):
            self._train_stage(number, stage, approximate_filters(self.problem))
        return self._make_result()

    def finish(self, problem: Problem, *, restart: bool = False) -> TrainedNetwork:
        """Repeat the last stage on all samples, then enforce the law as a constraint.

        Larger hidden layers follow until the law is satisfied.

        Args:
            problem: problem with other samples or another motion.
            restart: whether to begin at initial states, because the problem has samples beyond those learned.
        """
        self.problem = problem
        if restart:
            self.network = self._initialise(problem)
        number = len(self.settings.schedule) - 1
        meshes = _RESTART_MESHES if restart else _FINAL_MESHES
        last = self.settings.schedule[number].model_copy(update={"decimation": 1, "meshes": meshes})
        self._train_stage(number, last, problem)
        self._apply_multipliers(last.law_weight)
        for size in self.settings.layers[1:]:
            if self.misfit.hysteresis <= np.hypot(self.settings.law_tolerance, self.misfit.unresolved):
                break
            self.layer_size = size
            self.network = self._replace_layer(self._make_layer())
            self._train_stage(number, last, problem)
            self._apply_multipliers(last.law_weight)
        return self._make_result()

    def _make_layer(self) -> HiddenLayer:
        return HiddenLayer(
            self.layer_size.units, self.layer_size.rank, self.settings.seed, self.settings.activation
        )

    def _replace_layer(self, layer: HiddenLayer) -> ElementNetwork:
        """Return a network with another hidden layer, fitted to the present states."""
        network = replace(self.network, layer=layer)
        return network.refit(
            self.network.mesh, self.network.evaluate_states, compute_gauss_points(self.layer_size.points)[0]
        )

    def _make_result(self) -> TrainedNetwork:
        return TrainedNetwork(self.unknowns, self.network, self.information, self.misfit, self.steps)

    def _train_stage(self, number: int, stage: ScheduleStage, problem: Problem) -> None:
        """Train with one law weight on new meshes until the elements no longer move."""
        self.phase = f"law weight {stage.law_weight:g}"
        pieces = make_training_pieces(problem, decimation=stage.decimation)
        for mesh_number in range(stage.meshes):
            shift, before = self._remesh(pieces), self.unknowns
            loss = self._make_loss(problem, pieces)
            damping = _INITIAL_DAMPING if number == 0 and mesh_number < 2 else _FINAL_DAMPING
            free = self._select_free(stage, number, mesh_number)
            self._minimise(
                loss, LossWeights(stage.law_weight, self.noise), free, stage.steps, damping * problem.samples
            )
            # A misfit that the law cannot follow counts as noise; else the network would fit it at the law's
            # expense.
            self.noise = max(problem.noise, self.misfit.force)
            if (mesh_number or number) and (shift < stage.reversal_tolerance or self._has_settled(before)):
                break

    def _has_settled(self, before: Array) -> bool:
        """Return whether the last mesh hardly changed the unknowns, even if reversals at small slip moved."""
        change = self.unknowns - before
        return float(change @ self.information @ change) < _SETTLED_DEVIATIONS**2

    def _apply_multipliers(self, law_weight: float) -> None:
        """Enforce the law as a constraint: accumulate its residuals (method of multipliers).

        The shared unknowns stay fixed until the states satisfy the law. Otherwise they would drift along
        directions that its finite weight still allows, and not return where the strokes hardly show the shape of
        the loop.
        """
        self.phase = "multipliers"
        multipliers: Sequence[WeightedResiduals] | None = None
        loss = self._make_loss(self.problem, make_training_pieces(self.problem))
        weights, free = LossWeights(law_weight, self.noise), self._select_free(self.settings.schedule[-1], 1, 1)
        for number in range(self.settings.multiplier_steps):
            for _ in range(_LATER_STATE_STEPS if number else _FIRST_STATE_STEPS):
                multipliers = loss.compute_weighted_residuals(
                    self.unknowns, self.network.output_weights, weights, multipliers, jacobian=False
                )
                self._minimise(loss, weights, np.zeros(len(self.unknowns), bool), 2, 0.0, multipliers)
            self._minimise(loss, weights, free, 4, 0.0, multipliers)
        self.information = self._factorise(loss, weights, multipliers)[0].compute_information()

    def _select_free(self, stage: ScheduleStage, number: int, mesh_number: int) -> BoolArray:
        """Return which shared unknowns (C,) may move."""
        free = self.problem.free_mask[self.problem.shared_columns]
        is_first = number == 0 and mesh_number == 0
        # Freed while the states are still those of a start, the loop's shape would run to its bounds.
        frozen = [name in stage.frozen_coordinates or (name == "eta" and is_first) for name in Coordinates._fields]
        free[:COORDINATE_COUNT] &= ~np.array(frozen)
        free[COORDINATE_COUNT:COMMON_COUNT] &= number > 0
        free[COMMON_COUNT:] &= not is_first
        return free

    def _minimise(
        self,
        loss: ElementLoss,
        weights: LossWeights,
        free: BoolArray,
        steps: int,
        damping: float,
        multipliers: Sequence[WeightedResiduals] | None = None,
    ) -> None:
        """Take Gauss-Newton steps on output weights and shared unknowns together."""
        for _ in range(steps):
            factorisation, cost = self._factorise(loss, weights, multipliers)
            low, high = (bound[self.problem.shared_columns] - self.unknowns for bound in self.problem.get_bounds())
            step = factorisation.solve_step(free, np.full(len(free), damping), low, high)
            weight_step = factorisation.solve_output_weights(step, self.network.mesh, loss.batches)
            decrease = self._search_line(loss, weights, multipliers, step, weight_step, cost)
            self.steps += 1
            self.monitor.report(f"pinn, {self.phase}", self.misfit.force)
            if decrease < _COST_TOLERANCE * cost:
                break
        self.information = factorisation.compute_information()
        self.misfit = compute_misfit(loss, self.unknowns, self.network.output_weights)
        self.history.append(TrainingRecord(self.monitor.seconds, self.phase, *self.misfit[:3]))

    def _factorise(
        self, loss: ElementLoss, weights: LossWeights, multipliers: Sequence[WeightedResiduals] | None
    ) -> tuple[Factorisation, float]:
        """Return the factorised linearisation at the present unknowns, and the cost there."""
        residuals = loss.compute_weighted_residuals(
            self.unknowns, self.network.output_weights, weights, multipliers, jacobian=True
        )
        priors = [_make_node_prior(p) for p in loss.problem.pieces]
        factorisation = factorise(residuals, loss.batches, self.network.mesh, self.network.output_weights, priors)
        return self._add_priors(factorisation), self._compute_cost(residuals, self.unknowns)

    def _add_priors(self, factorisation: Factorisation) -> Factorisation:
        """Return the factorisation with the priors of the shared unknowns."""
        weights = self.problem.shared_prior_weights
        table = np.column_stack([np.diag(weights), -weights * self.unknowns])[weights > 0.0]
        return replace(factorisation, triangle=np.vstack([factorisation.triangle, table]))

    def _compute_cost(self, residuals: Sequence[WeightedResiduals], unknowns: Array) -> float:
        """Return the sum of squares [1] of all residuals and of the priors; infinite if it is not finite."""
        prior = self.problem.shared_prior_weights * unknowns
        total = sum(float((r.vector**2).sum()) for r in residuals) + float(prior @ prior)
        return total if np.isfinite(total) else np.inf

    def _search_line(
        self,
        loss: ElementLoss,
        weights: LossWeights,
        multipliers: Sequence[WeightedResiduals] | None,
        step: Array,
        weight_step: OutputWeights,
        cost: float,
    ) -> float:
        """Shorten a step until the cost decreases, take it, and return the decrease; 0 if there is none."""
        share = min(1.0, _LARGEST_STEP / max(self._measure_step(step), 1e-12))
        for _ in range(_MAX_REDUCTIONS):
            unknowns = self.unknowns + share * step
            output_weights = self.network.output_weights.move(weight_step, share)
            residuals = loss.compute_weighted_residuals(
                unknowns, output_weights, weights, multipliers, jacobian=False
            )
            new_cost = self._compute_cost(residuals, unknowns)
            if new_cost < cost:
                self.unknowns, self.network = unknowns, replace(self.network, output_weights=output_weights)
                return cost - new_cost
            share *= _STEP_REDUCTION
        return 0.0

    def _measure_step(self, step: Array) -> float:
        """Return the size of a step of the shared unknowns (C,) in units of a search coordinate."""
        return self.problem.measure_step(self.problem.expand_shared(step))

    def _make_loss(self, problem: Problem, pieces: Sequence[TrainingPiece]) -> ElementLoss:
        delay, _ = problem.compute_residual_delays(self.unknowns)
        delay += compute_effect_delay(problem.make_active_effects(problem.expand_shared(self.unknowns)))
        weighting = self.settings.residual_weighting
        return ElementLoss(
            problem, make_batches(pieces, self.network, delay, self.layer_size.points, weighting), delay
        )

    def _remesh(self, pieces: Sequence[TrainingPiece]) -> float:
        """Make a new mesh from the network's own slip; return the largest shift of a reversal [s]."""
        before, slips = self.network, [self._make_slip_velocity(i, p) for i, p in enumerate(pieces)]
        self.network = self._make_network(pieces, slips, before, before.layer, before.evaluate_states)
        return self.network.mesh.measure_shift(before.mesh)

    def _make_slip_velocity(self, number: int, source: TrainingPiece) -> SlipVelocity:
        """Return the network's slip velocity, sampled as densely as its reversals need."""
        if self.settings.element_input == "stroke":
            return lambda time: source.inputs.evaluate_motion(time)[1]
        grid = np.arange(
            source.span.start, source.span.end + source.inputs.h, min(source.inputs.h, _MAX_SLIP_SPACING)
        )
        slip = source.inputs.evaluate_motion(grid)[1] - self.network.evaluate_inner_velocity(number, grid)
        return lambda time: np.interp(time, grid, slip)

    def _make_network(
        self,
        pieces: Sequence[TrainingPiece],
        slips: Sequence[SlipVelocity],
        before: ElementNetwork | None,
        layer: HiddenLayer,
        states: Callable[[int, Array], States],
    ) -> ElementNetwork:
        """Return a network on a new mesh, fitted to given states."""
        c = self.problem.space.to_coordinates(self.unknowns[:COORDINATE_COUNT])
        _, drive_delay = self.problem.compute_residual_delays(self.unknowns)
        mesh = make_mesh(
            [p.inputs for p in pieces], [p.span for p in pieces], slips, c.D_y, c.eta,
            [p.piece.drive_delay + drive_delay for p in pieces],
            follow_breakthrough=self.settings.element_input != "time",
        )  # fmt: skip
        network = before or ElementNetwork(layer, mesh, OutputWeights.make_empty())
        return network.refit(mesh, states, compute_gauss_points(self.layer_size.points)[0])


def _make_node_prior(piece: Piece) -> NodePrior:
    x = piece.excitation.displacement
    return NodePrior(float(x.mean()) / Y_UNIT, 0.5 * float(np.ptp(x)) / Y_UNIT)
