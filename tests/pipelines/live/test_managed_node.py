"""The states of a node, and its bond, over DDS; the test plays nav2's lifecycle manager."""

import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from racecar.maps.errors import UserError
from tests.pipelines.live.lifecycle_manager import (
    ACTIVATE,
    ACTIVE,
    CLEANUP,
    CONFIGURE,
    DEACTIVATE,
    FINALIZED,
    INACTIVE,
    UNCONFIGURED,
    Manager,
    Sister,
    manager_of,
)

NAME = "test_managed"
_INACTIVE_SHUTDOWN, _ACTIVE_SHUTDOWN = 6, 7


class Work:
    """What a managed node does: it notes what is asked of it, and fails on demand."""

    def __init__(self, node: Any, done: list[str], fails: dict[str, Exception]) -> None:
        self.node, self.done, self.fails = node, done, fails
        self._do("create")
        node.create_subscription(_string(), "/told", lambda _: done.append("hear"), 10)

    def _do(self, what: str) -> None:
        self.done.append(what)
        if what in self.fails:
            raise self.fails.pop(what)

    def start(self) -> None:
        self._do("start")

    def stop(self) -> None:
        self._do("stop")

    def renewed(self) -> "Work":
        self._do("renew")
        return Work(self.node, self.done, self.fails)


def _string() -> Any:
    from std_msgs.msg import String

    return String


class Stage:
    """A managed node, what it does, and its manager."""

    def __init__(self, node: Any, manager: Manager, done: list[str], fails: dict[str, Exception]) -> None:
        self.node, self.manager, self.done, self.fails = node, manager, done, fails

    def bring_to(self, state: int) -> None:
        for transition in {UNCONFIGURED: [], INACTIVE: [CONFIGURE], ACTIVE: [CONFIGURE, ACTIVATE]}[state]:
            assert self.manager.change(transition)

    def bonded(self) -> Sister:
        """Bring it up; the manager's end of its bond."""
        self.bring_to(ACTIVE)
        assert self.manager.bond is not None
        return self.manager.bond


@contextmanager
def managed() -> Iterator[Stage]:
    from racecar.pipelines.live.managed_node import ManagedNode
    from racecar.pipelines.live.ros.run import ros_node, served

    done: list[str] = []
    fails: dict[str, Exception] = {}

    def create(node: Any, _is_first: bool) -> Any:
        return Work(node, done, fails)

    arguments = ["--ros-args", "-p", "use_lifecycle_manager:=true"]
    with (
        ros_node(NAME, arguments, lambda name: ManagedNode(name, create)) as node,
        served(node),
        manager_of(NAME) as manager,
    ):
        node.bring_up()
        yield Stage(node, manager, done, fails)


@pytest.mark.slow
def test_it_goes_through_all_states() -> None:
    with managed() as stage:
        manager = stage.manager
        assert manager.state == UNCONFIGURED
        for _ in range(2):
            assert manager.startup()
            assert manager.change(DEACTIVATE)
            assert manager.change(ACTIVATE)
            assert manager.reset()
            assert stage.node.live is None
        assert manager.startup()
        assert manager.shutdown()
        assert manager.state == FINALIZED
    once = ["create", "start", "stop", "renew", "create"]
    again = ["start", "stop", "renew", "create"]
    assert stage.done == [*once, *again, *once, *again, *once]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("before", "transition", "failing", "after"),
    [
        (UNCONFIGURED, CONFIGURE, "create", UNCONFIGURED),
        (INACTIVE, ACTIVATE, "start", UNCONFIGURED),
        (ACTIVE, DEACTIVATE, "stop", UNCONFIGURED),
        (ACTIVE, DEACTIVATE, "renew", UNCONFIGURED),
        (INACTIVE, _INACTIVE_SHUTDOWN, "stop", FINALIZED),
        (ACTIVE, _ACTIVE_SHUTDOWN, "stop", FINALIZED),
    ],
)
@pytest.mark.parametrize("error", [UserError("The disk is full."), ValueError("oops")])
def test_errors_end_in_the_state_that_ros_prescribes(
    before: int, transition: int, failing: str, after: int, error: Exception, capfd: Any
) -> None:
    with managed() as stage:
        stage.bring_to(before)
        stage.fails[failing] = error
        assert not stage.manager.change(transition)
        assert stage.manager.state == after
        subscribers = stage.node.count_subscribers("/told")
        assert subscribers == (after == INACTIVE)
        if after == UNCONFIGURED:
            assert stage.node.live is None
            assert stage.manager.startup()
    (warning,) = re.findall(r"\[WARN\].*", capfd.readouterr().err)
    assert str(error) in warning


@pytest.mark.slow
@pytest.mark.parametrize(
    ("state", "transition"), [(UNCONFIGURED, ACTIVATE), (INACTIVE, CONFIGURE), (ACTIVE, CLEANUP)]
)
def test_a_transition_that_there_is_not_is_refused(state: int, transition: int, capfd: Any) -> None:
    with managed() as stage:
        stage.bring_to(state)
        assert not stage.manager.change(transition)
        assert stage.manager.state == state
    (warning,) = [line for line in re.findall(r"\[WARN\].*", capfd.readouterr().err) if NAME in line]
    assert "does not lead on" in warning


@pytest.mark.slow
def test_a_deactivated_node_breaks_its_bond_and_forms_another() -> None:
    with managed() as stage:
        manager, bond = stage.manager, stage.bonded()
        manager.bond = None  # so that it still listens
        assert manager.change(DEACTIVATE)
        assert bond.is_broken_within(10.0)
        assert manager.change(ACTIVATE)
        assert manager.bond is not None
        managers = {manager.bond.instance}  # the old end hears the new one, too
        assert bond.comes_true(lambda: len({each for _, each, _ in bond.heard} - managers) == 2, 10.0)


@pytest.mark.slow
def test_a_node_whose_manager_breaks_the_bond_agrees_and_stays_active() -> None:
    with managed() as stage:
        manager, bond = stage.manager, stage.bonded()
        bond.fall_silent()
        bond.say(is_active=False)
        assert bond.is_broken_within(10.0)
        time.sleep(0.3)
        assert not bond.heard[-1][2], "no heartbeats any more"
        assert manager.state == ACTIVE
        assert manager.reset()
        assert manager.startup()


@pytest.mark.slow
def test_a_node_that_ends_breaks_its_bond() -> None:
    with managed() as stage:
        bond = stage.bonded()
        stage.node.end()
        assert bond.is_broken_within(10.0)


def test_by_itself_a_node_is_active_at_once_and_needs_no_bond(tmp_path: Path) -> None:
    from racecar.pipelines.live.managed_node import ManagedNode
    from racecar.pipelines.live.ros.run import ros_node, served

    done: list[str] = []
    with ros_node(NAME, [], lambda name: ManagedNode(name, lambda node, _: Work(node, done, {}))) as node:  # type: ignore[arg-type,return-value]
        node.bring_up()
        with served(node), manager_of(NAME) as manager:
            assert manager.state == ACTIVE
            assert node.count_publishers("/bond") == 0
    assert done == ["create", "start"]


def test_a_destroyed_node_leaves_no_services() -> None:
    from racecar.pipelines.live.managed_node import ManagedNode
    from racecar.pipelines.live.ros.run import ros_node

    with ros_node("test_observer", []) as observer:
        node = ManagedNode(NAME, lambda node, _: Work(node, [], {}))  # type: ignore[arg-type,return-value]
        assert observer.count_services(f"/{NAME}/get_state") == 1
        node.destroy_node()
        assert observer.count_services(f"/{NAME}/get_state") == 0


def test_by_itself_a_node_that_cannot_be_configured_raises_why() -> None:
    from racecar.pipelines.live.managed_node import ManagedNode
    from racecar.pipelines.live.ros.run import ros_node

    def create(_node: Any, _is_first: bool) -> Any:
        raise UserError("There is no map.")

    with (
        ros_node(NAME, [], lambda name: ManagedNode(name, create)) as node,
        pytest.raises(UserError, match="There is no map"),
    ):
        node.bring_up()
