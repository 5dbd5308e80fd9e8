"""Services that pause a mapper, called as slam_toolbox's: it leaves out scans meanwhile."""

from functools import partial
from typing import Any

from std_srvs.srv import SetBool

from racecar.pipelines.live.monitoring.faults import Faults
from racecar.pipelines.live.ros.message_types import service_class
from racecar.pipelines.live.work.worker import Worker

_NAME = "pause_new_measurements"
_MOST_WAITING = 100
"""Requests. Chosen by judgement: a worker that maps again what a killed node had logged may be behind."""
_PAUSED = "Mapping is paused: scans are left out, and the car is where the odometry says."


class PauseService:
    """Pauses between two messages, in the worker's turn, so that those that came before are still mapped."""

    def __init__(self, node: Any, worker: Worker, faults: Faults) -> None:
        self._node, self._worker, self._faults = node, worker, faults
        self.is_paused = False
        """For the worker."""
        self._is_to_pause = False
        """As last requested."""

    def start(self) -> None:
        """Create the services whose types this ROS has."""
        self._node.create_service(SetBool, _NAME, self._on_set)
        if (kind := service_class("slam_toolbox", "Pause")) is not None:
            self._node.create_service(kind, f"slam_toolbox/{_NAME}", self._on_toggle)

    def _on_set(self, request: Any, response: Any) -> Any:
        self._request(request.data)
        response.success, response.message = True, _PAUSED if request.data else "Mapping goes on."
        return response

    def _on_toggle(self, _request: Any, response: Any) -> Any:
        self._request(not self._is_to_pause)
        response.status = True
        return response

    def _request(self, is_to_pause: bool) -> None:
        self._is_to_pause = is_to_pause
        self._worker.put("pause", partial(self._set, is_to_pause), _MOST_WAITING)

    def _set(self, is_paused: bool) -> None:
        self.is_paused = is_paused
        if is_paused:
            self._faults.report("paused", _PAUSED)
        else:
            self._faults.end("paused", "Mapping goes on.")
