"""Settings of the verdict on a map."""

from pydantic import Field

from racecar.maps.settings import Settings


class QualityConfig(Settings):
    """Limits of a good map."""

    good_local: float = Field(
        default=0.1,
        gt=0.0,
        le=100.0,
        description="Metres per 10 m of path that a good map is expected to err at most. By judgement: two "
        "cells of the map.",
    )
    good_whole: float = Field(
        default=0.5,
        gt=0.0,
        le=1000.0,
        description="Metres over the whole, the same. By judgement: a car still finds its way through doors.",
    )
