"""Frames from one root to another, each compared with its SHA-256 before and after.

Frames never change once they are stored, so a copy that was cut short goes on where it stopped.
"""

import os
import shutil
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from uuid import uuid4

from rig.database.scan_files import FACTS
from rig.database.upkeep import SampleFiles
from rig.disk import disk_explained
from rig.errors import StoreError
from rig.file_modes import FileModes
from rig.files import make_folder, put_on_disk, sync_folder
from rig.store.hashes import bad_files, digest
from rig.store.layout import PICTURES, album_folders, is_half_written, read_album

Progress = Callable[[int, str], None]


@dataclass(slots=True)
class Copied:
    """What a copy has come to."""

    files: int = 0
    """Images, and facts of scans, that are there now."""
    new: int = 0
    """Of these, how many were not there before."""
    bytes: int = 0
    """Of the new ones."""
    bad: list[str] = field(default_factory=list[str])
    """Images that are missing or damaged where they come from, one line each."""


class FrameCopy:
    """Copies folders of images below one root to below another.

    Args:
        source: root of all frames.
        target: another root; is there.
        modes: permission bits of what is made.
        progress: told how many folders are done.
        keeps_damaged: whether images that are damaged are taken along as they are.
    """

    def __init__(
        self,
        source: Path,
        target: Path,
        modes: FileModes,
        progress: Progress = lambda *_: None,
        *,
        keeps_damaged: bool = False,
    ) -> None:
        self._source, self._target, self._modes = source, target, modes
        self._keeps_damaged = keeps_damaged
        self._progress = progress
        self._folders = 0
        self.copied = Copied()

    def samples(self, samples: Iterable[SampleFiles]) -> None:
        """Copy the images of samples; those of pruned ones are no longer there.

        Raises:
            StoreError: they cannot be written, or came back otherwise.
        """
        sweeps: set[str] = set()
        for sample in samples:
            if not sample.is_pruned:
                self._folder(sample.folder, sample.sha256)
            sweeps.add("/".join(sample.folder.split("/")[:2]))
        for folder in sorted(sweeps):
            self._file(f"{folder}/report.html")

    def albums(self) -> None:
        """Copy the albums of all calibrations, with what their lists know.

        Raises:
            StoreError: they cannot be written, or came back otherwise.
        """
        for folder in album_folders(self._source):
            album, place = read_album(folder), folder.relative_to(self._source).as_posix()
            self.copied.bad += [f"{place}: {line}" for line in album.damaged]
            for picture, sha256 in album.pictures.items():
                self._folder(f"{place}/{picture}", sha256)
            with disk_explained("list", folder):
                others = [p.name for p in folder.iterdir() if p.is_file()]
            for name in sorted(others):
                if (
                    name != PICTURES
                    and not name.startswith(".")
                    and not is_half_written(folder / name)
                ):
                    self._file(f"{place}/{name}")
            self._file(f"{place}/{PICTURES}")

    def _folder(self, place: str, sha256: Mapping[str, str]) -> None:
        source, target = self._source / place, self._target / place
        sha256 = _with_facts(source, sha256)
        self._folders += 1
        self._progress(self._folders, place)
        self.copied.files += len(sha256)
        if target.is_dir():
            if not bad_files(target, sha256):
                return
            with disk_explained("copy frames", target):
                shutil.rmtree(target)
        beside = target.with_name(f".{target.name}.{uuid4().hex}.tmp")
        with disk_explained("copy frames", target):
            make_folder(beside, self._modes.folder)
            try:
                self._images(source, beside, place, sha256)
                sync_folder(beside)
                beside.rename(target)
                sync_folder(target.parent)
            finally:
                shutil.rmtree(beside, ignore_errors=True)

    def _images(self, source: Path, beside: Path, place: str, sha256: Mapping[str, str]) -> None:
        bad = bad_files(source, sha256)
        self.copied.bad += [f"{place}/{name}: {wrong}" for name, wrong in bad.items()]
        self.copied.files -= len(bad)
        written: dict[str, str] = {}
        for name in sha256:
            if name in bad and not (self._keeps_damaged and (source / name).is_file()):
                continue
            content = (source / name).read_bytes()
            written[name] = digest(content)
            with (beside / name).open("wb") as file:
                (beside / name).chmod(self._modes.file)
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            self.copied.bytes += len(content)
        self.copied.new += len(written)
        lost = bad_files(beside, written)
        if lost:
            name, wrong = next(iter(lost.items()))
            raise StoreError(
                f"{self._target / place / name}: the copy is {wrong}",
                advice="the disk that is written to may be failing: choose another",
            )

    def _file(self, place: str) -> None:
        """Copy a file that may have changed since; none where there is none."""
        source, target = self._source / place, self._target / place
        with disk_explained("copy", target):
            if not source.is_file():
                return
            content = source.read_bytes()
            if target.is_file() and digest(target.read_bytes()) == digest(content):
                return
            make_folder(target.parent, self._modes.folder)
            put_on_disk(target, content, self._modes.file)


def _with_facts(source: Path, sha256: Mapping[str, str]) -> Mapping[str, str]:
    """Add what is known of a scan, where the images of a folder are one: no row has its hash."""
    facts = source / FACTS
    with disk_explained("read a scan", facts):
        return {**sha256, FACTS: digest(facts.read_bytes())} if facts.is_file() else sha256
