"""The service ``save_map``: save the map so far while the drive continues."""

from collections.abc import Callable
from concurrent.futures import Future, TimeoutError
from contextlib import ExitStack
from typing import Any

from std_srvs.srv import Trigger

from racecar.maps.errors import UserError
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.pipelines.live.ros.run import sister_node
from racecar.pipelines.live.saving.map_saving import MapOutput

_ANSWER_SECONDS = 120.0
"""Seconds to wait for the mapper, which may be closing loops. Chosen by judgement: it is never behind for
longer."""


class SaveService:
    """Responds when the files are written.

    It waits in its own thread and works in its own process, so the drive continues meanwhile.
    """

    def __init__(
        self,
        node: Any,
        output: MapOutput,
        request_drives: Callable[[], "Future[bytes]"],
        faults: Faults,
        saved: Callable[[str], None],
    ) -> None:
        """``request_drives``: requests the current drives, pickled; may fail with a UserError. ``saved``
        receives a sentence about each map that was saved."""
        self._node, self._output, self._request_drives = node, output, request_drives
        self._faults, self._saved = faults, saved
        self._served = ExitStack()

    def start(self) -> None:
        """Create the service."""
        saver = self._served.enter_context(sister_node(self._node, "racecar_map_saver"))
        saver.create_service(Trigger, "save_map", self._on_save)

    def stop(self) -> None:
        """Finish saving and stop."""
        self._served.close()

    def _on_save(self, _request: Any, response: Any) -> Any:
        try:
            self._output.save_apart(self._request_drives().result(_ANSWER_SECONDS))
        except (UserError, OSError, RuntimeError, TimeoutError) as error:
            response.success, response.message = False, f"The map was not saved: {error}"
            self._faults.report("saving", response.message, lasting=False)
            return response
        response.success, response.message = True, f"The map is saved in {self._output.folder}."
        self._saved(response.message)
        return response
