"""The expected error as a sum of powers."""

import pytest

from racecar.mapping.quality.error_model import ErrorModel, Power, Term

MODEL = ErrorModel(
    local=0.01,
    whole=0.1,
    terms=(
        Term("spread", 0.001, 1.0, 0.01, Power(0.02, 1.0), Power(0.2, 1.0), "spread {:.2f} m"),
        Term("through", 0.01, 0.5, 0.05, Power(0.01, 2.0), Power(0.0, 1.0), "through {:.0%}"),
    ),
)


def test_the_floor_and_the_powers_add_up() -> None:
    local, whole = MODEL.errors({"spread": 0.02, "through": 0.1})
    assert local == pytest.approx(0.01 + 0.04 + 0.04)
    assert whole == pytest.approx(0.1 + 0.4)


def test_what_was_not_measured_counts_as_usual() -> None:
    assert MODEL.errors({"spread": float("nan"), "through": float("nan")})[0] == pytest.approx(0.04)


def test_nothing_counts_beyond_what_was_learned() -> None:
    assert MODEL.errors({"spread": 50.0, "through": 0.05}) == MODEL.errors({"spread": 1.0, "through": 0.05})


def test_what_makes_up_the_error_is_complained_of_the_weightiest_first() -> None:
    assert MODEL.complaints({"spread": 0.1, "through": 0.4}, 0.2) == ["spread 0.10 m", "through 40%"]
    assert MODEL.complaints({"spread": 0.001, "through": 0.4}, 0.2) == ["through 40%"]


def test_what_makes_up_the_error_of_the_whole_alone_is_complained_of_too() -> None:
    assert MODEL.complaints({"spread": 0.02, "through": 0.1}, 0.6) == ["spread 0.02 m"]
