import json

import numpy as np
import pytest

from identification.damper.effects import EFFECTS
from sim_rig.errors import ScenarioError
from sim_rig.plant import Plant, blocks_in, faded_in
from sim_rig.scenario import parse_scenario
from sim_rig.scenarios.sealed import FORMS, Place
from sim_rig.scenarios.sealed import form as place_in_now
from sim_rig.scenarios.sealed.form import FIELD, FIELD_RATE, FORCE, MEMORY, NOW, V, X
from sim_rig.sealed_plant import SealedPlant, displacement_read, plant_for
from sim_rig.sensors import looked_at
from sim_rig.trial.values import RANGES

OWED = {
    *("field_saturation", "magnetic_remanence", "coil_lag", "gas_spring", "seal_friction", "orifice_turbulence"),
    *("direction_asymmetry", "viscous_heating", "end_stop", "clevis_backlash", "fixture_compliance"),
    *("moving_mass", "force_delay", "force_drift", "mains_hum", "displacement_nonlinearity"),
}
NEUTRAL = {Place.COIL: FIELD, Place.CHANNEL: FORCE, Place.POSITION: X}


def usual(name, **changes):
    form = FORMS[name]
    values = {quantity.symbol: quantity.scale for quantity in form.parameters}
    return {"name": form.effect, "form": name, "parameters": {**values, **changes}}


def rig(*sealed, **more):
    document = {"schema": "mrbench.scenario/1", "actuator": {"stiffness": 1e12}, "sealed": list(sealed), **more}
    return parse_scenario(json.dumps(document), "of a test")


@pytest.fixture(scope="module")
def stroke():
    """Commands of three seconds: 10 mm at 2 Hz, the drive stepping half way; one more displacement."""
    time = np.arange(3001) * 1e-3
    command = faded_in(rig(), time, 0.01 * np.sin(4 * np.pi * time))
    return command, np.where(time[:-1] < 1.5, 0.1, 0.4)


def played(plant_class, scenario, stroke):
    command, drive = stroke
    return plant_class(scenario, float(command[0]), float(drive[0])).play(1e-3, command, drive)


@pytest.fixture(scope="module")
def plain(stroke):
    return played(SealedPlant, rig(), stroke)


def now_at(**values):
    now = np.zeros(NOW)
    for name, value in values.items():
        now[getattr(place_in_now, name)] = value
    return now


def call(form, now, size):
    values = np.array([size] + [quantity.scale for quantity in form.parameters[1:]])
    return form.act(now, np.zeros(MEMORY), values, np.zeros(MEMORY))


def test_there_is_a_form_of_every_owed_effect_and_four_that_nobody_knows():
    assert {form.effect for form in FORMS.values() if form.known} == OWED
    unknown = {form.effect for form in FORMS.values() if not form.known}
    assert len(unknown) >= 4
    assert not unknown & set(EFFECTS)


def test_no_form_goes_by_a_name_of_the_librarys():
    names = {form.name for effect in EFFECTS.values() for form in getattr(effect, "forms", ())}
    assert not names & set(FORMS)


def test_every_drawn_parameter_exists_and_never_is_the_size():
    for name, ranges in RANGES.items():
        symbols = [quantity.symbol for quantity in FORMS[name].parameters]
        assert set(ranges) <= set(symbols[1:]), name


@pytest.mark.parametrize(
    "form", [f for f in FORMS.values() if f.place is not Place.CONNECTION], ids=lambda f: f.form
)
def test_nothing_happens_at_size_zero(form):
    now = now_at(TIME=3.2, X=0.012, V=-0.08, ACCELERATION=4.0, FIELD=0.3, FORCE=123.0)
    expected = {Place.SCALE: 1.0, **{place: now[at] for place, at in NEUTRAL.items()}}.get(form.place, 0.0)
    assert call(form, now, 0.0) == pytest.approx(expected, abs=1e-12)


def test_without_forms_it_is_the_plain_plant(stroke, plain):
    other = played(Plant, rig(), stroke)
    assert np.max(np.abs(plain.force - other.force)) < 1e-3
    assert np.array_equal(plain.output, other.output)


@pytest.mark.parametrize("name", [n for n, f in FORMS.items() if f.place is not Place.POSITION])
def test_every_form_shows_in_the_force(name, stroke, plain):
    effect = usual(name)
    if name == "on_and_off":
        effect["parameters"]["start"] = 1.0
    difference = played(SealedPlant, rig(effect), stroke).force - plain.force
    assert np.sqrt(np.mean(difference**2)) > 0.3
    assert np.all(np.isfinite(difference))


@pytest.mark.parametrize(("name", "place"), [("gas_with_wall", X), ("reynolds_transition", V), ("lugre", V)])
def test_parallel_forces_resist_extension_by_tension(name, place, stroke, plain):
    truth = played(SealedPlant, rig(usual(name)), stroke)
    beside = (truth.force - plain.force)[:: blocks_in(1e-3)]
    along = truth.damper_displacement if place == X else truth.damper_velocity
    assert np.corrcoef(beside, along)[0, 1] > 0.5


@pytest.mark.parametrize(
    "name", ["lugre", "gas_with_wall", "relaxing_rubber", "reynolds_transition", "every_nth_stroke"]
)
def test_parallel_forces_never_give_more_energy_than_they_took(name):
    """Over whole cycles of a stroke the work done on the form is not negative."""
    form, dt = FORMS[name], 1e-5
    values = np.array([quantity.scale for quantity in form.parameters])
    memory, rate, work = np.zeros(MEMORY), np.zeros(MEMORY), 0.0
    for i in range(300_000):
        t = i * dt
        now = now_at(X=0.01 * np.sin(4 * np.pi * t), V=0.04 * np.pi * np.cos(4 * np.pi * t))
        force = form.act(now, memory, values, rate)
        memory += dt * rate
        work += force * now[V] * dt if t >= 2.0 else 0.0
    assert work > -1e-6


@pytest.mark.parametrize("name", ["squeeze_film", "closing_joint", "opens_at_random"])
def test_a_connection_pulls_back_and_damps(name):
    form = FORMS[name]
    size = form.parameters[0].scale
    stretched = call(form, now_at(STRETCH=1e-3), size)
    assert stretched > 0
    assert call(form, now_at(STRETCH=-1e-3), size) == pytest.approx(-stretched)
    assert call(form, now_at(STRETCH=1e-3, STRETCH_RATE=0.01), size) > stretched


def test_play_lets_the_damper_stand_while_the_pin_crosses(stroke):
    gap = 4e-4
    truth = played(SealedPlant, rig(usual("squeeze_film", gap=gap)), stroke)
    behind = truth.position[:: blocks_in(1e-3)] - truth.damper_displacement
    assert 0.45 * gap < np.max(np.abs(behind)) < 0.6 * gap


def test_without_its_gap_a_pin_gives_way_by_less_than_any_play(stroke):
    truth = played(SealedPlant, rig(usual("squeeze_film", gap=1e-9)), stroke)
    behind = truth.position[:: blocks_in(1e-3)] - truth.damper_displacement
    assert np.max(np.abs(behind)) < 4e-6


def test_a_bending_fixture_lets_the_damper_stay_behind_by_what_the_force_asks(stroke):
    give = 2e-7
    truth = played(SealedPlant, rig(usual("closing_joint", give=give, closes=1.0)), stroke)
    behind = truth.position[:: blocks_in(1e-3)] - truth.damper_displacement
    force = truth.force[:: blocks_in(1e-3)]
    # The damping of the fixture is worth half a millisecond of its motion.
    assert np.polyfit(force, behind, 1)[0] == pytest.approx(give, rel=0.05)


def test_the_bessel_chain_delays_by_what_it_says(stroke, plain):
    delay = 4e-3
    late = played(SealedPlant, rig(usual("bessel_chain", delay=delay)), stroke).force
    quiet = slice(8 * 400, 8 * 1400)
    step = 1e-3 / blocks_in(1e-3)
    shifts = np.arange(16, 50)
    errors = [np.std(late[quiet] - plain.force[quiet.start - s : quiet.stop - s]) for s in shifts]
    assert shifts[int(np.argmin(errors))] * step == pytest.approx(delay, rel=0.15)


def test_the_mass_takes_force_in_phase_with_the_acceleration(stroke, plain):
    mass = 20.0
    more = (played(SealedPlant, rig(usual("mass_with_bracket", mass=mass)), stroke).force - plain.force)[::8]
    acceleration = np.gradient(np.gradient(plain.position[::8], 1e-3), 1e-3)
    steady = slice(1000, 2900)
    assert np.polyfit(acceleration[steady], more[steady], 1)[0] == pytest.approx(mass, rel=0.03)


def test_a_warm_damper_is_weaker_and_only_after_work(stroke, plain):
    hot = played(SealedPlant, rig(usual("arrhenius_two_nodes", activation=2e4)), stroke).force
    peak = [np.max(np.abs(f[8 * 2500 :])) for f in (hot, plain.force)]
    assert peak[0] < 0.99 * peak[1]
    assert np.allclose(hot[:800], plain.force[:800], atol=0.1)


def test_the_two_valves_strengthen_extension_alone(stroke, plain):
    more = played(SealedPlant, rig(usual("two_valves", more=0.3)), stroke)
    ratio = more.force[::8] / plain.force[::8]
    fast = np.abs(more.damper_velocity) > 0.1
    assert np.mean(ratio[fast & (more.damper_velocity > 0)]) > 1.15
    assert np.mean(ratio[fast & (more.damper_velocity < 0)]) == pytest.approx(1.0, abs=0.02)


def test_saturation_weakens_large_fields_more():
    form = FORMS["arctangent"]
    small, large = (call(form, now_at(FIELD=u), 2.0) / u for u in (0.05, 0.5))
    assert large < 0.8 * small < small <= 1.0


def test_remanence_depends_on_the_way_and_not_on_the_rate():
    """Down to the same drive, the field stands higher than on the way up, however fast it went."""
    form = FORMS["closing_loop"]
    values = np.array([0.5, 0.08])

    def felt(rate_of_field):
        memory, rate, seen = np.zeros(MEMORY), np.zeros(MEMORY), {}
        way = np.concatenate([np.linspace(0, 0.5, 5001), np.linspace(0.5, 0, 5001)])
        for i, (u, change) in enumerate(zip(way[1:], np.diff(way), strict=True)):
            now = now_at(FIELD=u)
            now[FIELD_RATE] = np.sign(change) * rate_of_field
            found = form.act(now, memory, values, rate)
            memory += rate * abs(change) / rate_of_field
            seen[i] = found
        return seen[2499], seen[7500]

    slow, fast = felt(0.1), felt(10.0)
    assert slow == pytest.approx(fast, abs=1e-9)
    assert slow[1] - slow[0] > 5e-3


def test_the_uneven_winding_is_in_the_displacement_channel_alone():
    scenario = rig(usual("uneven_winding", error=2e-4, place=4e-3, width=6e-3))
    position = np.linspace(-0.01, 0.01, 9)
    wanted = position + 2e-4 * np.exp(-(((position - 4e-3) / 6e-3) ** 2))
    assert displacement_read(scenario, position) == pytest.approx(wanted)
    assert displacement_read(rig(), position) is position


def test_the_recorded_displacement_has_the_error_of_the_uneven_winding(stroke):
    error = {"error": 2e-3, "place": 4e-3, "width": 6e-3}
    scenario = rig(usual("uneven_winding", **error))
    truth = played(SealedPlant, scenario, stroke)
    recorded = looked_at(scenario, truth, 0.0, 1e-3)["displacement"]
    assert np.max(recorded - truth.position) == pytest.approx(2e-3, rel=0.01)
    assert recorded == pytest.approx(displacement_read(scenario, truth.position))


def test_block_by_block_is_the_same_as_at_once(stroke):
    scenario = rig(usual("lugre"), usual("bessel_chain"), usual("warm_up_and_walk"))
    whole = played(SealedPlant, scenario, stroke).force
    plant = plant_for(scenario, float(stroke[0][0]), float(stroke[1][0]))
    parts = [plant.play(1e-3, stroke[0][i : i + 501], stroke[1][i : i + 500]).force for i in range(0, 3000, 500)]
    assert np.concatenate(parts) == pytest.approx(whole, abs=1e-9)


def test_scenarios_with_sealed_forms_get_their_plant():
    assert type(plant_for(rig())) is Plant
    assert type(plant_for(rig(usual("lugre")))) is SealedPlant


REFUSED = {
    "unknown form": ([{**usual("lugre"), "form": "bristles"}], "no sealed form 'bristles' of 'seal_friction'"),
    "form of another": ([{**usual("lugre"), "name": "gas_spring"}], "no sealed form 'lugre' of 'gas_spring'"),
    "missing parameter": ([{**usual("lugre"), "parameters": {"sliding": 1.0}}], "lugre takes sliding, peak"),
    "out of bounds": ([usual("lugre", sliding=-1.0)], "lugre.sliding is -1 N, outside 0 to 2000 N"),
    "twice": ([usual("lugre"), usual("lugre")], "stands twice among seal_friction"),
    "two connections": ([usual("squeeze_film"), usual("closing_joint")], "two sealed effects make one connection"),
}


@pytest.mark.parametrize(("sealed", "message"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_played_is_refused(sealed, message):
    with pytest.raises(ScenarioError, match=message):
        rig(*sealed)


def test_sealed_forms_stand_alone():
    gas = {"name": "gas_spring", "parameters": {"preload": 50.0, "length": 0.05}}
    with pytest.raises(ScenarioError, match="leave `effects` empty"):
        rig(usual("lugre"), effects=[gas])
