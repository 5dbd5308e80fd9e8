"""The pose graph as a g2o file for other solvers and viewers."""

from collections.abc import Sequence
from pathlib import Path

import gtsam

from racecar.mapping.graph.constraint import Constraint
from racecar.maps.geometry.se2 import Pose
from racecar.maps.whole_files import write_atomically


def save_g2o(map_from_keyframe: Pose, constraints: Sequence[Constraint], path: Path) -> None:
    """Write keyframe poses (K, 3) and the constraints between them.

    gtsam omits priors and rejects robust noise models, so the graph is written with plain Gaussian ones.
    Raises UserError when the file cannot be written.
    """
    values = gtsam.Values()
    for key, pose in enumerate(map_from_keyframe):
        values.insert(key, gtsam.Pose2(*pose))
    graph = gtsam.NonlinearFactorGraph()
    for constraint in constraints:
        graph.add(
            gtsam.BetweenFactorPose2(
                constraint.from_keyframe,
                constraint.to_keyframe,
                gtsam.Pose2(*constraint.from_pose_to_pose),
                gtsam.noiseModel.Gaussian.Information(constraint.information),
            )
        )
    with write_atomically(path) as partial:
        gtsam.writeG2o(graph, values, str(partial))
