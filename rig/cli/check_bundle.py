"""What goes into the bundle of `rig check --bundle`, and what is said of it."""

import json
import os
import platform
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rig.check.bundle import require_new, write_bundle
from rig.cli.devices import as_dict as devices_as_dict
from rig.cli.history import newest_as_dict
from rig.cli.next_verb import tell_next
from rig.cli.output import show, show_json, tell
from rig.errors import RigError
from rig.secrets import HIDDEN, value_without_secrets

if TYPE_CHECKING:
    from rig.database import Store
    from rig.profile import Profile
    from rig.records import HistoryRow

RECENT = 20
"""Newest sweeps and calibrations of a bundle."""
_SEARCH_S = 1.6
"""As `rig devices`."""
_LARGEST = 20_000_000
"""Bytes of a report; one of a usual sweep has a tenth."""
REPORT = "report.html"


@dataclass(frozen=True, slots=True)
class Packed:
    """A bundle that was written, or none."""

    file: Path | None = None
    inside: Mapping[str, int] = field(default_factory=dict[str, int])
    """Bytes by name."""

    def show(self) -> None:
        """Say what it holds."""
        if self.file is None:
            return
        named = ", ".join(f"{name} ({size} bytes)" for name, size in self.inside.items())
        show(f"bundle {self.file}: {named}")
        show("passwords, users in addresses and your folder are left out; look before you send it")

    def as_dict(self) -> dict[str, object]:
        """Return what programs are told; nothing where there is none."""
        if self.file is None:
            return {}
        return {"bundle": {"file": str(self.file), "inside": dict(self.inside)}}


class Bundle:
    """What is gathered for a bundle while a check runs.

    Args:
        file: new; None where no bundle is wanted.
        database: URL, as for every verb.

    Raises:
        StoreError: the file is there already, or its folder is not.
    """

    def __init__(self, file: Path | None, database: str | None) -> None:
        if file is not None:
            require_new(file)
        self._file, self._database = file, database
        self.profile: Profile | None = None
        self.log: list[str] = []
        """Of the check, line by line."""

    @contextmanager
    def written_if_it_fails(self) -> Generator[None]:
        """Write it where an error ends this block: then it is wanted most."""
        try:
            yield
        except RigError as error:
            self.log.append(f"rig: {error}")
            if (file := self.written().file) is not None:
                tell(f"rig: the bundle {file} is written all the same")
            raise

    def write_alone(self, *, as_json: bool) -> None:
        """Write it without a check.

        Raises:
            StoreError: it cannot be written.
        """
        if self._file is None:
            raise typer.BadParameter("name a PROFILE; without one there is only --bundle FILE.zip")
        self.log.append("nothing was checked: no profile was named")
        packed = self.written()
        if as_json:
            show_json(packed.as_dict())
        else:
            packed.show()
        tell_next("check, bundle", as_json=as_json)

    def written(self) -> Packed:
        """Write it, where one is wanted.

        Raises:
            StoreError: it cannot be written.
        """
        if self._file is None:
            return Packed()
        return Packed(self._file, write_bundle(self._file, self._texts()))

    def _texts(self) -> dict[str, str]:
        texts = {"check.txt": "\n".join([*self.log, ""]), "versions.json": _json(_versions)}
        profile, report = self.profile, list[str]()
        if profile is not None:
            texts["profile.json"] = _json(lambda: profile.model_dump(mode="json"))
        rig = None if profile is None else profile.name
        texts["devices.json"] = _json(_devices)
        texts["history.json"] = _json(lambda: _history(self._database, rig, report))
        return texts | ({REPORT: report[0]} if report else {})


def _json(look: Callable[[], object]) -> str:
    try:
        content = look()
    except RigError as error:
        content = {"not known": str(error)}
    shown = value_without_secrets(content)
    return json.dumps(shown, indent=2, ensure_ascii=False, default=str) + "\n"


def _versions() -> object:
    from rig.compute.cores import threads
    from rig.database.provenance import software_versions

    variables = {name: value for name, value in os.environ.items() if name.startswith("RIG_")}
    return {
        **software_versions(),
        "machine": platform.machine(),
        "threads": threads(),
        "variables": variables,
    }


def _devices() -> object:
    from rig.hardware import find

    found = {findings.kind: devices_as_dict(findings) for findings in find.find_devices(_SEARCH_S)}
    return {**found, "broken_plugins": list(find.broken_plugins())}


def _history(database: str | None, rig: str | None, report: list[str]) -> object:
    """Return the newest rows; the report of the newest sweep that has one is added to a list."""
    from rig.database import open_store

    with open_store(database, absent="empty") as store:
        found = store.history(store.frames)
        sweeps = [row for row in found.sweeps if rig in (None, row.rig)][-RECENT:]
        report += _newest_report(store, sweeps)
        content = newest_as_dict(found, store.database, rig, RECENT)
        owners = {what: str(owner) for what, owner in store.owners().items()}
    for rows in (content["sweeps"], content["calibrations"]):
        for row in rows if isinstance(rows, list) else ():
            row["user"] = HIDDEN
    return {**content, "at_work": owners}


def _newest_report(store: "Store", sweeps: Sequence["HistoryRow"]) -> list[str]:
    for row in reversed(sweeps):
        file = store.sweep(row.id).folder / REPORT
        try:
            if file.is_file() and not file.is_symlink() and file.stat().st_size <= _LARGEST:
                return [file.read_text(encoding="utf-8", errors="replace")]
        except OSError:  # it went away meanwhile, or may not be read: an older one may
            continue
    return []
