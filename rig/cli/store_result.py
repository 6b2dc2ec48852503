"""What `rig store` tells programs and people."""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.store.manifest import Manifest
    from rig.store.prune import Prunable
    from rig.store.prune_albums import PrunableAlbum
    from rig.store.prune_captures import PrunableCapture
    from rig.store.repair import Repair
    from rig.store.usage import Usage
    from rig.store.verify import Finding, Inventory

_UNITS = ("bytes", "kB", "MB", "GB", "TB")
_STEP = 1000.0
MOST_SHOWN = 50
"""Lines of one kind; `--json` has all."""
DAMAGED = 3
"""Exit code."""


def size_in_words(size: int) -> str:
    """Return a number of bytes with the unit that suits it."""
    place = min((len(str(size)) - 1) // 3, len(_UNITS) - 1)
    return f"{size} {_UNITS[0]}" if place == 0 else f"{size / _STEP**place:.1f} {_UNITS[place]}"


def inventory_as_dict(found: "Inventory", done: "Repair | None") -> dict[str, object]:
    """Return what programs are told of `verify`."""
    mended = () if done is None else done.done
    return {
        "sweeps": found.sweeps,
        "samples": found.samples,
        "albums": found.albums,
        "files": found.files,
        "pruned": found.pruned,
        "at_work": list(found.at_work),
        "damaged": len(found.damage),
        "findings": [_finding(f) for f in found.findings if f not in mended],
        "repaired": [_finding(f) for f in mended],
        "refused": [] if done is None else list(done.refused),
        "aside": None if done is None or done.aside is None else str(done.aside),
    }


def _finding(finding: "Finding") -> dict[str, str]:
    return {"kind": finding.kind, "place": finding.place, "found": finding.found}


def manifest_as_dict(manifest: "Manifest", folder: Path) -> dict[str, object]:
    """Return what programs are told of a backup."""
    return {
        "folder": str(folder),
        "of": manifest.source,
        "made_at": manifest.made_at,
        "sweeps": manifest.sweeps,
        "samples": manifest.samples,
        "files": manifest.files,
    }


def prunable_as_dict(sweep: "Prunable") -> dict[str, object]:
    """Return what programs are told of a sweep whose images go."""
    return {
        "sweep": sweep.sweep_id,
        "rig": sweep.rig,
        "started_at": sweep.started_at.isoformat(),
        "verdict": sweep.verdict,
        "samples": sweep.samples,
        "bytes": sweep.bytes,
    }


def prunable_row(sweep: "Prunable") -> list[str]:
    """Return the same as cells of a table."""
    return [
        str(sweep.sweep_id),
        sweep.rig,
        f"{sweep.started_at.astimezone():%Y-%m-%d %H:%M %Z}",
        str(sweep.samples),
        f"{size_in_words(sweep.bytes)}, {sweep.verdict}",
    ]


def album_as_dict(album: "PrunableAlbum") -> dict[str, object]:
    """Return what programs are told of a calibration whose pictures go."""
    return {
        "calibration": album.calibration_id,
        "rig": album.rig,
        "made_at": album.made_at.isoformat(),
        "verdict": album.verdict,
        "folder": str(album.folder),
        "pictures": album.pictures,
        "bytes": album.bytes,
    }


def album_row(album: "PrunableAlbum") -> list[str]:
    """Return the same as cells of a table."""
    return [
        str(album.calibration_id),
        album.rig,
        f"{album.made_at.astimezone():%Y-%m-%d %H:%M %Z}",
        str(album.pictures),
        f"{size_in_words(album.bytes)}, {album.verdict}",
    ]


def capture_as_dict(capture: "PrunableCapture") -> dict[str, object]:
    """Return what programs are told of a capture that goes."""
    return {
        "folder": str(capture.folder),
        "rig": capture.rig,
        "begun_at": capture.begun_at.isoformat(),
        "bytes": capture.bytes,
    }


def capture_row(capture: "PrunableCapture") -> list[str]:
    """Return the same as cells of a table."""
    begun = f"{capture.begun_at.astimezone():%Y-%m-%d %H:%M %Z}"
    return [capture.folder.name, capture.rig, begun, size_in_words(capture.bytes)]


def usage_as_dict(found: "Usage") -> dict[str, object]:
    """Return what programs are told of `du`."""
    return {
        "database_bytes": found.database_bytes,
        "rigs": [
            {
                "rig": rig.rig,
                "sweeps": rig.sweeps,
                "sweeps_bytes": rig.sweeps_bytes,
                "albums": rig.albums,
                "albums_bytes": rig.albums_bytes,
                "other_bytes": rig.other_bytes,
            }
            for rig in found.rigs
        ],
        "orphans_bytes": found.orphans_bytes,
        "beside_bytes": dict(found.beside_bytes),
        "total_bytes": found.total_bytes,
    }
