"""Judgement of where a sweep goes: room on the disk, and a database that takes it."""

import os
import shutil
from pathlib import Path

from rig.check.items import Item, failed
from rig.check.span import plan_mm
from rig.database import open_store
from rig.database.location import locate
from rig.errors import ConfigError, StoreError
from rig.frames import MultiView
from rig.plan import even_distances_mm, plan_stops
from rig.profile import Profile

AMPLE = 2.0
"""Room for so many sweeps is enough."""
_MEGABYTE = 1e6


def judge_room(profile: Profile, url: str | None, multiview: MultiView) -> Item:
    """Judge the room for the frames of one sweep, taken as uncompressed.

    Args:
        profile: the rig, with a `[sweep]`.
        url: of the database; the frames are beside it, or in `RIG_FRAMES`.
        multiview: one of its multi-views.

    Raises:
        ConfigError: the profile has no `[sweep]`, or its distances make no plan.
    """
    needed_mb = _multiviews(profile) * sum(f.image.nbytes for f in multiview.frames) / _MEGABYTE
    try:
        folder = locate(url, os.environ).frames
        existing = next(p for p in (folder, *folder.parents) if p.exists())
        free_mb = shutil.disk_usage(existing).free / _MEGABYTE
    except StoreError as error:
        return failed("disk", error)
    except OSError as error:
        return Item(
            "disk", "fail", f"free room is unknown: {error}", "choose another folder (--db)"
        )
    found = f"a sweep takes up to {needed_mb:,.0f} MB, {free_mb:,.0f} MB are free below {existing}"
    numbers = {"needed_mb": needed_mb, "free_mb": free_mb}
    if free_mb < needed_mb:
        advice = "free some room, or store elsewhere (--db, RIG_FRAMES)"
        return Item("disk", "fail", found, advice, numbers)
    if free_mb < AMPLE * needed_mb:
        return Item("disk", "warn", found, "there is room for one sweep only", numbers)
    return Item("disk", "pass", found, "", numbers)


def judge_database(url: str | None) -> Item:
    """Judge whether the database opens and its folder of frames takes a file."""
    try:
        with open_store(url, absent="empty") as store:
            folder = store.frames
            if not store.exists:
                return _judge_place(folder)
            sweeps = len(store.sweeps())
            probe = folder / f".check-{os.getpid()}"
            folder.mkdir(parents=True, exist_ok=True)
            probe.write_bytes(b"rig")
            probe.unlink()
            store.require_writable()
    except StoreError as error:
        return failed("database", error)
    except OSError as error:
        return Item(
            "database",
            "fail",
            f"frames cannot be written: {error}",
            "choose a folder that you may write to (--db, RIG_FRAMES)",
        )
    return Item("database", "pass", f"{sweeps} sweeps so far; it takes more, and frames as well")


def _judge_place(folder: Path) -> Item:
    """Judge where the first sweep would make a database; a check leaves nothing behind."""
    existing = next(path for path in folder.parents if path.exists())
    if existing.is_dir() and os.access(existing, os.W_OK | os.X_OK):
        return Item(
            "database", "pass", f"there is none yet; the first sweep makes it in {existing}"
        )
    return Item(
        "database",
        "fail",
        f"there is none yet, and none can be made in {existing}",
        "choose a folder that you may write to (--db, RIG_FRAMES)",
    )


def _multiviews(profile: Profile) -> int:
    """How many multi-views a sweep takes, the way back included."""
    config = profile.sweep
    if config is None:
        raise ConfigError(f"profile {profile.name}: has no [sweep]", advice="add it to the file")
    stops = plan_stops(
        even_distances_mm(config.from_mm, config.to_mm, config.count),
        holdout_every=config.holdout_every,
        backward_every=config.backward_every,
        travel_mm=plan_mm(profile),  # whether the stage reaches them is another item
        stage=profile.name,
    )
    return len(stops) * config.samples
