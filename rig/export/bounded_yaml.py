"""YAML of other programs, read within bounds: a small file can ask for days and for gigabytes."""

from typing import Any

import yaml
from yaml.composer import ComposerError
from yaml.constructor import ConstructorError

_DEEPEST = 40
"""Nested lists and mappings; calibrations have five."""
_MOST_NODES = 10_000
"""Values; a calibration of forty cameras has two thousand. Each takes some 0.1 ms and 1 kB."""
_LONGEST_NUMBER = 400
"""Characters; a double needs less than 30."""


class BoundedLoader(yaml.SafeLoader):
    """Builds plain values only: no tags, no merges, no numbers with colons, nothing deep."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._depth = 0
        self._nodes = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Count how deep it is."""
        self._depth += 1
        self._nodes += 1
        if self._nodes > _MOST_NODES:
            mark = self.peek_event().start_mark
            raise ComposerError(None, None, f"more than {_MOST_NODES} values", mark)
        if self._depth > _DEEPEST:
            mark = self.peek_event().start_mark
            raise ComposerError(None, None, f"more than {_DEEPEST} levels deep", mark)
        try:
            return super().compose_node(parent, index)
        finally:
            self._depth -= 1

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        """Refuse merges: ten lines of them make a thousand million entries."""
        for key, _ in node.value:
            if key.tag == "tag:yaml.org,2002:merge":
                raise ConstructorError(None, None, "merge keys (<<) are not read", key.start_mark)

    def construct_number(self, node: yaml.ScalarNode) -> int | float:
        """A number as people write them; base 60, which YAML 1.1 knows, is none."""
        written = str(node.value)
        if ":" in written or len(written) > _LONGEST_NUMBER:
            shown = written if len(written) < 30 else f"{written[:20]}... of {len(written)} signs"
            raise ConstructorError(None, None, f"{shown} is no number", node.start_mark)
        is_whole = node.tag == "tag:yaml.org,2002:int"
        return self.construct_yaml_int(node) if is_whole else self.construct_yaml_float(node)


for _kind in ("int", "float"):
    BoundedLoader.add_constructor(f"tag:yaml.org,2002:{_kind}", BoundedLoader.construct_number)
