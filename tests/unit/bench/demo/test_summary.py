from bench.demo.summary import _make_error_table, describe_late_setpoints
from bench.report import Fit
from tests.support.reports import prediction
from tests.support.result_documents import fit_document


def event(kind, quantity, value):
    return {"kind": kind, "text": "any text", "quantity": quantity, "value": value}


LATE, LATER = event("late", "setpoint_lateness", 0.0123), event("alarm", "setpoint_lateness", 0.03713)
OTHER = [event("alarm", "force_age", 0.12), {"kind": "state", "text": "setpoint lateness is only mentioned"}]


def test_the_largest_lateness_of_setpoints_is_described():
    message = describe_late_setpoints([*OTHER, LATE, LATER, event("alarm", "setpoint_lateness", 0.021)])
    assert "up to 37 ms late" in message
    assert "excluded from fit and prediction" in message


def test_a_recording_without_alarms_on_late_setpoints_has_no_description():
    assert describe_late_setpoints([*OTHER, LATE]) == ""
    assert describe_late_setpoints([]) == ""


def test_errors_are_listed_for_fit_and_validation_as_a_multiple_of_their_floor():
    fit = Fit.model_validate(fit_document())
    table = _make_error_table(fit, prediction(rmse=4.0, floor=2.0, before_n=8.0))
    rows = list(zip(*(column.cells for column in table.columns), strict=True))
    fitted = ("fitted, law alone", "1.98 N", "1.90 N", "1.04 times")
    twin = ("validation, twin", "4.00 N", "2.00 N", "2.00 times")
    assert rows == [fitted, ("validation, law alone", "8.00 N", "2.00 N", "4.00 times"), twin]
    assert _make_error_table(fit, None).row_count == 1


def test_a_twin_without_effects_has_one_row():
    table = _make_error_table(Fit.model_validate(fit_document()), prediction())
    assert table.row_count == 2
