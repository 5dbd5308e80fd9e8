"""Clicked goals and places as messages, by the names that a node has for its topics."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.studio.pointed import Pointed
from tests.pipelines.live.stage import wait_for

GOAL = np.array([2.0, -1.0, 0.5])
REMAPPED = ("-r", "__ns:=/car2", "-r", "goal_pose:=/fleet/goal")


@pytest.fixture(scope="module")
def node() -> Iterator[Any]:
    from tests.pipelines.live.bus import ros_bus

    with ros_bus() as bus:
        yield bus.node("test_clicks", *REMAPPED)


def test_nobody_who_listens_is_told_with_what_to_do(node: Any) -> None:
    from racecar.pipelines.live.display.clicks import Clicks

    with pytest.raises(UserError) as nobody:
        Clicks(node, "map", tells_places=True).send_goal(GOAL)
    assert str(nobody.value) == (
        "Nobody listens on /fleet/goal; start a navigation or `racecar live simulate`."
    )
    with pytest.raises(UserError, match="Nobody listens on /car2/initialpose"):
        Clicks(node, "map", tells_places=True).send_place(Pointed(GOAL[:2], 0.3, 1.0, 0.2))


def test_who_listens_gets_goals_and_places_and_is_named(node: Any) -> None:
    from geometry_msgs.msg import PointStamped, PoseStamped, PoseWithCovarianceStamped

    from racecar.pipelines.live.display.clicks import Clicks
    from racecar.pipelines.live.ros.messages import start_pose

    goals: list[Any] = []
    poses: list[Any] = []
    points: list[Any] = []
    node.create_subscription(PoseStamped, "/fleet/goal", goals.append, 10)
    node.create_subscription(PoseWithCovarianceStamped, "initialpose", poses.append, 10)
    node.create_subscription(PointStamped, "clicked_point", points.append, 10)
    clicks = Clicks(node, "floor", tells_places=True)
    words = clicks.send_goal(GOAL)
    assert words == ("The goal x 2.00 m, y -1.00 m, heading 29° went to car2/test_clicks (on /fleet/goal).")
    clicks.send_place(Pointed(GOAL[:2], 0.3, 1.0, 0.2))
    clicks.send_place(Pointed(GOAL[:2], 0.3))
    wait_for(lambda: bool(goals and poses and points), lambda: f"{goals} {poses} {points}")
    assert {each[0].header.frame_id for each in (goals, poses, points)} == {"floor"}
    assert goals[0].header.stamp.sec > 0
    assert 2.0 * np.arctan2(goals[0].pose.orientation.z, goals[0].pose.orientation.w) == pytest.approx(0.5)
    pose, covariance = start_pose(poses[0])
    np.testing.assert_allclose(pose, [2.0, -1.0, 1.0])
    np.testing.assert_allclose(covariance, np.diag([0.09, 0.09, 0.04]))
    assert (points[0].point.x, points[0].point.y) == (2.0, -1.0)


def test_a_closed_sender_sends_nothing(node: Any) -> None:
    from racecar.pipelines.live.display.clicks import Clicks

    clicks = Clicks(node, "map", tells_places=False)
    clicks.close()
    with pytest.raises(UserError, match="the node is ending"):
        clicks.send_goal(GOAL)
