"""The steps from a new camera to depth, each with its verb, and which of them are behind us."""

import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import ConfigError, StoreError

if TYPE_CHECKING:
    from rig.database import Store
    from rig.profile import Profile

_PASSWORD = re.compile(r"//[^/@\s]*@")


@dataclass(frozen=True, slots=True)
class Step:
    """One verb on the way, and what shows that it is behind us."""

    name: str
    why: str
    """What it is good for, in one line."""
    words: tuple[str, ...]
    """The verb and its arguments, after `rig`."""
    found: str | None = None
    """What shows that it is done; None where nothing does."""
    afterwards: str | None = None
    """What a person does with its result, before the next step."""

    @property
    def command(self) -> str:
        """What a person types; a password in the database's address is left out."""
        return _PASSWORD.sub("//...@", shlex.join(("rig", *self.words)))


@dataclass(frozen=True, slots=True)
class Wish:
    """Whose set-up it is, and with what every verb is called."""

    profile_name: str
    overrides: tuple[str, ...] = ()
    database: str | None = None

    @property
    def set_options(self) -> tuple[str, ...]:
        """The overrides as options."""
        return tuple(word for override in self.overrides for word in ("--set", override))

    @property
    def run_options(self) -> tuple[str, ...]:
        """Overrides and database as options."""
        database = () if self.database is None else ("--db", self.database)
        return (*self.set_options, *database)


def steps_of(wish: Wish, folder: Path) -> tuple[Step, ...]:
    """Return all steps in order, as files and database show them now.

    What is behind a step that is done is done as well.

    Args:
        wish: whose set-up it is.
        folder: where the printed target goes.

    Raises:
        RigError: the profile is there and cannot be used, or the database cannot be read.
    """
    from rig.profile.load import find_profile, load_profile

    name = wish.profile_name
    try:
        path = find_profile(name)
    except ConfigError:
        return (
            Step("devices", "see what is plugged in, and what stands in its way", ("devices",)),
            Step("profile", "write a profile of it", ("profile", "new", name)),
        )
    profile = load_profile(name, wish.overrides)
    steps = [_profile_step(wish, profile, path), *_target_step(wish, profile, folder)]
    if len(profile.views) > 1:  # a check looks at what a sweep and a capture need
        steps.append(
            Step(
                "check",
                "look at everything that a run needs"
                + ("; clear the way of the carriage" if profile.stage is not None else ""),
                ("check", name, *wish.run_options),
            )
        )
    from rig.database import open_store

    with open_store(wish.database, absent="empty") as store:
        if profile.target is not None:
            steps.append(_calibrate_step(wish, profile, store))
        if profile.stage is not None and profile.sweep is not None:
            steps.append(_sweep_step(wish, profile, store))
    return _with_what_later_ones_show(steps)


def _profile_step(wish: Wish, profile: "Profile", path: Path) -> Step:
    from rig.profile.doubts import doubts

    step = Step(
        "profile",
        f"settle what {path} still guesses",
        ("profile", "check", wish.profile_name, *wish.set_options),
    )
    left = doubts(profile, path.read_text(encoding="utf-8"))
    return step if left else replace(step, found=str(path))


def _target_step(wish: Wish, profile: "Profile", folder: Path) -> tuple[Step, ...]:
    if profile.target is None:
        return ()
    sheet = folder / f"{profile.name}-target.pdf"
    step = Step(
        "target",
        "draw the board, where you have none",
        ("target", wish.profile_name, "--out", str(sheet), *wish.set_options),
        afterwards=f"Print {sheet} at 100 %, glue it onto something flat, and measure it across "
        "ten squares: target.square_mm of the profile.",
    )
    return (replace(step, found=str(sheet)) if sheet.exists() else step,)


def _calibrate_step(wish: Wish, profile: "Profile", store: "Store") -> Step:
    step = Step(
        "calibrate",
        "find lenses and places of all cameras, with the board in your hand",
        ("calibrate", wish.profile_name, *wish.run_options),
    )
    stored = store.active_calibration(profile.name)
    return step if stored is None else replace(step, found=f"calibration {stored.id}")


def _sweep_step(wish: Wish, profile: "Profile", store: "Store") -> Step:
    rows = [row for row in store.sweeps() if row.rig == profile.name]
    begun = [row for row in rows if row.state in ("taking", "taken")]
    resume = ("--resume", str(begun[-1].id)) if begun and begun[-1] is rows[-1] else ()
    step = Step(
        "sweep",
        "measure slope against distance",
        ("sweep", wish.profile_name, *resume, *wish.run_options),
    )
    try:
        return replace(step, found=f"curve {store.active_curve(profile.name).id}")
    except StoreError:  # none yet, or none that is good enough
        return step


def _with_what_later_ones_show(steps: Sequence[Step]) -> tuple[Step, ...]:
    shown: str | None = None
    seen: list[Step] = []
    for step in reversed(steps):
        shown = shown or step.found
        seen.append(replace(step, found=step.found or shown))
    return tuple(reversed(seen))
