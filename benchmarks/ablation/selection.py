"""Which drives and which mechanisms a part of the ablation is about."""

from collections.abc import Collection, Mapping
from typing import TypeVar

from racecar.maps.errors import UserError

D = TypeVar("D")
V = TypeVar("V")


def selected(
    drives: Mapping[str, D], variants: Mapping[str, V], only: Collection[str]
) -> tuple[Mapping[str, D], Mapping[str, V]]:
    """Those that are named; all drives where none of them is, and all variants likewise.

    Raises UserError when there is none of a name.
    """
    for name in only:
        if name not in drives and name not in variants:
            raise UserError(
                f"There is no mechanism or drive '{name}'; there are: {', '.join([*variants, *drives])}."
            )
    return _named(drives, only), _named(variants, only)


def _named(values: Mapping[str, D], only: Collection[str]) -> Mapping[str, D]:
    named = {name: value for name, value in values.items() if name in only}
    return named or values
