"""Settings of loop closure: submaps, where they are sought, how they are matched, what verifies a loop."""

import math

from pydantic import Field

from racecar.maps.settings import Settings


class SubmapConfig(Settings):
    """How long submaps are, and how many of their points are used."""

    spacing: float = Field(
        default=2.0,
        gt=0.0,
        le=1000.0,
        description="Metres of path from one submap to the next. By judgement: every place lies near the "
        "middle of one.",
    )
    half_length: float = Field(
        default=3.0,
        gt=0.0,
        le=1000.0,
        description="Metres of path to each side of a submap's middle, over which drift is negligible. By "
        "judgement.",
    )
    point_spacing: float = Field(
        default=0.1,
        gt=0.0,
        le=10.0,
        description="Side of the cells of which each keeps one point, metres: the cell of the correlative "
        "search.",
    )
    sample_radius: float = Field(
        default=15.0,
        gt=0.0,
        le=10000.0,
        description="Metres about the middle from which the points are taken that are searched with. By "
        "judgement.",
    )
    min_sample: int = Field(
        default=50,
        ge=1,
        le=10000,
        description="Points below which a submap is not searched for. By judgement.",
    )


class CandidateSearchConfig(Settings):
    """Which earlier submaps may show the same place, and how far the drift may have carried it."""

    base_reach: float = Field(
        default=0.5,
        gt=0.0,
        le=100.0,
        description="Metres searched to each side even without drift. By judgement.",
    )
    base_turn: float = Field(
        default=math.radians(4.0),
        gt=0.0,
        le=10.0,
        description="Radians searched likewise. By judgement: 4 degrees.",
    )
    sigmas: float = Field(
        default=4.0,
        gt=0.0,
        le=100.0,
        description="Standard deviations of the steps in between searched besides. Maps of aces, fr079 and "
        "intel made without loops were off by up to 6.5 of turn and 5.4 of place, for the errors of matches "
        "in one place are alike; with what is searched without drift, 4 reach as far as any of them.",
    )
    min_drift: float = Field(
        default=0.3,
        ge=0.0,
        le=100.0,
        description="Metres of drift to reckon with below which two submaps are well connected already, "
        "because matching keyframes bridges as much. By judgement.",
    )
    max_reach: float = Field(
        default=20.0,
        gt=0.0,
        le=10000.0,
        description="Metres searched to each side at most, for the time it takes. By judgement.",
    )
    max_turn: float = Field(
        default=math.radians(40.0),
        gt=0.0,
        le=100.0,
        description="Radians likewise: 40 degrees, by judgement.",
    )
    slack: float = Field(
        default=2.0,
        ge=0.0,
        le=1000.0,
        description="Metres by which the middles of two submaps of one place may lie apart: the submaps' "
        "spacing.",
    )
    max_candidates: int = Field(
        default=4,
        ge=1,
        le=1000,
        description="Submaps on which a new one is searched for, for the time it takes. By judgement.",
    )
    candidate_spacing: float = Field(
        default=3.0,
        ge=0.0,
        le=1000.0,
        description="Metres between two candidates, because one of each place suffices. By judgement.",
    )


class SubmapSearchConfig(Settings):
    """The correlative search of one submap on another."""

    min_score: float = Field(
        default=0.2,
        gt=0.0,
        le=1.0,
        description="Least mean likelihood of the points at a place that is accepted. By judgement: two "
        "submaps of a laser that sees 4 m far share a third of what they show where their paths cross.",
    )
    ambiguous_share: float = Field(
        default=0.85,
        gt=0.0,
        le=1.0,
        description="Score of a second place, as a share of the best, from which the search is ambiguous. "
        "Chosen in a prototype on aces, intel and fr079.",
    )
    likely_share: float = Field(
        default=0.25,
        gt=0.0,
        le=1.0,
        description="Share of the window beyond its base reach that the drift usually fills. By judgement.",
    )
    near_share: float = Field(
        default=0.65,
        gt=0.0,
        le=1.0,
        description="Share of the score of a place farther off from which a near place makes it ambiguous. "
        "By judgement.",
    )
    radius: float = Field(
        default=25.0,
        gt=0.0,
        le=10000.0,
        description="Metres about its middle of which a submap is searched on: more than the sample's "
        "radius and the widest usual window. By judgement.",
    )
    points: int = Field(
        default=500, ge=1, le=100000, description="Points that are searched with, for speed. By judgement."
    )


class SubmapMatchingConfig(Settings):
    """The joint match of two submaps, from where the search found them."""

    max_pairs: int = Field(
        default=40,
        ge=1,
        le=10000,
        description="Pairs of scans that are matched jointly, for speed. By judgement.",
    )
    rough_kernel_width: float = Field(
        default=0.1,
        gt=0.0,
        le=10.0,
        description="Metres off a line at which a point weighs a quarter in the first match. It is the cell "
        "of the search, which ends up to one cell off.",
    )
    rough_every: int = Field(
        default=4,
        ge=1,
        le=1000,
        description="The first match uses one pair of scans in this many, as it only has to bridge one "
        "cell. By judgement.",
    )
    max_partner_distance: float = Field(
        default=0.2,
        gt=0.0,
        le=100.0,
        description="Metres within which partners are searched for in the second match. By judgement: "
        "twice the cell.",
    )
    independent_pairs: float = Field(
        default=20.0,
        gt=0.0,
        le=10000.0,
        description="Pairs of scans that a closure is worth, however many were matched, because they share "
        "their errors. By judgement.",
    )
    max_residual: float = Field(
        default=0.04,
        gt=0.0,
        le=10.0,
        description="Metres of weighted residual from which the scans do not fit. By judgement: as for "
        "keyframes.",
    )


class SeeThroughVerificationConfig(Settings):
    """What scans must show of each other for a loop closure to hold."""

    min_agreement: float = Field(
        default=0.9,
        ge=0.0,
        le=1.0,
        description="Of the points that the other scans judge, the least share that lies on their surfaces. "
        "Measured: 0.85 to 0.9 in rooms that look alike, above 0.93 in nine tenths of true loops.",
    )
    min_coverage: float = Field(
        default=0.3,
        ge=0.0,
        le=1.0,
        description="Of all points, the least share that does. By judgement: what cannot be judged speaks "
        "neither for a loop nor against it.",
    )


class ConsistentSupportConfig(Settings):
    """When two loop hypotheses support each other, and how much support one needs."""

    max_distance: float = Field(
        default=0.35,
        gt=0.0,
        le=100.0,
        description="Metres by which what one predicts of the other may be off. Chosen in a prototype on "
        "aces, intel and fr079.",
    )
    max_angle: float = Field(
        default=math.radians(2.5), gt=0.0, le=10.0, description="Radians likewise: 2.5 degrees."
    )
    min_spacing: float = Field(
        default=1.0,
        ge=0.0,
        le=100.0,
        description="Metres of path between two that support each other; nearer ones see the same. By "
        "judgement: half the spacing of submaps.",
    )
    max_spacing: float = Field(
        default=14.0,
        gt=0.0,
        le=10000.0,
        description="Metres of path over which the drift stays within the limits above. By judgement.",
    )
    reach_per_supporter: float = Field(
        default=4.0,
        gt=0.0,
        le=1000.0,
        description="Metres of search window for each of which one supporter is needed, at least one: the "
        "wider the window, the more look-alikes lie in it. By judgement.",
    )
    reach_per_metre_off: float = Field(
        default=3.0,
        gt=0.0,
        le=1000.0,
        description="Metres of window that a place counts as found in per metre that it lies off where the "
        "map has it, because fewer look-alikes lie nearer. By judgement.",
    )


class LoopClosureConfig(Settings):
    """Loop closure."""

    open_distance: float = Field(
        default=60.0,
        gt=0.0,
        le=10000.0,
        description="Metres of path for which a hypothesis waits for support, and within which others give "
        "it. By judgement.",
    )
    submaps: SubmapConfig = SubmapConfig()
    candidates: CandidateSearchConfig = CandidateSearchConfig()
    search: SubmapSearchConfig = SubmapSearchConfig()
    matching: SubmapMatchingConfig = SubmapMatchingConfig()
    see_through: SeeThroughVerificationConfig = SeeThroughVerificationConfig()
    consistent_support: ConsistentSupportConfig = ConsistentSupportConfig()
