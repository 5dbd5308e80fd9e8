"""A share of a ROS node: what is created through it can be destroyed at once."""

from collections.abc import Callable
from typing import Any

_OPPOSITES = {
    "create_publisher": "destroy_publisher",
    "create_subscription": "destroy_subscription",
    "create_service": "destroy_service",
    "create_timer": "destroy_timer",
    "add_on_set_parameters_callback": "remove_on_set_parameters_callback",
}
_DESTROYING = frozenset(_OPPOSITES.values())
_CALLED_BACK = {"destroy_subscription", "destroy_timer"}


class NodeShare:
    """Stands for the node, and notes what is created on it."""

    def __init__(self, node: Any) -> None:
        self._node = node
        self._created: dict[Any, str] = {}
        """How to destroy what there is."""

    def __getattr__(self, name: str) -> Any:
        """That of the node; what creates and destroys is noted."""
        method = getattr(self._node, name)
        if name in _OPPOSITES:
            return self._creating(method, _OPPOSITES[name])
        return self._destroying(method) if name in _DESTROYING else method

    def destroy(self) -> None:
        """Destroy all that is left. What has arrived by then but waits in the executor is not handled."""
        for entity in [*self._created]:
            opposite = self._created.pop(entity)
            if opposite in _CALLED_BACK:
                entity.callback = _ignore
            getattr(self._node, opposite)(entity)

    def _creating(self, create: Callable[..., Any], opposite: str) -> Callable[..., Any]:
        def create_and_note(*arguments: Any, **named: Any) -> Any:
            entity = create(*arguments, **named)
            self._created[arguments[0] if entity is None else entity] = opposite
            return entity

        return create_and_note

    def _destroying(self, destroy: Callable[[Any], Any]) -> Callable[[Any], Any]:
        def forget_and_destroy(entity: Any) -> Any:
            self._created.pop(entity, None)
            return destroy(entity)

        return forget_and_destroy


def _ignore(_message: Any = None) -> None:
    pass
