"""Changes between two results of one run."""

from bench.results import compare_results
from tests.support.result_documents import diagnosis_document, estimate, fit_document


def compare(older, newer):
    return compare_results(older, newer, ("old", "new"))


def fit(value, ci95, **changes):
    return fit_document(parameters={"alpha_a": estimate(value, "N/m", ci95)}, **changes)


def test_a_parameter_has_changed_if_each_value_is_outside_the_interval_of_the_other():
    for newer, changed in (((5.0, [4.0, 6.0]), True), ((5.0, [0.5, 9.0]), False), ((1.5, [1.4, 1.6]), False)):
        (parameter,) = compare(fit(1.0, [0.0, 2.0]), fit(*newer)).parameters
        assert (parameter.name, parameter.unit, parameter.changed) == ("alpha_a", "N/m", changed)


def test_parameters_that_are_not_determined_are_left_out():
    changes = compare(fit_document(), fit_document())
    assert [parameter.name for parameter in changes.parameters] == ["alpha_a"]
    assert not changes.answer_changed


def test_versions_and_answers_are_those_of_the_documents():
    newer = fit_document(result="not converged", provenance={"version": "0.2.0"})
    changes = compare(fit_document(), newer)
    assert (changes.older_version, changes.newer_version) == ("0.1.0", "0.2.0")
    assert (changes.older_answer, changes.newer_answer, changes.answer_changed) == (
        "converged", "not converged", True,
    )  # fmt: skip


def test_effects_of_diagnoses_are_compared_by_name_and_their_parameters_by_interval():
    older = diagnosis_document()
    late = older["effects"][0]
    later = late | {"parameters": {"delay": {"value": 0.0061, "unit": "s", "ci95": [0.006, 0.0062]}}}
    spring = late | {"name": "gas_spring", "parameters": {}}
    changes = compare(older, diagnosis_document(verdict="partly_explained", effects=[later, spring]))
    assert (changes.effects_added, changes.effects_removed) == (("gas_spring",), ())
    assert [(one.name, one.changed) for one in changes.parameters] == [("force_delay.delay", True)]
    assert (changes.older_answer, changes.newer_answer) == ("explained", "partly_explained")
