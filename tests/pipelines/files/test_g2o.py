from pathlib import Path

import gtsam
import numpy as np

from racecar.mapping.graph.constraint import Constraint
from racecar.pipelines.files.g2o import save_g2o


def test_graph_is_read_back(tmp_path: Path) -> None:
    poses = np.array([[0.0, 0.0, 0.0], [1.0, 0.2, 0.5], [1.5, 1.0, -3.0]])
    information = np.array([[100.0, 3.0, 1.0], [3.0, 50.0, 2.0], [1.0, 2.0, 900.0]])
    constraints = [
        Constraint(0, 1, np.array([1.0, 0.25, 0.5]), information, "scan_matching"),
        Constraint(2, 0, np.array([0.5, 0.5, 3.0]), 2 * information, "loop_closure"),
    ]
    save_g2o(poses, constraints, tmp_path / "pose_graph.g2o")
    graph, values = gtsam.readG2o(str(tmp_path / "pose_graph.g2o"), False)
    for key, pose in enumerate(poses):
        read = values.atPose2(key)
        np.testing.assert_allclose([read.x(), read.y(), read.theta()], pose, atol=1e-6)
    assert graph.size() == 2
    for index, constraint in enumerate(constraints):
        factor = graph.at(index)
        assert list(factor.keys()) == [constraint.from_keyframe, constraint.to_keyframe]
        measured = factor.measured()
        np.testing.assert_allclose(
            [measured.x(), measured.y(), measured.theta()], constraint.from_pose_to_pose, atol=1e-6
        )
        np.testing.assert_allclose(factor.noiseModel().information(), constraint.information, rtol=1e-5)
