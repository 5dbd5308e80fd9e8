"""The service ``save_map``, and those that nav2 and slam_toolbox have for it: save the map so far while the
drive continues, or have the drive extend an earlier one."""

from collections.abc import Callable
from concurrent.futures import Future, TimeoutError
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from std_srvs.srv import Trigger

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.bags.converters.odometry import pose_in_plane
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.pipelines.live.ros.message_types import service_class
from racecar.pipelines.live.ros.run import sister_node
from racecar.pipelines.live.saving.map_saving import MapOutput

_ANSWER_SECONDS = 120.0
"""Seconds to wait for the mapper, which may be closing loops. Chosen by judgement: it is never behind for
longer."""

_SUCCESS, _FAILURE = 0, 255
"""Results by definition of slam_toolbox's services."""
_START_AT_FIRST_NODE, _START_AT_GIVEN_POSE, _LOCALIZE_AT_POSE = 1, 2, 3
"""Match types by definition of DeserializePoseGraph; 0 is none."""


class Extend(Protocol):
    """Has the drive extend the map in a folder. The car is at a pose (3,) there, or where the first drive of
    that map started, or it must be recognized. Raises UserError when there is no such map."""

    def __call__(self, folder: Path, start: Pose | None, *, starts_at_first: bool) -> None: ...


class SaveService:
    """Responds when the files are written.

    It waits in its own thread and works in its own process, so the drive continues meanwhile.
    """

    def __init__(
        self,
        node: Any,
        output: Callable[[], MapOutput],
        request_drives: Callable[[], "Future[bytes]"],
        extend: Extend,
        faults: Faults,
        saved: Callable[[str, Path], None],
    ) -> None:
        """``request_drives``: requests the current drives, pickled; may fail with a UserError. ``saved``
        receives a sentence about each map that was saved, and its folder."""
        self._node, self._output, self._request_drives = node, output, request_drives
        self._extend, self._faults, self._saved = extend, faults, saved
        self._served = ExitStack()

    def start(self) -> None:
        """Create the services whose types this ROS has."""
        saver = self._served.enter_context(sister_node(self._node, "racecar_map_saver"))
        saver.create_service(Trigger, "save_map", self._on_save)
        for package, kind, name, answer in (
            ("nav2_msgs", "SaveMap", "map_saver/save_map", self._on_nav2_save),
            ("slam_toolbox", "SaveMap", "slam_toolbox/save_map", self._on_slam_toolbox_save),
            ("slam_toolbox", "SerializePoseGraph", "slam_toolbox/serialize_map", self._on_serialize),
            ("slam_toolbox", "DeserializePoseGraph", "slam_toolbox/deserialize_map", self._on_deserialize),
        ):
            if (service := service_class(package, kind)) is not None:
                saver.create_service(service, name, answer)

    def stop(self) -> None:
        """Finish saving and stop."""
        self._served.close()

    def _on_save(self, _request: Any, response: Any) -> Any:
        response.success, response.message = self._save()
        return response

    def _on_nav2_save(self, request: Any, response: Any) -> Any:
        """Image and thresholds are those of the settings."""
        resolve = self._node.resolve_topic_name
        if request.map_topic and resolve(request.map_topic) != resolve("map"):
            response.result = False
            self._fail(f"it is on {resolve('map')}, and {request.map_topic} is another's.")
        else:
            response.result = self._save(copy=request.map_url)[0]
        return response

    def _on_slam_toolbox_save(self, request: Any, response: Any) -> Any:
        is_saved = self._save(copy=request.name.data)[0]
        if hasattr(response, "result"):  # not in the first distributions
            response.result = _SUCCESS if is_saved else _FAILURE
        return response

    def _on_serialize(self, request: Any, response: Any) -> Any:
        folder = Path(request.filename) if request.filename else self._output().folder
        response.result = _SUCCESS if self._save(folder)[0] else _FAILURE
        return response

    def _on_deserialize(self, request: Any, response: Any) -> Any:
        """The map so far is not thrown away, as slam_toolbox does, but joined with the earlier one."""
        kind = request.match_type
        try:
            if kind == _LOCALIZE_AT_POSE:
                raise UserError(f"`racecar live localize --map {request.filename}` localizes on it.")
            if not request.filename:
                raise UserError("filename names no folder.")
            start = _pose_of(request.initial_pose) if kind == _START_AT_GIVEN_POSE else None
            self._extend(Path(request.filename), start, starts_at_first=kind == _START_AT_FIRST_NODE)
        except UserError as error:
            self._faults.report("extending", f"No earlier map is extended: {error}", lasting=False)
            result = _FAILURE
        else:
            result = _SUCCESS
        if hasattr(response, "result"):  # in the latest distributions only
            response.result = result
        return response

    def _save(self, folder: Path | None = None, copy: str = "") -> tuple[bool, str]:
        """Save the run to its own folder or another one, and its map also as the YAML file ``copy``, as
        map_saver names it: a path with or without its ending, or an URL. Returns whether that succeeded, and
        a sentence."""
        output = self._output()
        if folder is not None:
            output = replace(output, folder=folder.absolute())
        places = [str(output.folder)]
        try:
            target = _yaml_path(copy) if copy else None
            said = output.save_apart(self._request_drives().result(_ANSWER_SECONDS))
            if target is not None:
                output.copy_map(target)
                places.append(str(target))
        except (UserError, OSError, RuntimeError, TimeoutError) as error:
            return False, self._fail(str(error))
        sentence = " ".join([f"The map is saved in {' and as '.join(places)}.", *said])
        self._saved(sentence, output.folder)
        return True, sentence

    def _fail(self, reason: str) -> str:
        sentence = f"The map was not saved: {reason}"
        self._faults.report("saving", sentence, lasting=False)
        return sentence


def _pose_of(message: Any) -> Pose:
    """(3,) of a Pose2D, or of the Pose that the latest distributions have in its place. Raises UserError if
    it is not valid."""
    if hasattr(message, "theta"):
        pose: Pose | None = np.array([message.x, message.y, message.theta])
    else:
        pose = pose_in_plane(message)
    if pose is None or not np.isfinite(pose).all():
        raise UserError("initial_pose is not valid.")
    return pose


def _yaml_path(name: str) -> Path:
    """Raises UserError if the name is not one of a file."""
    path = name.removeprefix("file://")
    if "://" in path:
        raise UserError(f"{name} is not the name of a file; give a path, or file:// and a path.")
    return Path(path if path.endswith(".yaml") else f"{path}.yaml").absolute()
