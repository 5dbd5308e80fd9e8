"""The life cycle of a node, from its start until it is stopped."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from racecar.maps.errors import UserError
from racecar.pipelines.runs.interrupts import StopRequest

_SWITCH_SECONDS = 0.0005
"""Seconds for which a thread may hold the interpreter while another waits, since Python's own 5 ms would be
added to the latency of poses."""


@contextmanager
def ros_node(
    name: str, ros_arguments: list[str], create: Callable[[str], Any] = rclpy.create_node
) -> Iterator[Any]:
    """Yield the ROS node that ``create`` makes of a name. Raises UserError when the arguments after
    ``--ros-args`` are invalid."""
    try:
        rclpy.init(args=ros_arguments, signal_handler_options=SignalHandlerOptions.NO)
        node = create(name)
    except Exception as error:  # rclpy's exceptions differ between distributions
        rclpy.try_shutdown()
        raise UserError(f"ROS does not start: {' '.join(str(error).split())}") from error
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def spin(node: Any, survive: Callable[[Exception], None], stop: StopRequest) -> None:
    """Run a node's callbacks until a stop is requested; a second Ctrl-C raises KeyboardInterrupt.

    Exceptions in callbacks are passed to ``survive``.
    """
    sys.setswitchinterval(_SWITCH_SECONDS)
    executor = _new_executor()
    executor.add_node(node)
    with stop.looked_for():
        try:
            while not stop.is_made and rclpy.ok():
                _serve(executor, survive)
        finally:
            executor.remove_node(node)
            executor.shutdown()


def _new_executor() -> Any:
    """The event-based executor if ROS has it, since it takes far less time than polling."""
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor()
    return EventsExecutor()


def _serve(executor: Any, survive: Callable[[Exception], None]) -> None:
    try:
        executor.spin_once(timeout_sec=0.2)
    except ExternalShutdownException:
        return
    except Exception as error:
        survive(error)


@contextmanager
def served(node: Any) -> Iterator[None]:
    """Run a node's callbacks in a thread within the block."""
    executor = _new_executor()
    executor.add_node(node)
    is_over = Event()

    def serve() -> None:
        while not is_over.is_set():
            executor.spin_once(timeout_sec=0.1)

    thread = Thread(target=serve, name="served", daemon=True)
    thread.start()
    try:
        yield
    finally:
        is_over.set()
        thread.join()
        executor.remove_node(node)
        executor.shutdown()


@contextmanager
def sister_node(node: Any, name: str) -> Iterator[Any]:
    """Yield a node in the namespace of another, with its own thread, so that its callbacks may wait without
    blocking others. It keeps its name if the other is renamed by ``-r __node:=``."""
    own_name = ["--ros-args", "-r", f"__node:={name}"]
    sister = rclpy.create_node(name, namespace=node.get_namespace(), cli_args=own_name)
    try:
        with served(sister):
            yield sister
    finally:
        sister.destroy_node()
