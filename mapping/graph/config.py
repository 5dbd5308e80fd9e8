"""Settings of the pose graph."""

from typing import Annotated

from pydantic import Field

from racecar.maps.settings import Settings


class PoseGraphConfig(Settings):
    """How the graph is solved, and when a loop closure counts as strained or refuted."""

    wheel_loss_width: float = Field(
        default=1.345,
        gt=0.0,
        le=100.0,
        description="Width of the Huber loss of wheels where scans were matched too, in their standard "
        "deviations: there the estimate of Gaussian errors is 95 % as good as the best (Huber, 1981).",
    )
    loss_widths: tuple[Annotated[float, Field(gt=0.0, le=1e6)], ...] = Field(
        default=(30.0, 5.0, 1.0),
        min_length=1,
        description="Widths of the Cauchy loss of loop closures and scan matches, in their standard "
        "deviations, one solution after the other. It is annealed because true ones far from the first "
        "estimate are let go when it is narrow at once, however well they agree; the three steps are by "
        "judgement. In the end, one that misses by one standard deviation counts half.",
    )
    widest_match_loss: float = Field(
        default=5.0,
        gt=0.0,
        le=100.0,
        description="Standard deviations that the loss of scan matches is wide at most: they begin nearer to "
        "the estimate than loop closures do. Measured on a drive whose first wheel steps turned too far: "
        "with 1 a wall is drawn twice, with 5 as with 30 once.",
    )
    tolerance: float = Field(
        default=1e-4,
        gt=0.0,
        lt=1.0,
        description="Relative decrease of the error at which Levenberg-Marquardt stops. By judgement.",
    )
    rough_tolerance: float = Field(
        default=1e-3,
        gt=0.0,
        lt=1.0,
        description="The same while the drive goes on, which needs poses to a few centimetres. By judgement.",
    )
    most_solved_singly: int = Field(
        default=4000,
        ge=1,
        le=1000000,
        description="The latest keyframes that are solved one by one while the drive goes on; those before "
        "move by groups. Measured on simulated kilometres (pytest -m slow, test_kilometres): with 1000 a "
        "loop came out 0.28 m off, with 4000 it stays below the bar of 0.25 m; solving all takes seconds.",
    )
    strained_distance: float = Field(
        default=0.15,
        gt=0.0,
        le=100.0,
        description="Metres by which a new loop closure contradicts the poses so that the graph is solved "
        "anew. By judgement: three cells of the map.",
    )
    strained_angle: float = Field(
        default=0.03, gt=0.0, le=10.0, description="The same in radians. By judgement."
    )
    refuted_distance: float = Field(
        default=0.3,
        gt=0.0,
        le=100.0,
        description="Metres by which the final solution contradicts a loop closure that is then dropped. By "
        "judgement: twice what is worth a new solution.",
    )
    refuted_angle: float = Field(
        default=0.06, gt=0.0, le=10.0, description="The same in radians. By judgement."
    )
