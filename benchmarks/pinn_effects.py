"""Effects as terms of the network's residual: a damper with one or two effects, learned with and without them.

    python -m benchmarks.pinn_effects                                  the usual ones that it takes, and some pairs
    python -m benchmarks.pinn_effects gas_spring coil_lag+gas_spring   some of them

Four pairs of amplitude and frequency through six voltages, noise of one per cent, effects of the size that the
rig's scenarios have, no guess of it. The network alone: nothing is simulated before it has ended.
"""

import sys
from dataclasses import replace

import numpy as np

from benchmarks.effect_logs import scenario
from benchmarks.fitting import RISING, SHUFFLED, TRAINING, UNSEEN, stroke
from benchmarks.pinn_cases import LABORATORY
from identification.damper.effects import EFFECTS, USUAL
from identification.effect_choice import EffectChoice
from identification.piece import Piece
from identification.pinn.effect_terms import takes
from identification.pinn.result import PinnResult
from identification.pinn.settings import read_settings
from identification.pinn.train import train
from identification.prediction import predict_piece, rmse
from identification.problem import Problem
from identification.search_space import SearchSpace
from identification.simulate import ActiveEffect, Setting

PAIRS = ("coil_lag+magnetic_remanence", "gas_spring+seal_friction", "force_delay+moving_mass")
_SETTLING = 20
_CLOCKS = 5e-5
"""[s] to which channels are known, as in a diagnosis."""
_HEAD = "  {:<28} {:>8} {:>8} {:>9} {:>7} {:>9}  {}".format(
    "effects", "without", "inside", "accepted", "worst", "time", "found (true)"
)
_ROW = "  {:<28} {:>8.3f} {:>8.3f} {:>9} {:>7.1f} {:>7.1f} s  {}"

Effects = tuple[ActiveEffect, ...]


def shipped(name: str) -> ActiveEffect:
    """The effect of the scenario that ships with the rig."""
    (entry,) = scenario(name, 1.0)["effects"]
    form = EFFECTS[name].form(entry.get("form"))
    values = tuple(float(entry["parameters"][q.symbol]) for q in form.parameters)
    return ActiveEffect(EFFECTS[name], values, form.name)


def pieces_with(
    effects: Effects, pairs: tuple[tuple[float, float], ...], levels: tuple[float, ...], seed: int
) -> tuple[Piece, ...]:
    """Strokes of the laboratory damper with effects, through levels of the drive [V]."""
    random = np.random.default_rng(seed)
    return tuple(_piece(effects, a, f, levels, random) for a, f in pairs)


def _piece(
    effects: Effects, amplitude: float, frequency: float, levels: tuple[float, ...], random: np.random.Generator
) -> Piece:
    given = stroke(amplitude, frequency, levels)
    fitted = np.ones(len(given.displacement))
    fitted[:_SETTLING] = 0.0
    plain = Piece(f"{amplitude} {frequency}", given, np.zeros(len(fitted)), fitted)
    law, _ = plain.recorded(Setting(LABORATORY))
    # The damper warms by what it dissipates, which is near enough that without the effects.
    warm = replace(plain, stroke=replace(given, power=np.abs(law * given.velocity)))
    force, _ = warm.recorded(Setting(LABORATORY, effects=effects))
    return replace(warm, force=force + 0.01 * float(force.std()) * random.standard_normal(len(force)))


def unseen(found: PinnResult, effects: Effects) -> float:
    """[1] error of the identified law with its effects on other strokes, over that of the truth."""
    strokes = pieces_with(effects, UNSEEN, RISING, 500)
    answers = ((found.coordinates, found.delays, found.effects), (LABORATORY, (0.0, 0.0), effects))
    errors = [
        rmse(np.concatenate([predict_piece(p, c, late, effects=own).force - p.force for p in strokes]))
        for c, late, own in answers
    ]
    return errors[0] / errors[1]


def compared(names: str) -> str:
    """One line: a training without and one with the effects."""
    effects = tuple(shipped(name) for name in names.split("+"))
    pieces = pieces_with(effects, TRAINING, SHUFFLED, 0)
    noise = 0.01 * float(np.mean([p.force.std() for p in pieces]))
    problem = Problem(pieces, SearchSpace(0.0, 0.5), noise, _CLOCKS, delay_limit=3.0)
    settings = read_settings("local")
    choices = tuple(EffectChoice.of(e.effect.name, e.form.name) for e in effects)
    without, inside = (train(given, settings) for given in (problem, problem.with_effects(choices)))
    symbols = [q.symbol for c in choices for q in c.quantities]
    there, true = (np.concatenate([e.values for e in some]) for some in (inside.effects, effects))
    worst = float(np.max(np.abs(there - true) / inside.effect_deviations))
    words = ", ".join(f"{s} {a:.3g} ({b:.3g})" for s, a, b in zip(symbols, there, true, strict=True))
    accepted = "yes" if inside.accepted else "no"
    return _ROW.format(
        names, unseen(without, effects), unseen(inside, effects), accepted, worst, inside.seconds, words
    )


def main(names: list[str]) -> None:
    """One line for each set of effects."""
    print("unseen error over the truth's; worst of the effects' parameters in deviations; time of the one inside")
    print(_HEAD)
    for each in names:
        print(compared(each), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or [*(name for name in USUAL if takes(shipped(name).form)), *PAIRS])
