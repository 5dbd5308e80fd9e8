"""A few hundred damaged inputs on every run; ``make fuzz`` tries 20 000."""

import os
import random
import signal
from dataclasses import replace

import pytest

from racecar.maps.errors import UserError
from tests.fuzz.__main__ import prepare
from tests.fuzz.mutations import damage
from tests.fuzz.pages import SAID
from tests.fuzz.samples import read_action
from tests.fuzz.trial import run_trial

INPUTS, PAGES = 150, 4


@pytest.fixture(scope="module")
def inputs():
    return prepare(("check",))


def damaged(inputs):
    tried = [inputs.make(number) for number in range(INPUTS)]
    return [(each.what, each.sample) for each in tried]


def said(inputs):
    """To a page."""
    (watched,) = (sample for sample in inputs.healthy if sample.name == "page to watch")
    for number in range(PAGES):
        said, what = damage(SAID, watched.files[SAID], random.Random(number))
        yield what, replace(watched, files={**watched.files, SAID: said})


def links(inputs):
    """That lead to each other."""
    return [(str(sample.action), sample) for sample in inputs.healthy if sample.name == "links"]


@pytest.mark.parametrize("kind", [damaged, said, links])
def test_what_a_user_may_hand_over_ends_in_a_result_or_one_sentence(kind, inputs, tmp_path):
    faults = []
    for number, (what, sample) in enumerate(kind(inputs)):
        sample.write(tmp_path / str(number))
        outcome = run_trial(sample.action, tmp_path / str(number), sample.seconds)
        if outcome.fault:
            faults.append(f"{number}, {sample.name}, {what}: {outcome}")
    assert (tmp_path / "0").exists()
    assert not faults


def test_the_same_number_gives_the_same_input(inputs):
    first, again = inputs.make(7), inputs.make(7)
    assert (first.what, first.sample.files) == (again.what, again.sample.files)


def test_damage_damages():
    content, rng = bytes(range(256)) * 20, random.Random(0)
    changed = [damage("drive.bag", content, rng)[0] != content for _ in range(200)]
    assert sum(changed) > 180


def refuse():
    raise UserError("It is not so.")


def prints_two_lines():
    print("It is not so.\nNor so.")
    return 2


def warns():
    import warnings

    warnings.warn("Beware.", stacklevel=1)
    return 0


def fails():
    raise ValueError("never mind")


def hungers():
    return len(bytearray(2 << 30)) * 0


def spins():
    while True:
        pass


@pytest.mark.parametrize(
    ("action", "fault"),
    [
        (lambda: 0, ""),
        (lambda: read_action(refuse), ""),
        (prints_two_lines, "did not print one sentence"),
        (warns, "printed although it was to be quiet"),
        (fails, "exit code 1"),
        (hungers, "exit code 1"),
        (spins, "died of SIGXCPU"),
        (lambda: os.kill(os.getpid(), signal.SIGKILL), "died of SIGKILL"),
    ],
)
def test_a_broken_rule_is_noticed(tmp_path, action, fault):
    outcome = run_trial(action, tmp_path, 1.0)
    assert outcome.fault.startswith(fault)
    assert bool(outcome.fault) == bool(fault)
