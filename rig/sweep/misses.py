"""What keeps stops from a slope, one line per kind: twenty stops in the dark are one thing."""

import re
from collections.abc import Sequence

from rig.sweep.points import StopResult, place_of

_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.]*\d)")
_MOST_PLACES = 12


def misses(stops: Sequence[StopResult]) -> tuple[str, ...]:
    """Return one line for every kind of miss, with the stops that it concerns.

    Messages that differ in their numbers alone are of one kind; each number then becomes the span
    from its smallest to its largest.

    Args:
        stops: of a sweep, in the order of its plan.
    """
    kinds: dict[str, list[tuple[StopResult, str]]] = {}
    for stop in stops:
        if stop.problem is not None:
            why = stop.problem.removeprefix(f"{place_of(stop.stop)}: ")
            kinds.setdefault(_NUMBER.sub("#", why), []).append((stop, why))
    return tuple(_line(alike) for alike in kinds.values())


def _line(alike: Sequence[tuple[StopResult, str]]) -> str:
    (first, why), *others = alike
    if not others:
        return f"{place_of(first.stop)}: {why}"
    places = [f"{stop.stop.distance_mm:.1f} ({stop.stop.direction})" for stop, _ in alike]
    more = len(places) - _MOST_PLACES
    shown = ", ".join(places[:_MOST_PLACES]) + (f" and {more} more" if more > 0 else "")
    return f"{len(alike)} stops at {shown} mm: {_spans([text for _, text in alike])}"


def _spans(texts: Sequence[str]) -> str:
    """Return the text that all are, with spans where their numbers differ."""
    columns = [list(column) for column in zip(*map(_NUMBER.findall, texts), strict=True)]
    spans = iter(
        column[0]
        if len(set(column)) == 1
        else f"{min(column, key=float)} to {max(column, key=float)}"
        for column in columns
    )
    return _NUMBER.sub(lambda _: next(spans), texts[0])
