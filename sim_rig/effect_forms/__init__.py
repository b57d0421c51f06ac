"""Alternative forms of effects for the blind trial.

Each is either another functional form of a library effect or an effect that the library does not have. Code that
identifies or diagnoses must not import this package; an import contract checks it.
"""

from sim_rig.effect_forms import form
from sim_rig.effect_forms.arctan_saturation import ARCTAN_SATURATION
from sim_rig.effect_forms.arrhenius_heating import ARRHENIUS_HEATING
from sim_rig.effect_forms.bessel_delay import BESSEL_DELAY
from sim_rig.effect_forms.closing_joint import CLOSING_JOINT
from sim_rig.effect_forms.coercive_remanence import COERCIVE_REMANENCE
from sim_rig.effect_forms.eddy_ladder import EDDY_LADDER
from sim_rig.effect_forms.fan_step import FAN_STEP
from sim_rig.effect_forms.floor_vibration import FLOOR_VIBRATION
from sim_rig.effect_forms.form import INPUT_COUNT, MAX_PARAMETERS, MAX_STATES, AlternativeForm, Place, X
from sim_rig.effect_forms.hanging_valve import HANGING_VALVE
from sim_rig.effect_forms.loose_bolt import LOOSE_BOLT
from sim_rig.effect_forms.lugre_friction import LUGRE_FRICTION
from sim_rig.effect_forms.mass_with_mode import MASS_WITH_MODE
from sim_rig.effect_forms.rubber_stop import RUBBER_STOP
from sim_rig.effect_forms.squeeze_film_backlash import SQUEEZE_FILM_BACKLASH
from sim_rig.effect_forms.sticking_seal import STICKING_SEAL
from sim_rig.effect_forms.swelling_hum import SWELLING_HUM
from sim_rig.effect_forms.switching_pickup import SWITCHING_PICKUP
from sim_rig.effect_forms.thermal_gas import THERMAL_GAS
from sim_rig.effect_forms.transition_orifice import TRANSITION_ORIFICE
from sim_rig.effect_forms.uneven_winding import UNEVEN_WINDING
from sim_rig.effect_forms.valve_areas import VALVE_AREAS
from sim_rig.effect_forms.warm_up_drift import WARM_UP_DRIFT

FORMS: dict[str, AlternativeForm] = {
    form.form: form
    for form in (
        ARCTAN_SATURATION,
        COERCIVE_REMANENCE,
        EDDY_LADDER,
        THERMAL_GAS,
        LUGRE_FRICTION,
        TRANSITION_ORIFICE,
        VALVE_AREAS,
        ARRHENIUS_HEATING,
        RUBBER_STOP,
        SQUEEZE_FILM_BACKLASH,
        CLOSING_JOINT,
        MASS_WITH_MODE,
        BESSEL_DELAY,
        WARM_UP_DRIFT,
        SWELLING_HUM,
        UNEVEN_WINDING,
        STICKING_SEAL,
        HANGING_VALVE,
        SWITCHING_PICKUP,
        LOOSE_BOLT,
        FAN_STEP,
        FLOOR_VIBRATION,
    )
}
"""All alternative forms by name."""

__all__ = [
    "FORMS",
    "INPUT_COUNT",
    "MAX_PARAMETERS",
    "MAX_STATES",
    "AlternativeForm",
    "Place",
    "X",
    "form",
]
