"""nav2's lifecycle manager as nodes see it: the services it calls, and the bond it forms with each."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from uuid import uuid4

from racecar.pipelines.bags.messages import BOND, ros2_types
from tests.pipelines.message_samples import TYPES, header

CONFIGURE, CLEANUP, ACTIVATE, DEACTIVATE, SHUTDOWN = 1, 2, 3, 4, 5
"""Transitions by their numbers; the last is that of an unconfigured node."""
UNCONFIGURED, INACTIVE, ACTIVE, FINALIZED = 1, 2, 3, 4
_GOALS = {
    CONFIGURE: INACTIVE,
    CLEANUP: UNCONFIGURED,
    ACTIVATE: ACTIVE,
    DEACTIVATE: INACTIVE,
    SHUTDOWN: FINALIZED,
}
_PERIOD, _TIMEOUT = 0.1, 4.0
"""Seconds, as nav2 has them: ``bond_timeout`` and its heartbeats."""
_SERVICE_SECONDS = 60.0
"""nav2 waits 5 s; a computer on which many tests run is slower."""


class Manager:
    """Brings one node up and down, and watches it meanwhile."""

    def __init__(self, node: Any, name: str) -> None:
        """``name``: of the node, which need not be there yet."""
        from lifecycle_msgs.srv import ChangeState, GetState

        self._node, self._name = node, name
        self._change = node.create_client(ChangeState, f"/{name}/change_state")
        self._get = node.create_client(GetState, f"/{name}/get_state")
        self.bond: Sister | None = None

    @property
    def state(self) -> int:
        from lifecycle_msgs.srv import GetState

        assert self._get.wait_for_service(_SERVICE_SECONDS)
        return int(self._get.call(GetState.Request(), timeout_sec=_SERVICE_SECONDS).current_state.id)

    def change(self, transition: int) -> bool:
        """Whether it succeeded, as the node says and its state shows; a bond is formed and given up with it,
        as nav2 does."""
        from lifecycle_msgs.srv import ChangeState

        request = ChangeState.Request()
        request.transition.id = transition
        assert self._change.wait_for_service(_SERVICE_SECONDS)
        response = self._change.call(request, timeout_sec=_SERVICE_SECONDS)
        assert response is not None, f"no answer to {transition}"
        if not response.success or self.state != _GOALS[transition]:
            return False
        if transition == ACTIVATE:
            self.bond = Sister(self._node, self._name)
            return self.bond.is_formed_within(_TIMEOUT / 2)
        if transition == DEACTIVATE:
            self.forget_bond()
        return True

    def startup(self) -> bool:
        return self.change(CONFIGURE) and self.change(ACTIVATE)

    def reset(self) -> bool:
        return self.change(DEACTIVATE) and self.change(CLEANUP)

    def shutdown(self) -> bool:
        return self.reset() and self.change(SHUTDOWN)

    def forget_bond(self) -> None:
        if self.bond is not None:
            self.bond.destroy()
            self.bond = None


class Sister:
    """The manager's end of a bond."""

    def __init__(self, node: Any, name: str) -> None:
        from racecar.pipelines.live.ros.message_types import message_class

        kind = message_class(BOND)
        self._node, self._name, self.instance = node, name, str(uuid4())
        self.heard: list[tuple[float, str, bool]] = []
        """When, from which instance, and whether it lives."""
        self._publisher = node.create_publisher(kind, "bond", 5)
        self._subscription = node.create_subscription(kind, "bond", self._hear, 100, raw=True)
        self._timer = node.create_timer(_PERIOD, self.say)

    def destroy(self) -> None:
        """Break it."""
        self.fall_silent()
        self.say(is_active=False)
        time.sleep(0.1)
        self._node.destroy_timer(self._timer)
        self._node.destroy_subscription(self._subscription)
        self._node.destroy_publisher(self._publisher)

    def fall_silent(self) -> None:
        self._timer.callback = lambda: None

    def say(self, *, is_active: bool = True) -> None:
        status = TYPES[BOND](
            header=header(0, ""),
            id=self._name,
            instance_id=self.instance,
            active=is_active,
            heartbeat_timeout=_TIMEOUT,
            heartbeat_period=_PERIOD,
        )
        self._publisher.publish(bytes(ros2_types().serialize_cdr(status, BOND)))

    def is_formed_within(self, seconds: float) -> bool:
        return self.comes_true(lambda: bool(self.heard), seconds)

    def is_broken_within(self, seconds: float) -> bool:
        """Whether the node says so, or nothing at all any more."""
        return self.comes_true(lambda: self._is_broken, seconds)

    @property
    def _is_broken(self) -> bool:
        return bool(self.heard) and (not self.heard[-1][2] or time.monotonic() - self.heard[-1][0] > _TIMEOUT)

    def comes_true(self, condition: Any, seconds: float) -> bool:
        until = time.monotonic() + seconds
        while not condition() and time.monotonic() < until:
            time.sleep(0.01)
        return bool(condition())

    def _hear(self, serialized: bytes) -> None:
        status = ros2_types().deserialize_cdr(serialized, BOND)
        if status.id == self._name and status.instance_id != self.instance:
            self.heard.append((time.monotonic(), status.instance_id, status.active))


@contextmanager
def manager_of(name: str) -> Iterator[Manager]:
    """ROS must run."""
    import rclpy

    from racecar.pipelines.live.ros.run import served

    node = rclpy.create_node("lifecycle_manager")
    try:
        with served(node):
            yield Manager(node, name)
    finally:
        node.destroy_node()
