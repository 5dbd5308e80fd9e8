"""What a node sees, in a browser of this machine, for those without RViz."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.view.rerun_log import as_grid_map
from racecar.pipelines.view.rerun_style import CAR, CAR_LENGTH, PARTICLE, PATH, SCAN, raised
from racecar.pipelines.view.viewer_server import serve_viewer

_HEIGHTS = {"path": 0.05, "scan": 0.15, "particles": 0.2, "car": 0.25}
"""Metres above the map, so that everything is seen from above."""


class LiveView:
    """Shows the latest of everything; what was before is forgotten, so that memory does not grow."""

    def __init__(self, stream: rr.RecordingStream, page: str) -> None:
        self._stream = stream
        self.page = page
        """Where a browser finds it."""

    def show_map(self, grid: OccupancyGrid) -> None:
        """The map from now on."""
        self._stream.log("map/grid", as_grid_map(grid), static=True)

    def show(
        self,
        map_from_base: Pose,
        scan_in_map: NDArray[np.float64],
        path: Pose,
        particles: Pose | None = None,
    ) -> None:
        """The car (3,), its scan (N, 2), the path driven (M, 3), and particles (P, 3)."""
        log = self._stream.log
        x, y, yaw = map_from_base
        ahead = CAR_LENGTH * np.array([np.cos(yaw), np.sin(yaw), 0.0])
        arrow = rr.Arrows3D(vectors=[ahead], origins=[[x, y, _HEIGHTS["car"]]], colors=CAR, radii=0.03)
        log("map/car", arrow, static=True)
        log(
            "map/scan",
            rr.Points3D(raised(scan_in_map, _HEIGHTS["scan"]), colors=SCAN, radii=-2.0),
            static=True,
        )
        if len(path) > 1:
            line = rr.LineStrips3D([raised(path[:, :2], _HEIGHTS["path"])], colors=PATH, radii=-1.5)
            log("map/path", line, static=True)
        if particles is not None:
            places = raised(particles[:, :2], _HEIGHTS["particles"])
            log("map/particles", rr.Points3D(places, colors=PARTICLE, radii=-2.0), static=True)


@contextmanager
def live_view(title: str, port: int | None) -> Iterator[LiveView]:
    """Serve a page to this machine, on the loopback address only, while the block lasts.

    Raises RuntimeError when the server does not start.
    """
    stream = rr.RecordingStream("racecar_live", recording_id=title)
    view = rrb.Spatial3DView(origin="map", name=title, background=[255, 255, 255], line_grid=False)
    blueprint = rrb.Blueprint(view, collapse_panels=True, auto_views=False)
    with tempfile.TemporaryDirectory() as folder:
        opening = Path(folder) / "opening.rrd"
        with rr.RecordingStream("racecar_live", recording_id=title) as first:
            first.save(opening, default_blueprint=blueprint)
            first.log("map", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
            first.flush()
        with serve_viewer(opening, port) as (page, _):
            data = parse_qs(urlsplit(page).query)["url"][0]
            stream.connect_grpc(data, default_blueprint=blueprint)
            try:
                yield LiveView(stream, page)
            finally:
                stream.disconnect()
