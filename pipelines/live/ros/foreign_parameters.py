"""Parameter files of AMCL and slam_toolbox: what has a counterpart here is taken, the rest is listed.

A section of such a file is for the node of that name, so ours must bear it (``-r __node:=amcl``). The tables
leave out the parameters that have the same name here.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import pairwise
from typing import Any

from rclpy.parameter import Parameter

from racecar.maps.errors import UserError
from racecar.maps.nested_settings import leaf_values
from racecar.maps.text_files import read_text
from racecar.maps.yaml_text import MOST_BYTES, UnreadableYamlError, parse_yaml
from racecar.pipelines.live.ros.parameters import SettingsT, updated


@dataclass(frozen=True)
class _Counterpart:
    """A parameter of ours that does the same."""

    name: str
    converted: Callable[[Any], Any] = lambda value: value
    """Its value; None to leave it as it is."""


@dataclass(frozen=True)
class ForeignNode:
    """A node that one of ours takes the place of."""

    name: str
    section: str
    """Its section in a parameter file: the name of the node."""
    counterparts: Mapping[str, _Counterpart]
    """By their names there."""
    not_needed: Mapping[str, str]
    """Names and patterns, with commas between, of those that have none, and why."""

    def unread_section(self, node_name: str, ros_arguments: Sequence[str]) -> str | None:
        """A sentence if a file among the arguments has a section for the foreign node which ours, by its
        name, does not read."""
        files = [file for word, file in pairwise(ros_arguments) if word == "--params-file"]
        if node_name == self.section or not any(map(self._has_section, files)):
            return None
        return (
            f"The section {self.section} of the parameter file is not read, as this node is called "
            f"{node_name}; add -r __node:={self.section}."
        )

    def _has_section(self, file: str) -> bool:
        try:
            contents = parse_yaml(read_text(file, MOST_BYTES))
        except (UserError, UnreadableYamlError):
            return False  # ROS has read it, and complained if it cannot
        return isinstance(contents, Mapping) and self.section in {str(key).lstrip("/") for key in contents}

    def reason(self, parameter: str) -> str | None:
        """Why a parameter is not needed; None if the foreign node has no such parameter."""
        for patterns, reason in self.not_needed.items():
            if any(fnmatchcase(parameter, pattern) for pattern in patterns.split(", ")):
                return reason
        return None


class ForeignParameters:
    """Those that a node was given."""

    def __init__(self, node: Any, foreign: ForeignNode) -> None:
        """There are none for a node that is not the first on its ROS node, and finds all declared."""
        self._node, self._foreign = node, foreign
        # rclpy's public way is to declare all that was given at once, without bounds.
        overrides: Mapping[str, Parameter] = (
            {} if node.has_parameter("map_frame") else node._parameter_overrides
        )
        self._given = {name: parameter.value for name, parameter in overrides.items()}
        self._overruled: list[str] = []
        self.left_out: dict[str, str] = {}
        """Sentences on counterparts that do not take the value, by the name of the foreign one."""

    def over(self, settings: SettingsT) -> SettingsT:
        """The settings with what was given for their counterparts, unless these are given, too."""
        known = leaf_values(settings)
        for name, ours in self._foreign.counterparts.items():
            if name not in self._given or ours.name not in known:
                continue
            value = ours.converted(self._given[name])
            if ours.name in self._given:
                self._overruled.append(f"{name} (by {ours.name})")
            elif value is not None:
                try:
                    settings = updated(settings, {ours.name: value})
                except UserError as error:
                    self.left_out[name] = f"{name} of {self._foreign.name} is left out. {error}"
        return settings

    def sentence(self) -> str | None:
        """What became of them, once those of ours are declared; None if none is foreign."""
        own = [name for name in self._given if self._node.has_parameter(name)]
        counterparts = [name for name in self._given if name in self._foreign.counterparts]
        others = [name for name in self._given if name not in own and name not in counterparts]
        if not counterparts and not others:
            return None
        named = {name: self._foreign.counterparts[name].name for name in counterparts}
        taken = [
            f"{name} as {ours}"
            for name, ours in named.items()
            if name not in self.left_out and ours not in self._given
        ]
        not_needed: dict[str, list[str]] = {}
        unknown: list[str] = []
        for name in others:
            reason = self._foreign.reason(name)
            (unknown if reason is None else not_needed.setdefault(reason, [])).append(name)
        parts = {
            f"Parameters of {self._foreign.name} that are taken": ", ".join([*own, *taken]),
            "Overruled by those of this node": ", ".join(self._overruled),
            "Without a counterpart here, and not needed": "; ".join(
                f"{', '.join(names)} ({reason})" for reason, names in not_needed.items()
            ),
            f"Unknown here and in {self._foreign.name}": ", ".join(unknown),
        }
        return " ".join(f"{title}: {names}." for title, names in parts.items() if names)


def _if_positive(value: Any) -> Any:
    """Zero and less stand for what is usual."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return None if is_number and value <= 0 else value


def _unless_off(value: Any) -> Any:
    """What to publish as a transform; a switch or a period, which is 0 for none."""
    if not isinstance(value, bool | int | float):
        return value
    return None if value else "none"


_RANGES = (
    "what the scans state holds, which they can only narrow; min_range and max_range of this node overrule it"
)

AMCL = ForeignNode(
    "AMCL",
    "amcl",
    {
        "max_particles": _Counterpart("particles"),
        "min_particles": _Counterpart("fewest_particles"),
        "max_beams": _Counterpart("beams"),
        "global_frame_id": _Counterpart("map_frame"),
        "base_frame_id": _Counterpart("base_frame"),
        "tf_broadcast": _Counterpart("tf", _unless_off),
    },
    {
        "laser_min_range, laser_max_range": _RANGES,
        "odom_frame_id": "the messages of the odometry name its frame",
        "alpha?, robot_model_type": "AMCL's noise is per update of its filter; that of turn_noise_per_turn "
        "and the like is per radian and metre, of every robot",
        "laser_model_type, laser_likelihood_max_dist, sigma_hit, z_*, lambda_short": "the likelihood field, "
        "which needs no tuning, is the only sensor model",
        "do_beamskip, beam_skip_*": "beams that contradict the map never count while the place is known",
        "update_min_?, resample_interval, pf_err, pf_z": "a scan counts after 2 cm or 1.1 degrees of motion, "
        "and the particles needed follow from their spread",
        "recovery_alpha_*": "global localization starts by itself when the car is lost",
        "save_pose_rate, always_reset_initial_pose": "the pose is remembered over a restart, unless "
        "--no-memory is given",
        "initial_pose.z": "the map is flat",
        "bond_*, *_topic_qos, service_introspection_mode, introspection_mode, random_seed, "
        "freespace_downsampling, allow_parameter_qos_overrides": "nothing that changes poses",
    },
)

SLAM_TOOLBOX = ForeignNode(
    "slam_toolbox",
    "slam_toolbox",
    {
        "minimum_travel_distance": _Counterpart("keyframe_distance", _if_positive),
        "minimum_travel_heading": _Counterpart("keyframe_angle", _if_positive),
        "do_loop_closing": _Counterpart("close_loops"),
        "transform_publish_period": _Counterpart("tf", _unless_off),
        "transform_timeout": _Counterpart("transform_tolerance"),
    },
    {
        "lifelong_*": "the map of every drive can be extended",
        "min_laser_range, max_laser_range": _RANGES,
        "odom_frame": "the messages of the odometry name its frame",
        "mode": "this node always maps; `racecar live localize` localizes",
        "map_name, use_map_saver": "the map is on /map, unless that is remapped, and is saved at the end",
        "solver_plugin, ceres_*": "GTSAM solves the pose graph",
        "throttle_scans, minimum_time_interval, scan_queue_size, tf_buffer_duration, "
        "stack_size_to_use, map_update_interval, lidar_frequency": "every scan is used, as soon as the "
        "odometry has caught up",
        "use_scan_matching, use_scan_barycenter, scan_buffer_*, link_*, correlation_*, *_penalty, "
        "*_angle_offset, coarse_angle_resolution, *_search_*, use_response_expansion, loop_*, "
        "check_min_dist_and_heading_precisely, min_pass_through, occupancy_threshold": "scans and loops are "
        "matched by other methods",
        "position_covariance_scale, yaw_covariance_scale": "poses are published without covariance",
        "debug_logging, enable_interactive_mode, paused_*, localization_on_configure, restamp_tf, "
        "bond_*, localization_*": "nothing that changes the map",
    },
)
