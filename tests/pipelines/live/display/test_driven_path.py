import numpy as np


def test_an_hour_of_driving_stays_a_path_of_bounded_length() -> None:
    from racecar.pipelines.live.display.node_display import DrivenPath

    path = DrivenPath()
    for step in range(200_000):
        path.add(np.array([0.025 * step, 0.0, 0.0]))
    assert 1000 < len(path.poses) <= 4000
    x = path.poses[:, 0]
    assert x[0] == 0.0
    assert 4990.0 < x[-1] < 5000.0
    assert np.diff(x).max() < 6.0


def test_a_car_that_stands_adds_nothing() -> None:
    from racecar.pipelines.live.display.node_display import DrivenPath

    path = DrivenPath()
    for _ in range(100):
        path.add(np.array([1.0, 1.0, 0.3]))
    assert len(path.poses) == 1
