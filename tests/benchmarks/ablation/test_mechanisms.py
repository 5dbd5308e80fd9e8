"""What turns the localizer's mechanisms off."""

import re
from pathlib import Path

import numpy as np
import pytest

from benchmarks.ablation.mechanisms import MECHANISMS, variants
from benchmarks.harness.variant import Variant
from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.particle_filter import ParticleFilter


@pytest.mark.parametrize("name", variants())
def test_every_variant_is_another_localizer_and_leaves_no_trace(name: str) -> None:
    variant, default = variants()[name], LocalizationConfig()
    before = [getattr(owner, what) for owner, what, _ in variant.replacements]
    assert variant.replacements or variant.configured(default) != default
    with variant.in_place():
        last = {(owner, what): by for owner, what, by in variant.replacements}
        for (owner, what), by in last.items():
            assert getattr(owner, what) is by
    assert before == [getattr(owner, what) for owner, what, _ in variant.replacements]


def test_single_settings_are_changed_and_their_neighbours_kept() -> None:
    settings = LocalizationConfig(particles=2000)
    changed = Variant({"slip": 1.0}).configured(settings)
    assert changed.slip == 1.0
    assert changed.model_copy(update={"slip": settings.slip}) == settings


def test_a_group_is_off_with_all_that_is_in_it() -> None:
    every, default = variants(), LocalizationConfig()
    for group, mechanisms in MECHANISMS.items():
        together = every[f"all {group}"]
        for off in mechanisms.values():
            assert (together | off).configured(default) == together.configured(default)
            assert set(off.replacements) <= set(together.replacements)


def test_nothing_is_injected_without_injection() -> None:
    cloud = ParticleFilter(np.zeros((100, 3)), np.random.default_rng(0))
    with variants()["particle injection"].in_place():
        cloud.inject(np.ones(3))
    assert not cloud.map_from_base.any()
    cloud.inject(np.ones(3))
    assert cloud.map_from_base.any()


def test_each_name_is_explained_under_its_group() -> None:
    page = (Path(__file__).parents[3] / "docs" / "measured" / "localizer.md").read_text(encoding="utf-8")
    explained = page.partition("### The names of the mechanisms")[2].partition("\n## ")[0]
    tables = {
        group: re.findall(r"^\| ([^|]+) \|", rows, re.MULTILINE)
        for group, rows in re.findall(
            r"^\| (\w+) \| what it does \|\n\|---\|---\|\n((?:\|.*\n)*)", explained, re.MULTILINE
        )
    }
    assert tables == {group: list(names) for group, names in MECHANISMS.items()}
