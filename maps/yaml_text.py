"""Parse untrusted YAML with limits, and give one plain reason when it is rejected.

PyYAML's safe loader builds only plain values. But it recurses as deep as the text does, keeps the last of two
equal keys, and lets a few lines of aliases expand to more values than fit in memory ("billion laughs"). Its
constructors raise arbitrary errors: ValueError for the 99th month, IndexError for an empty number.
"""

from typing import Any

import yaml
from yaml.nodes import MappingNode, Node, ScalarNode

MOST_BYTES = 200_000
"""Size limit of a hand-written text, since all settings with their comments take two thirds of it."""
_DEEPEST = 40
"""Levels of nesting, because settings have four and the parser recurses."""
_MOST_NODES = 100_000
"""Values, aliases counted at every use, because a text of `MOST_BYTES` holds half as many."""


class UnreadableYamlError(ValueError):
    """Why a YAML text is rejected: a clause that follows "because"."""


def parse_yaml(text: str) -> Any:
    """Parse a YAML text. Raises UnreadableYamlError."""
    loader = None
    try:
        loader = _LimitedLoader(text)
        return loader.get_single_data()
    except UnreadableYamlError:
        raise
    except yaml.MarkedYAMLError as error:
        line = f"line {error.problem_mark.line + 1}" if error.problem_mark else "it"
        raise UnreadableYamlError(f"{line} is not valid YAML ({_one_line(error.problem)})") from error
    except yaml.YAMLError as error:
        raise UnreadableYamlError("it is not a YAML text file") from error
    except Exception as error:  # PyYAML's constructors raise arbitrary exceptions.
        line = f"line {loader.line_at_work + 1}" if loader else "it"
        reason = f" ({_one_line(error)})" if isinstance(error, ValueError) else ""
        raise UnreadableYamlError(f"{line} holds a value that cannot be read{reason}") from error


class _LimitedLoader(yaml.SafeLoader):
    """A safe loader that limits the number of values and the depth, and rejects repeated keys."""

    def __init__(self, text: str) -> None:
        self.line_at_work = 0
        self._depth = self._nodes = 0
        self._nodes_of_anchor: dict[str, int] = {}
        super().__init__(text)

    def compose_node(self, parent: Node | None, index: Any) -> Node | None:
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        line = event.start_mark.line + 1
        anchor = event.anchor
        before = self._nodes
        if self.check_event(yaml.AliasEvent):
            self._nodes += self._nodes_of_anchor.get(anchor, 0)
        self._nodes += 1
        if self._nodes > _MOST_NODES:
            raise UnreadableYamlError(f"line {line} stands for more values than a text of settings may hold")
        self._depth += 1
        if self._depth > _DEEPEST:
            raise UnreadableYamlError(f"line {line} is nested more than {_DEEPEST} levels deep")
        if anchor is not None and not isinstance(event, yaml.AliasEvent):
            self._nodes_of_anchor[anchor] = _MOST_NODES  # an alias inside its own anchor would be infinite
        node = super().compose_node(parent, index)
        self._depth -= 1
        if anchor is not None and not isinstance(event, yaml.AliasEvent):
            self._nodes_of_anchor[anchor] = self._nodes - before
        return node

    def compose_mapping_node(self, anchor: Any) -> MappingNode:
        node = super().compose_mapping_node(anchor)
        _refuse_repeated_keys(node)
        return node

    def construct_object(self, node: Node, deep: bool = False) -> Any:
        self.line_at_work = node.start_mark.line
        return super().construct_object(node, deep)


def _refuse_repeated_keys(node: MappingNode) -> None:
    seen: set[tuple[str, str]] = set()
    for key, _ in node.value:
        if not isinstance(key, ScalarNode):
            continue
        if (key.tag, key.value) in seen:
            line = key.start_mark.line + 1
            raise UnreadableYamlError(f"line {line} gives the key '{key.value}' a second time")
        seen.add((key.tag, key.value))


def _one_line(problem: object) -> str:
    words = " ".join(str(problem).split())
    return words if len(words) <= 120 else f"{words[:120]}..."
