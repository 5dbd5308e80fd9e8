"""Scans that are too rare for the speed are told, others are not."""

import numpy as np
import pytest

from racecar.maps.geometry.se2 import IDENTITY
from racecar.pipelines.bags.facts import OdometryFacts, ScanFacts, findings_of_rare_scans
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

SECOND = 10**9
ALL = tuple(range(10))


def facts(
    every: float, speed: float, standing: int = 0, *, sweep: float = 0.0, kept: tuple[int, ...] = ALL
) -> tuple[ScanFacts, OdometryFacts]:
    """Of a car that drives for a minute, after so many seconds in which it stands; ``kept`` are those of the
    scans whose number ends so, by default all."""
    scans, odometry = ScanFacts(), OdometryFacts()
    bearings, offsets = np.linspace(-1.0, 1.0, 50), np.linspace(0.0, sweep, 50)
    for k in range(round((60 + standing) / every)):
        stamp = round(k * every * SECOND)
        if k % 10 in kept:
            scans.add(Scan(stamp, bearings, np.full(50, 2.0), offsets, IDENTITY, 10.0))
    for k in range(10 * (60 + standing)):
        driven = speed * max(0.1 * k - standing, 0.0)
        odometry.add(Odometry(k * SECOND // 10, np.array([driven, 0.0, 0.0]), IDENTITY))
    return scans, odometry


@pytest.mark.parametrize(("every", "speed"), [(2.0, 0.5), (0.25, 4.0)])
@pytest.mark.parametrize("standing", [0, 120])
def test_scans_that_are_rare_for_the_speed_are_told(every: float, speed: float, standing: int) -> None:
    (finding,) = findings_of_rare_scans(*facts(every, speed, standing))
    assert finding.numbers["seconds"] == pytest.approx(every)
    assert finding.numbers["metres"] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(("every", "speed"), [(2.0, 0.1), (0.025, 7.0), (0.2, 1.0)])
def test_others_are_not(every: float, speed: float) -> None:
    assert not findings_of_rare_scans(*facts(every, speed))


def test_blank_scans_are_counted_among_those_of_all_lasers() -> None:
    facts = ScanFacts()
    bearings = np.linspace(-1.0, 1.0, 50)
    for k in range(60):
        ranges = np.full(50, np.inf if 10 <= k < 50 else 2.0)
        facts.add(Scan(k * SECOND // 10, bearings, ranges, np.zeros(50), IDENTITY, 10.0, laser=k % 2))
    (finding,) = facts.findings
    assert (finding.name, finding.numbers["count"], finding.numbers["scans"]) == ("scans_blank", 40, 60)


@pytest.mark.parametrize(("every", "is_told"), [(0.2, False), (0.9, True)])
def test_rare_scans_that_no_odometry_follows_are_told(every: float, is_told: bool) -> None:
    told = findings_of_rare_scans(facts(every, 0.3)[0], OdometryFacts())
    assert len(told) == is_told
    assert all(finding.numbers["metres"] is None for finding in told)


def test_nothing_is_told_without_scans() -> None:
    assert not findings_of_rare_scans(ScanFacts(), facts(2.0, 1.0)[1])


@pytest.mark.parametrize(
    ("every", "sweep", "kept", "remedy"),
    [
        (0.14, 0.14, ALL, "Drive below 3.6 m/s; the laser takes no more scans than these."),
        (1.0, 0.02, ALL, "Drive below 0.5 m/s, or record all scans if the laser takes more than these."),
        (1.0, 0.0, ALL, "Drive below 0.5 m/s, or record all scans if the laser takes more than these."),
        (0.1, 0.1, (0, 3, 6, 9), "Some come 0.1 s apart, so others got lost: find out why"),
    ],
)
def test_the_remedy_is_of_what_made_them_rare(
    every: float, sweep: float, kept: tuple[int, ...], remedy: str
) -> None:
    (finding,) = findings_of_rare_scans(*facts(every, 5.0, sweep=sweep, kept=kept))
    assert finding.remedy.startswith(remedy)


@pytest.mark.parametrize(
    ("rate", "jitter", "is_too_seldom"),
    [(50.0, 0.9, False), (25.0, 0.0, False), (5.0, 0.0, True), (5.0, 0.5, True)],
)
def test_only_odometry_that_comes_seldom_is_told_of(rate: float, jitter: float, is_too_seldom: bool) -> None:
    """At 8 m/s, or 2 m/s where it is seldom; stamps are late by up to a share of the step."""
    generator, speed, facts = np.random.default_rng(1), 8.0 if rate > 20.0 else 2.0, OdometryFacts()
    for k in range(400):
        stamp = round((k + generator.uniform(0.0, jitter)) / rate * 1e9)
        facts.add(Odometry(stamp, np.array([k * speed / rate, 0.0, 0.0]), IDENTITY))
    assert facts.top_speed < 2.0 * speed
    assert facts.path_length == pytest.approx(399 * speed / rate)
    assert bool(facts.findings) == is_too_seldom
