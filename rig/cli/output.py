"""Where words go: results to stdout, everything else to stderr."""

import json
import math
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress

from rig.terminal_text import harmless, harmless_json, one_line


def show(text: str = "") -> None:
    """Print a line of the result."""
    sys.stdout.write(harmless(text) + "\n")


def tell(text: str) -> None:
    """Print a line about the run."""
    tell_raw(harmless(text) + "\n")


def tell_raw(text: str) -> None:
    """Write to stderr; a terminal that was closed meanwhile must not end a run."""
    with suppress(OSError):
        sys.stderr.write(text)
        sys.stderr.flush()


def show_json(value: Mapping[str, object]) -> None:
    """Print the one JSON object of a verb; NaN, which JSON does not have, becomes null."""
    show(harmless_json(json.dumps(_plain(value), indent=2, ensure_ascii=False)))


def _plain(value: object) -> object:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def table(rows: Sequence[Sequence[str]], header: Sequence[str]) -> list[str]:
    """Return aligned lines; columns that hold numbers only are aligned right."""
    rows = [[one_line(cell) for cell in row] for row in rows]
    columns = list(zip(*[header, *rows], strict=True))
    widths = [max(len(cell) for cell in column) for column in columns]
    numeric = [all(_is_number(cell) for cell in column[1:]) for column in columns]
    lines: list[str] = []
    for row in [header, *rows]:
        cells = [
            cell.rjust(width) if right else cell.ljust(width)
            for cell, width, right in zip(row, widths, numeric, strict=True)
        ]
        lines.append("  ".join(cells).rstrip())
    return lines


def _is_number(cell: str) -> bool:
    return cell == "" or cell.lstrip("+-").replace(".", "", 1).isdigit()
