"""Which frames of a capture are wanted, as a person writes it: `0,5-9`."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from rig.errors import ConfigError, StoreError
from rig.live.captured import CapturedFrame

_PART = re.compile(r"\s*([0-9]{1,9})(?:\s*-\s*([0-9]{1,9}))?\s*")


@dataclass(frozen=True, slots=True)
class FrameChoice:
    """Numbers of frames, as spans with both ends included."""

    spans: tuple[tuple[int, int], ...]

    @classmethod
    def parse(cls, text: str) -> "FrameChoice":
        """Read numbers and spans of them, e.g. `0,5-9`.

        Raises:
            ConfigError: it is none, or a span runs backward.
        """
        spans: list[tuple[int, int]] = []
        for part in text.split(","):
            found = _PART.fullmatch(part)
            if found is None:
                raise ConfigError(
                    f"frames {text!r}: found {part!r}, expected a number or a span",
                    advice="write them as 0,5-9",
                )
            first = int(found[1])
            last = first if found[2] is None else int(found[2])
            if last < first:
                raise ConfigError(
                    f"frames {text!r}: {part.strip()} runs backward",
                    advice=f"write {last}-{first}",
                )
            spans.append((first, last))
        return cls(tuple(spans))

    def of(self, frames: Iterator[CapturedFrame]) -> Iterator[CapturedFrame]:
        """Yield the frames that were chosen, in the order of the capture, each once.

        A span takes those of its numbers that were captured: a live capture drops some.

        Raises:
            StoreError: a number or a whole span names no frame; told after the last one.
        """
        missing = set(self.spans)
        indices: list[int] = []
        for frame in frames:
            indices.append(frame.index)
            within = {(first, last) for first, last in self.spans if first <= frame.index <= last}
            missing -= within
            if within:
                yield frame
        if missing:
            first, last = min(missing)
            asked = f"frame {first}" if first == last else f"frames {first}-{last}"
            there = f"{min(indices)}-{max(indices)}" if indices else "none"
            raise StoreError(
                f"asked for {asked} of a capture that has {there}",
                advice="choose others with --frames",
            )
