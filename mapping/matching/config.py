"""The settings of scan matching: lines, point-to-line alignment, correlative search and the see-through test.

Where a description says "prototype", the value comes from a throw-away program that mapped the logs aces,
fr079 and intel with it before this mapper was written; it was chosen on these logs.
"""

import math

from pydantic import Field

from racecar.maps.settings import Settings


class LineFittingConfig(Settings):
    """Lines through neighbouring returns, from which normals come."""

    half_angle: float = Field(
        default=math.radians(3.0),
        gt=0.0,
        le=1.0,
        description="Radians of bearing to each side of a return whose returns its line goes through. The "
        "prototype took three beams to each side of one degree between beams, six of half a degree.",
    )
    half_width: float = Field(
        default=0.12,
        gt=0.0,
        le=2.0,
        description="Metres to each side that a line spans at least: near by, an angle is less than the "
        "noise. By judgement: eight times the usual noise.",
    )
    max_gap_angle: float = Field(
        default=math.radians(8.0),
        gt=0.0,
        le=1.0,
        description="Returns farther apart than this many radians seen from the sensor lie on two surfaces. "
        "By judgement: on a wall that is met at 7 degrees, beams one degree apart leave no wider gap.",
    )
    min_gap: float = Field(
        default=0.15,
        gt=0.0,
        le=2.0,
        description="Metres within which two returns lie on one surface, however near. By judgement: ten "
        "times the usual noise, less than a doorway.",
    )
    max_rms: float = Field(
        default=0.04,
        gt=0.0,
        le=0.5,
        description="Metres, root mean square distance of a line's returns from it, above which the surface "
        "is not straight. By judgement: noise of 3 cm, as of cheap lasers, still passes.",
    )
    max_aspect: float = Field(
        default=0.05,
        gt=0.0,
        lt=1.0,
        description="Variance across a line as a share of that along it, above which noise leaves it no "
        "direction and it is tried again through more returns. By judgement: the normal of six returns then "
        "errs by five degrees. Without further attempts, 3 cm of noise put aces 1.4 m wrong; with them it "
        "cost 4 % (tests/simulated/test_altered_logs.py).",
    )
    attempts: int = Field(
        default=4,
        ge=1,
        le=20,
        description="How often a line is tried, each time over a longer stretch of the surface. By "
        "judgement.",
    )
    widening: float = Field(
        default=1.5,
        gt=1.0,
        le=5.0,
        description="By what factor a line grows from one attempt to the next. By judgement: the fourth "
        "spans 3.4 times as much as the first.",
    )
    min_points: int = Field(
        default=4,
        ge=3,
        le=100,
        description="Returns of a line at least; two always lie on one, and of three the noise is hardly "
        "known.",
    )
    usual_noise: float = Field(
        default=0.015,
        gt=0.0,
        le=0.5,
        description="Metres, standard deviation of a range. Returns are moved onto their line as far as they "
        "scatter more (Wiener filter). By judgement: precise scans, of 2 mm, must stay as measured.",
    )


class PointToLineConfig(Settings):
    """Iteratively reweighted point-to-line alignment, and what its result is worth."""

    initial_distance: float = Field(
        default=0.5,
        gt=0.0,
        le=5.0,
        description="Metres within which partners of points are searched for at first, where the caller "
        "does not say. Prototype.",
    )
    final_distance: float = Field(
        default=0.15,
        gt=0.0,
        le=5.0,
        description="Metres within which partners are searched for in the end. Prototype.",
    )
    shrinkage: float = Field(
        default=0.7,
        gt=0.0,
        lt=1.0,
        description="By what factor that distance shrinks with each iteration. By judgement: from the "
        "initial to the final distance in four.",
    )
    kernel_width: float = Field(
        default=0.04,
        gt=0.0,
        le=1.0,
        description="Metres off its line at which a point weighs a quarter (Geman and McClure, 1987), where "
        "the caller does not say. Prototype.",
    )
    min_normal_agreement: float = Field(
        default=0.7,
        ge=-1.0,
        lt=1.0,
        description="Cosine of the angle between the normals of partners, at least: the two sides of a thin "
        "wall, or the two walls of a corner, are no partners. By judgement: 45 degrees.",
    )
    normal_variance: float = Field(
        default=0.01,
        ge=0.0,
        le=1.0,
        description="Square radians by which a normal's direction errs: what noisy normals pretend to know "
        "along a bare corridor, per unit of weight. By judgement: normals err by six degrees.",
    )
    max_iterations: int = Field(
        default=12,
        ge=1,
        le=200,
        description="Steps of Gauss-Newton at most. By judgement: most matches end sooner, by their small "
        "steps.",
    )
    min_terms: float = Field(
        default=6.0,
        ge=3.0,
        le=1000.0,
        description="Points with a partner, summed over the scans of a match, below which the pose is left "
        "as it is. By judgement: twice the three unknowns.",
    )
    usual_residual: float = Field(
        default=0.01,
        gt=0.0,
        le=1.0,
        description="Metres; a match is never taken to be better than with this residual, however clean its "
        "scans. By judgement: lasers err by 1 cm.",
    )
    independence: float = Field(
        default=0.1,
        gt=0.0,
        le=1.0,
        description="What a term counts for in a match's information: neighbouring beams, and the same scan "
        "in many pairs, err together. Prototype.",
    )


class CorrelativeSearchConfig(Settings):
    """Branch and bound over a window of poses (Olson, 2009)."""

    cell: float = Field(
        default=0.1,
        gt=0.0,
        le=1.0,
        description="Metres between the places that are tried. Prototype: point-to-line alignment corrects "
        "the rest.",
    )
    angle_step: float = Field(
        default=math.radians(0.75),
        gt=0.0,
        le=0.5,
        description="Radians between the headings that are tried. Prototype: at 8 m it moves a point by one "
        "cell.",
    )
    blur: float = Field(
        default=0.12,
        gt=0.0,
        le=2.0,
        description="Metres, standard deviation of how far a point may lie from those of the other scan. By "
        "judgement: a little over a cell, so that no wall falls between two places.",
    )
    runner_up_distance: float = Field(
        default=1.0,
        gt=0.0,
        le=20.0,
        description="Metres from the best place, or the angle below, beyond which another is a place of its "
        "own, that makes the best ambiguous. Prototype.",
    )
    runner_up_angle: float = Field(
        default=math.radians(10.0),
        gt=0.0,
        le=3.2,
        description="Radians from the best heading, the same. By judgement.",
    )


class SeeThroughConfig(Settings):
    """Does one scan look through what another one saw?"""

    min_range: float = Field(
        default=0.3,
        ge=0.0,
        le=10.0,
        description="Metres from the viewer, below which a point is not judged: so near, the car itself and "
        "bearings that jump mislead. By judgement.",
    )
    max_range: float = Field(
        default=20.0,
        gt=0.0,
        le=200.0,
        description="Metres from the viewer, above which a point is not judged: its beams lie far apart "
        "there. By judgement.",
    )
    tolerance: float = Field(
        default=0.12,
        gt=0.0,
        le=2.0,
        description="Metres before or behind a surface that still count as on it. By judgement: drift "
        "within a submap and noise together.",
    )
    tolerance_per_metre: float = Field(
        default=0.02,
        ge=0.0,
        le=0.5,
        description="By how many metres that grows per metre from the viewer. By judgement: one degree of "
        "heading on a surface that is met at 45 degrees.",
    )
    max_gap: float = Field(
        default=math.radians(2.5),
        gt=0.0,
        le=1.0,
        description="Radians between two returns of the viewer, up to which what lies between them is "
        "known. By judgement: one missing beam of a laser of one degree.",
    )
    spacings: float = Field(
        default=1.5,
        gt=0.0,
        le=10.0,
        description="The same in usual spacings of the viewer's returns, for lasers of few beams, between "
        "which nothing would be known otherwise. By judgement: no beam is missing.",
    )


class ScanMatchingConfig(Settings):
    """How the scans of a map are prepared and compared."""

    lines: LineFittingConfig = LineFittingConfig()
    point_to_line: PointToLineConfig = PointToLineConfig()
    correlative_search: CorrelativeSearchConfig = CorrelativeSearchConfig()
    see_through: SeeThroughConfig = SeeThroughConfig()
