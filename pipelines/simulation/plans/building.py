"""The shipped building: a floor of about 50 × 30 m, offices and labs around two loops of corridor."""

from math import radians

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.simulation.plans.canvas import FloorCanvas


def draw_building() -> OccupancyGrid:
    """The floor, drawn from its lower left corner; the map's origin is in the south corridor."""
    plan = FloorCanvas((-0.5, -0.5), (50.5, 30.5))
    _draw_corridors(plan)
    _draw_southern_rooms(plan)
    _draw_northern_rooms(plan)
    _draw_western_labs(plan)
    _draw_eastern_hall(plan)
    _draw_lobby(plan)
    return plan.finish(origin=(9.0, 7.2))


def _draw_corridors(plan: FloorCanvas) -> None:
    plan.open_box(1.0, 6.0, 48.6, 8.4)  # south
    plan.open_box(5.0, 21.0, 44.0, 23.0)  # north
    plan.open_box(5.0, 6.0, 7.0, 23.0)  # west
    plan.open_box(41.0, 6.0, 43.6, 23.0)  # east
    plan.open_box(22.0, 8.0, 23.8, 21.5)  # middle
    for x, y in (
        (12.0, 8.4),
        (16.5, 8.4),
        (29.0, 8.4),
        (36.2, 8.4),
        (10.0, 21.0),
        (30.5, 21.0),
        (38.0, 21.0),
    ):
        plan.solid_box(x, y - 0.15, x + 0.35, y + 0.15)  # pilasters
    plan.solid_box(1.0, 6.0, 1.6, 7.0)  # lockers at the west end
    plan.solid_box(14.0, 7.95, 15.2, 8.4)  # bench
    plan.solid_box(27.2, 6.0, 27.9, 6.3)
    plan.solid_disc(33.0, 8.1, 0.22)  # plants
    plan.solid_disc(40.7, 8.1, 0.25)
    plan.solid_disc(23.4, 14.1, 0.2)
    plan.solid_box(47.7, 7.4, 48.6, 8.4)  # vending machine
    plan.solid_box(5.0, 12.0, 5.25, 13.1)  # radiators
    plan.solid_box(43.35, 15.0, 43.6, 16.6)
    plan.solid_box(16.2, 22.7, 18.2, 23.0)
    plan.open_box(4.2, 16.6, 5.2, 18.0)  # alcoves
    plan.open_box(43.4, 10.0, 44.4, 11.8)
    plan.open_box(25.4, 20.4, 26.8, 21.2)


def _draw_southern_rooms(plan: FloorCanvas) -> None:
    rooms = ((0.6, 7.2), (7.4, 12.6), (12.8, 21.4), (21.6, 25.8), (26.0, 34.2), (34.4, 39.2), (39.4, 49.4))
    depths = (0.4, 0.4, 0.2, 1.6, 0.2, 1.0, 0.2)
    doors = (4.6, 8.2, 17.5, 24.2, 28.4, 37.4, 42.2)
    widths = (1.1, 1.05, 1.6, 1.05, 1.3, 1.1, 1.8)
    for (x0, x1), depth, door, width in zip(rooms, depths, doors, widths, strict=True):
        plan.open_box(x0, depth, x1, 5.8)
        plan.open_box(door, 5.6, door + width, 6.2)
    plan.solid_box(1.0, 0.8, 2.6, 1.6)  # offices: desks, shelves, a round table
    plan.solid_box(0.6, 4.0, 1.1, 5.8)
    plan.solid_disc(5.6, 1.9, 0.55)
    plan.solid_box(7.4, 0.4, 12.6, 0.8)
    plan.solid_box(11.0, 3.4, 12.6, 4.2)
    plan.solid_table(15.2, 2.6, 2.4, 1.1, radians(18))
    for x in (18.2, 19.4, 20.6):
        plan.solid_box(x, 0.2, x + 0.5, 2.9)
    plan.solid_disc(13.6, 5.0, 0.3)
    plan.solid_box(21.6, 3.0, 22.3, 5.8)
    for x, y in ((28.0, 2.0), (31.2, 2.0), (28.0, 4.0), (31.2, 3.8)):
        plan.solid_table(x, y, 1.5, 0.75, radians(7 * (x - y)))
    plan.solid_box(33.8, 0.2, 34.2, 5.0)
    plan.solid_box(34.4, 1.0, 35.2, 3.6)
    plan.solid_box(37.9, 1.0, 39.2, 1.9)
    for x, y in ((42.0, 2.6), (45.2, 2.6), (48.0, 3.6)):
        plan.solid_disc(x, y, 0.3)  # pillars
    plan.solid_table(46.9, 1.2, 2.0, 0.9, radians(-12))
    plan.solid_box(39.4, 3.2, 40.0, 5.4)


def _draw_northern_rooms(plan: FloorCanvas) -> None:
    rooms = ((5.0, 9.4), (9.6, 18.2), (18.4, 22.0), (22.2, 31.6))
    heights = (28.4, 29.6, 27.6, 29.6)
    doors = (7.4, 14.8, 19.8, 24.6)
    for (x0, x1), height, door in zip(rooms, heights, doors, strict=True):
        plan.open_box(x0, 23.2, x1, height)
        plan.open_box(door, 22.8, door + 1.2, 23.4)
    plan.open_box(17.8, 27.9, 22.4, 29.2)  # a passage behind the copy room joins its neighbours
    plan.solid_box(5.0, 26.9, 7.2, 28.4)
    plan.solid_disc(8.6, 26.6, 0.35)
    for x in (10.8, 13.2, 15.6):
        plan.solid_box(x, 26.4, x + 0.9, 28.2)
    plan.solid_box(9.6, 23.2, 10.1, 25.6)
    plan.solid_table(12.6, 24.6, 1.6, 0.8, radians(31))
    plan.solid_box(18.4, 26.4, 20.6, 27.6)
    plan.solid_table(27.4, 26.6, 3.6, 1.3, radians(-9))  # the conference table and its chairs
    for x, y in ((25.9, 25.9), (27.2, 25.5), (28.7, 25.4), (26.2, 27.8), (28.0, 27.5), (29.2, 27.3)):
        plan.solid_disc(x, y, 0.18)
    plan.solid_box(31.0, 28.2, 31.6, 29.6)


def _draw_western_labs(plan: FloorCanvas) -> None:
    plan.open_box(7.2, 8.6, 14.8, 14.2)
    plan.open_box(15.0, 8.6, 21.8, 17.0)
    plan.open_box(7.2, 14.4, 14.8, 20.8)
    plan.open_box(15.0, 17.2, 21.8, 20.8)
    plan.open_box(6.8, 10.0, 7.4, 11.2)  # doors to the corridors
    plan.open_box(18.6, 8.2, 19.8, 8.8)
    plan.open_box(11.6, 20.6, 12.8, 21.2)
    plan.open_box(21.6, 18.6, 22.2, 19.8)
    plan.open_box(14.6, 12.0, 15.2, 13.2)  # and between the labs
    plan.open_box(9.0, 14.0, 10.2, 14.6)
    plan.solid_box(9.6, 10.6, 12.6, 11.5)  # benches
    plan.solid_box(9.6, 12.6, 11.8, 13.3)
    plan.solid_box(14.3, 8.6, 14.8, 11.0)
    plan.solid_table(18.4, 12.6, 3.0, 1.2, radians(24))
    plan.solid_disc(16.4, 15.4, 0.3)
    plan.solid_disc(20.4, 15.4, 0.3)
    plan.solid_box(21.2, 9.4, 21.8, 12.0)
    plan.solid_box(15.0, 16.4, 18.0, 17.0)
    plan.solid_box(12.0, 16.0, 13.0, 19.0)
    plan.solid_table(9.3, 18.0, 1.8, 1.0, radians(-35))
    plan.solid_box(7.2, 20.2, 9.6, 20.8)
    plan.solid_box(15.0, 17.2, 15.6, 20.0)
    plan.solid_disc(18.2, 19.4, 0.5)


def _draw_eastern_hall(plan: FloorCanvas) -> None:
    plan.open_box(24.0, 8.6, 35.4, 17.6)  # a hall with two rows of pillars
    plan.open_box(35.6, 8.6, 40.8, 14.2)
    plan.open_box(35.6, 14.4, 40.8, 20.8)
    plan.open_box(24.0, 17.8, 35.4, 20.8)
    plan.open_box(23.6, 11.2, 24.2, 13.0)
    plan.open_box(30.6, 8.2, 32.4, 8.8)
    plan.open_box(40.6, 11.6, 41.2, 12.8)
    plan.open_box(40.6, 17.2, 41.2, 18.6)
    plan.open_box(32.4, 20.6, 33.8, 21.2)
    plan.open_box(35.2, 18.4, 35.8, 19.6)
    for x in (26.6, 29.6, 32.8):
        plan.solid_box(x - 0.25, 10.8, x + 0.25, 11.3)
        plan.solid_disc(x + 0.2, 15.0, 0.3)
    plan.solid_table(34.0, 12.9, 1.8, 0.9, radians(65))
    plan.solid_box(24.0, 16.4, 27.2, 17.6)  # the stage
    plan.solid_box(35.6, 8.6, 36.2, 11.4)
    plan.solid_table(38.6, 12.6, 1.6, 0.8, radians(14))
    plan.solid_disc(38.9, 9.8, 0.5)
    plan.solid_box(37.6, 15.6, 38.6, 17.8)
    plan.solid_box(35.6, 20.2, 39.4, 20.8)
    for x in (25.2, 27.6, 30.0):
        plan.solid_box(x, 19.9, x + 1.6, 20.8)
    plan.solid_disc(34.2, 18.6, 0.25)


def _draw_lobby(plan: FloorCanvas) -> None:
    """North-east: a lobby with a slanted glass front and a round stair well."""
    plan.open_box(33.0, 22.8, 48.8, 29.6)
    plan.open_box(43.4, 18.0, 48.8, 23.4)
    plan.solid_table(49.6, 29.8, 7.0, 3.6, radians(-40))
    plan.solid_table(33.2, 29.9, 2.6, 2.0, radians(40))
    plan.solid_disc(40.2, 26.4, 1.3)
    plan.solid_box(44.8, 24.6, 47.2, 25.2)  # the desk
    plan.solid_box(44.8, 25.1, 45.3, 26.4)
    for x, y in ((36.0, 25.0), (36.4, 28.2), (45.6, 20.6)):
        plan.solid_disc(x, y, 0.28)
    plan.solid_box(48.2, 18.0, 48.8, 20.6)
