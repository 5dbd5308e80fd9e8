"""Settings of the search for returns that move along with the laser."""

from pydantic import Field

from racecar.mapping.self_calibration.config import ScanTrackConfig
from racecar.maps.settings import Settings


class MovingAlongConfig(Settings):
    """Which returns are taken to move along with the laser, and from when on they are left out."""

    block: float = Field(
        default=10.0,
        gt=0.0,
        le=1000.0,
        description="Seconds that are judged together. By judgement: as long as someone carries a robot.",
    )
    reach: float = Field(
        default=5.0,
        gt=0.0,
        le=1000.0,
        description="Seconds within which a scan is compared with another one. By judgement: in these a slow "
        "robot drives the distance below, and wheels drift less than the tolerance.",
    )
    distance: float = Field(
        default=0.5,
        gt=0.0,
        le=100.0,
        description="Metres between two scans that show what moves along. By judgement: several times the "
        "tolerance.",
    )
    angle: float = Field(
        default=0.35,
        gt=0.0,
        le=3.0,
        description="Radians between two scans that may do instead. Measured: 20° on the spot show who "
        "carries a robot, and nobody in other recordings.",
    )
    max_angle: float = Field(
        default=1.0,
        gt=0.0,
        le=3.0,
        description="Radians up to which two scans are compared at that distance: what is round and near "
        "shows by the distance only. By judgement: narrow fields of view still overlap.",
    )
    fixed: float = Field(
        default=0.1,
        gt=0.0,
        le=10.0,
        description="Metres by which ranges at one bearing may differ if they are of one thing that moves "
        "along. By judgement: the floor's unevenness, seen at a grazing angle.",
    )
    tolerance: float = Field(
        default=0.15,
        gt=0.0,
        le=10.0,
        description="Metres within which two returns are of one thing in the world. By judgement: what "
        "wheels err over the distance above, and the skew of a sweep.",
    )
    through: float = Field(
        default=0.25,
        gt=0.0,
        le=10.0,
        description="Metres beyond a return from which another scan looked through its place. By judgement: "
        "more than the tolerance.",
    )
    dropouts: int = Field(
        default=2,
        ge=0,
        le=100,
        description="Beams to each side that stand in for one that came back empty. By judgement: of some "
        "lasers half do.",
    )
    min_world: float = Field(
        default=0.1,
        ge=0.0,
        le=1.0,
        description="Share of a scan's returns, of those that move along or of the others, whichever are "
        "more, that must have moved as the motion says, for it to be believed: when wheels spin, all returns "
        "seem to move along. Measured: usually 0.2 to 0.6.",
    )
    min_scans: int = Field(
        default=4,
        ge=1,
        le=1000,
        description="Scans, each the distance or the angle apart from the last, that a block must have to be "
        "judged. By judgement.",
    )
    min_share: float = Field(
        default=0.08,
        gt=0.0,
        le=1.0,
        description="Share of a block's returns, that move along by what came before and by what came "
        "after, from which they are left out. Measured: aces, fr079 and intel stay below 0.015; posts and "
        "cables of a robot, which do no harm, below 0.08; floors and carriers have up to 0.4.",
    )
    min_share_again: float = Field(
        default=0.01,
        gt=0.0,
        le=1.0,
        description="The same once there was such a block: a tilted laser stays tilted, though the floor "
        "comes into view and goes. By judgement: about the most of clean logs. Measured: without it four in "
        "five of the floor's returns stay (racecar benchmark worlds --world 'tilted short').",
    )
    cell_angle: float = Field(
        default=0.05,
        gt=0.0,
        le=1.0,
        description="Radians of the cells in which the votes on returns are put together. By judgement: a "
        "few beams of a coarse laser.",
    )
    cell_range: float = Field(
        default=0.2, gt=0.0, le=10.0, description="The same in metres. By judgement: twice what is fixed."
    )
    min_cell_share: float = Field(
        default=0.2,
        gt=0.0,
        le=1.0,
        description="Share of a cell's returns that must move along, for those that are open to be left out "
        "too. By judgement.",
    )
    stands: tuple[float, float] = Field(
        default=(0.05, 0.1),
        description="Metres and radians in a second below which the wheels stand. By judgement.",
    )
    min_changed: float = Field(
        default=0.3,
        gt=0.0,
        le=1.0,
        description="Share of the ranges that changed in that second from which the laser moved "
        "nonetheless, so that the scans show its motion. By judgement: more than people who walk by, less "
        "than what a carrier leaves of the view.",
    )
    min_standing: int = Field(
        default=2,
        ge=1,
        le=100,
        description="Such seconds in a block from which the scans are followed, which takes longer. By "
        "judgement: in one a slow turn may begin.",
    )
    track: ScanTrackConfig = ScanTrackConfig()
