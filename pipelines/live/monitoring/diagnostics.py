"""Publish a node's ``/diagnostics``, once a second."""

from collections.abc import Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue


class Diagnostics:
    """A single status: OK, or all faults, with figures."""

    def __init__(self, node: Any, name: str) -> None:
        self._node = node
        self._name = name
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 10)

    def publish(self, wrong: list[str], figures: Mapping[str, Any]) -> None:
        """Publish faults, which make the status a warning, and figures."""
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if wrong else DiagnosticStatus.OK,
            name=f"racecar: {self._name}",
            message=" ".join(wrong) or "fine",
            hardware_id="racecar",
            values=[KeyValue(key=key, value=_text(value)) for key, value in figures.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)


def _text(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
