"""The states of a live node as a ROS lifecycle node, driven by itself or by nav2's lifecycle manager.

See https://design.ros2.org/articles/node_lifecycle.html.
"""

import gc
import logging
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from pydantic import Field
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

from racecar.maps.errors import UserError
from racecar.maps.settings import Settings
from racecar.pipelines.live.monitoring.faults import with_short_words
from racecar.pipelines.live.node import LiveNode
from racecar.pipelines.live.ros.bond import Bond
from racecar.pipelines.live.ros.node_share import NodeShare
from racecar.pipelines.live.ros.parameters import declare_settings
from racecar.pipelines.live.work.free_memory import give_back_free_memory

_log = logging.getLogger(__name__)

_SUCCESS, _FAILURE, _ERROR = (
    TransitionCallbackReturn.SUCCESS,
    TransitionCallbackReturn.FAILURE,
    TransitionCallbackReturn.ERROR,
)


class _Management(Settings):
    """Who brings the node up."""

    use_lifecycle_manager: bool = Field(
        False,
        description="wait until nav2's lifecycle manager configures and activates the node, and bond with it",
    )


class ManagedNode(LifecycleNode):  # type: ignore[misc]
    """Creates a `LiveNode` when it is configured, starts it when it is activated, and so on."""

    def __init__(self, name: str, create: Callable[[Any, bool], LiveNode]) -> None:
        """``create``: the `LiveNode` on a ROS node, told whether it is the first; may raise UserError.

        Raises UserError that names the invalid parameter.
        """
        super().__init__(name)
        self.live: LiveNode | None = None
        """None while unconfigured or finalized."""
        self._create, self._is_first = create, True
        self._share = NodeShare(self)
        self._bond: Bond | None = None
        self._error: Exception | None = None
        """Why the last transition failed."""
        self._is_managed = declare_settings(self, _Management(), read_only=True).use_lifecycle_manager
        self._change_state = self._service_change_state.callback
        self._service_change_state.callback = self._on_change_state

    def bring_up(self) -> None:
        """Configure and activate, unless a lifecycle manager does. Raises what prevents it."""
        if self._is_managed:
            self.inform("Waiting for a lifecycle manager to configure and activate the node.")
            return
        for transition in (self.trigger_configure, self.trigger_activate):
            transition()
            if self._error is not None:
                raise self._error

    def end(self) -> None:
        """Stop, in whatever state."""
        try:
            self._break_bond()
        finally:
            if self.live is not None:
                self.live.stop()

    def destroy_node(self) -> None:
        """With the services of its states: rclpy leaves them, and so the DDS participant, to Python's garbage
        collection, and one that vanishes while another discovers it may hide that one's services for ever."""
        super().destroy_node()
        self._state_machine.destroy_when_not_in_use()

    def summary(self) -> dict[str, Any]:
        """Figures since the last activation; none before the first."""
        return {} if self.live is None else self.live.summary()

    def inform(self, sentence: str) -> None:
        """Log a sentence."""
        self.get_logger().info(with_short_words(sentence))

    def survive(self, error: Exception) -> None:
        """Report an exception in a callback, after which the node continues."""
        if self.live is not None:
            self.live.survive(error)
        else:
            self._warn(_sentence(error))

    def on_configure(self, _state: Any) -> Any:
        """Create the `LiveNode`; if that fails, the node stays unconfigured."""
        return self._attempt(self._configure, _FAILURE)

    def on_activate(self, _state: Any) -> Any:
        """Start it."""
        return self._attempt(self._activate, _ERROR)

    def on_deactivate(self, _state: Any) -> Any:
        """Stop it, and have its successor ready to be activated."""
        return self._attempt(self._deactivate, _ERROR)

    def on_cleanup(self, _state: Any) -> Any:
        """Free everything."""
        return self._attempt(self._clean_up, _ERROR)

    def on_shutdown(self, _state: Any) -> Any:
        """The same from any state, for good."""
        return self._attempt(self._shut_down, _FAILURE)

    def on_error(self, _state: Any) -> Any:
        """Stop as far as that is possible and free everything, so that the node is unconfigured."""
        with suppress(Exception):
            self.end()
        self._clean_up()
        return _SUCCESS

    def _configure(self) -> None:
        try:
            self.live = self._create(self._share, self._is_first)
        except Exception:
            self._share.destroy()
            raise
        self._is_first = False

    def _activate(self) -> None:
        assert self.live is not None
        self.live.start()
        if self._is_managed:
            self._bond = Bond(self)

    def _deactivate(self) -> None:
        assert self.live is not None
        self._break_bond()
        self.live.stop()
        self._share.destroy()
        self.live = self.live.renewed()
        _free_memory()

    def _clean_up(self) -> None:
        self._share.destroy()
        self.live = None
        _free_memory()

    def _shut_down(self) -> None:
        try:
            self.end()
        finally:
            self._clean_up()

    def _break_bond(self) -> None:
        bond, self._bond = self._bond, None
        if bond is not None:
            bond.destroy()

    def _attempt(self, transition: Callable[[], None], outcome: Any) -> Any:
        """Success, or the ``outcome`` if the transition raises an exception."""
        self._error = None
        try:
            transition()
        except Exception as error:
            self._error = error
            return outcome
        return _SUCCESS

    def _on_change_state(self, request: Any, response: Any) -> Any:
        """Answer those who ask for a transition that there is not, too, which rclpy does not."""
        try:
            self._change_state(request, response)
        except RuntimeError:
            response.success = False
            wanted = request.transition.label or f"number {request.transition.id}"
            state = self._state_machine.current_state[1]
            self._warn(f"The node is {state}, from where the transition {wanted} does not lead on.")
        error, self._error = self._error, None
        if error is not None:
            self._warn(_sentence(error))
        return response

    def _warn(self, sentence: str) -> None:
        self.get_logger().warning(with_short_words(sentence))


def _free_memory() -> None:
    """Now, since a node that has ended is in cycles of references, which Python seldom looks for."""
    gc.collect()
    give_back_free_memory()


def _sentence(error: Exception) -> str:
    if isinstance(error, UserError):
        return str(error)
    _log.error("What failed", exc_info=error)
    return f"A fault in racecar, not yours ({type(error).__name__}: {error}); please report it."
