"""The drives that the localizer is tried on: simulated, with people in the way and moved furniture."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, between, compose, wrap_angle
from racecar.maps.grid.distance_field import distance_to_occupied
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OCCUPIED_FROM, OccupancyGrid
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.scan import Scan
from racecar.pipelines.runs.localization_run import estimates
from racecar.pipelines.simulation.simulator import Simulation
from racecar.pipelines.simulation.simulator_config import SimulationConfig

Message = Scan | Odometry

_PERSON_WIDTH = 0.5
_NEAREST_PERSON, _FARTHEST_PERSON = 0.7, 4.0
"""Metres from the laser."""
_LARGEST_PIECE = 3.0
"""Metres; what is longer is a wall."""
_TRIES = 50
_STRIDE = 0.03
"""Radians by which a person's bearing wanders from scan to scan (standard deviation)."""


@dataclass(frozen=True, eq=False)
class Drive:
    """Messages in the order of time, and the truth."""

    messages: list[Message]
    stamps: NDArray[np.int64]
    """(S,) of the scans."""
    map_from_base: Pose
    """(S, 3) at these."""

    def between(self, first: int, last: int) -> "Drive":
        """The part from one scan to before another."""
        start = int(self.stamps[first])
        end = int(self.stamps[last]) if last < len(self.stamps) else 2**62
        return Drive(
            [message for message in self.messages if start <= message.stamp < end],
            self.stamps[first:last],
            self.map_from_base[first:last],
        )


@dataclass(frozen=True, eq=False)
class Run:
    """What the localizer said of a drive."""

    estimates: list[PoseEstimate]
    errors: Pose
    """(S, 3) of each estimate in the map: x, y (m) and yaw (rad)."""

    @property
    def metres(self) -> NDArray[np.float64]:
        """(S,) how far each estimate was off."""
        distances: NDArray[np.float64] = np.hypot(self.errors[:, 0], self.errors[:, 1])
        return distances

    @property
    def degrees(self) -> NDArray[np.float64]:
        """(S,) how far each was turned, without sign."""
        return np.degrees(np.abs(self.errors[:, 2]))

    @property
    def is_inside(self) -> NDArray[np.bool_]:
        """(S,) whether the error lies inside the reported ellipsoid of 95 %, of x, y and yaw together."""
        covariances = np.array([estimate.covariance for estimate in self.estimates])
        squared = np.einsum("si,sij,sj->s", self.errors, np.linalg.inv(covariances), self.errors)
        return np.asarray(squared <= _CHI_SQUARE_95_OF_3, dtype=np.bool_)


_CHI_SQUARE_95_OF_3 = 7.814728


def simulate(grid: OccupancyGrid, settings: SimulationConfig, crowd_share: float = 0.0) -> Drive:
    """Drive through a world; of the beams, ``crowd_share`` hit people."""
    simulation = Simulation(grid, settings)
    messages: Iterator[Message] = simulation.messages()
    if crowd_share > 0.0:
        messages = _among_people(messages, crowd_share, np.random.default_rng([settings.seed, 7]))
    truth = simulation.ground_truth
    return Drive(list(messages), truth.stamps, truth.map_from_base)


def random_start(grid: OccupancyGrid, rng: np.random.Generator) -> tuple[float, float, float]:
    """A pose with half a metre of free floor about it."""
    is_roomy = (grid.cells == FREE) & (distance_to_occupied(grid) > 0.5)
    x, y = grid.center_of(rng.choice(np.argwhere(is_roomy), size=1))[0]
    return float(x), float(y), float(rng.uniform(-np.pi, np.pi))


def run(localizer: Localizer, drive: Drive) -> Run:
    """Feed a drive to a localizer that was told where to start, or not."""
    told = [estimate for _, estimate in estimates(drive.messages, localizer)]
    errors = np.array([estimate.map_from_base for estimate in told]) - drive.map_from_base
    errors[:, 2] = wrap_angle(errors[:, 2])
    return Run(told, errors)


def move_furniture(grid: OccupancyGrid, rng: np.random.Generator) -> OccupancyGrid:
    """The grid with half of its furniture pushed 0.3 to 1.5 m to where there is room.

    Furniture is what stands free of the walls and is no longer than 3 m.
    """
    is_occupied = grid.cells >= OCCUPIED_FROM
    pieces, _ = ndimage.label(is_occupied, structure=np.ones((3, 3)))
    cells = grid.cells.copy()
    for number, box in enumerate(ndimage.find_objects(pieces), start=1):
        if max(side.stop - side.start for side in box) * grid.resolution > _LARGEST_PIECE:
            continue
        if rng.random() < 0.5:
            continue
        piece = ndimage.binary_fill_holes(pieces[box] == number)
        for _ in range(_TRIES):
            angle, way = rng.uniform(-np.pi, np.pi), rng.uniform(0.3, 1.5) / grid.resolution
            shifts = np.rint(way * np.array([np.sin(angle), np.cos(angle)])).astype(int)
            rows, columns = (
                slice(side.start + shift, side.stop + shift) for side, shift in zip(box, shifts, strict=True)
            )
            there = cells[rows, columns]
            if rows.start < 0 or columns.start < 0 or there.shape != piece.shape:
                continue
            if np.all((there[piece] == FREE) | (pieces[rows, columns][piece] == number)):
                cells[box][piece] = FREE
                cells[rows, columns][piece] = OCCUPIED
                break
    return replace(grid, cells=cells)


def carried_away(drives: Sequence[Drive]) -> tuple[Drive, NDArray[np.int64]]:
    """Drives one after the other as if they were one, and at which scans the car is elsewhere all at once.

    Time goes on without a gap and so does the odometry: nothing but the scans tells.
    """
    messages: list[Message] = []
    stamps: list[NDArray[np.int64]] = []
    end, odom_from_base = 0, np.zeros(3)
    for drive in drives:
        shift = end - drive.messages[0].stamp
        first = next(message for message in drive.messages if isinstance(message, Odometry))
        for message in drive.messages:
            if isinstance(message, Odometry):
                pose = compose(odom_from_base, between(first.odom_from_base, message.odom_from_base))
                messages.append(replace(message, stamp=message.stamp + shift, odom_from_base=pose))
            else:
                messages.append(replace(message, stamp=message.stamp + shift))
        stamps.append(drive.stamps + shift)
        last = [message for message in messages if isinstance(message, Odometry)][-1]
        odom_from_base = last.odom_from_base
        end = max(messages[-1].stamp, last.stamp) + 5_000_000
    lengths = np.cumsum([len(drive.stamps) for drive in drives])
    whole = Drive(messages, np.concatenate(stamps), np.concatenate([drive.map_from_base for drive in drives]))
    return whole, lengths[:-1]


def _among_people(messages: Iterator[Message], share: float, rng: np.random.Generator) -> Iterator[Message]:
    people = np.empty((0, 2))
    for message in messages:
        if not isinstance(message, Scan):
            yield message
            continue
        people[:, 0] = wrap_angle(people[:, 0] + _STRIDE * rng.standard_normal(len(people)))
        while True:
            ranges, hit = _in_front(message, people)
            if hit >= share:
                break
            newcomer = rng.uniform([-np.pi, _NEAREST_PERSON], [np.pi, _FARTHEST_PERSON])
            people = np.vstack([people, newcomer])
        people = people[-200:] if hit < 1.1 * share else people[1:]
        yield replace(message, ranges=ranges)


def _in_front(scan: Scan, people: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Ranges (N,) with people (P, 2), bearing and distance, in the way, and the share of beams they stop."""
    ranges = scan.ranges.copy()
    for bearing, distance in people:
        half = np.arctan(0.5 * _PERSON_WIDTH / distance)
        is_stopped = (np.abs(wrap_angle(scan.bearings - bearing)) < half) & (ranges > distance)
        ranges[is_stopped] = distance
    return ranges, float(np.mean(ranges != scan.ranges))
