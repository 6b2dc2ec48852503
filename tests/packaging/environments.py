"""Wheels as a user installs them, in environments of their own; nothing is fetched."""

import importlib.metadata
import os
import re
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

ROOT = Path(__file__).resolve().parents[2]


def built_wheel(project: Path, folder: Path) -> Path:
    """Build the wheel of a project into a folder."""
    run([sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)], project)
    (wheel,) = folder.glob("*.whl")
    return wheel


def run(
    command: list[str], folder: Path, *, codes: tuple[int, ...] = (0,), **environment: str
) -> str:
    """Run a command in a folder and return what it printed; its failure is shown whole."""
    ended = subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": "", **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode in codes, f"{command}\n{ended.stdout}\n{ended.stderr}"
    return ended.stdout


def requirements(*names: str) -> set[str]:
    """Return distributions with all that they need, by their names on disk; no extras."""
    found: set[str] = set()
    todo = list(names)
    while todo:
        name = re.sub(r"[-_.]+", "-", todo.pop()).lower()
        if name in found:
            continue
        try:
            needed = importlib.metadata.requires(name) or ()
        except importlib.metadata.PackageNotFoundError:
            continue  # of another system or Python
        found.add(name)
        todo += [
            re.split(r"[^\w.-]", line, maxsplit=1)[0] for line in needed if "extra" not in line
        ]
    return found


class Environment:
    """A virtual environment with some wheels, and beside them only what is named.

    Args:
        folder: where it is made.
        wheels: installed into it.
        needs: distributions of this very environment that it may use too.
    """

    def __init__(self, folder: Path, wheels: list[Path], needs: set[str]) -> None:
        run([sys.executable, "-m", "venv", "--without-pip", str(folder)], folder.parent)
        self.bin = folder / "bin"
        (self.site,) = (folder / "lib").glob("python*/site-packages")
        shared = folder / "shared"
        shared.mkdir()
        for name in needs:
            self._share(importlib.metadata.distribution(name), shared)
        (self.site / "shared.pth").write_text(f"{shared}\n")
        for wheel in wheels:
            with ZipFile(wheel) as files:
                files.extractall(self.site)

    @staticmethod
    def _share(dist: importlib.metadata.Distribution, shared: Path) -> None:
        for file in dist.files or ():
            top = file.parts[0]
            link, target = shared / top, Path(str(dist.locate_file(top)))
            if top not in ("..", "__pycache__") and target.exists() and not link.exists():
                link.symlink_to(target)

    def python(self, *arguments: str, folder: Path) -> str:
        """Run Python in it."""
        return run([str(self.bin / "python"), *arguments], folder)

    def rig(self, *arguments: str, folder: Path, codes: tuple[int, ...] = (0,)) -> str:
        """Run `rig` in it, with a database in the folder."""
        command = "import sys; from rig.cli import main; sys.argv[0] = 'rig'; main()"
        return run(
            [str(self.bin / "python"), "-P", "-c", command, *arguments],
            folder,
            codes=codes,
            RIG_DATABASE=f"sqlite:///{folder}/rig.sqlite",
            PYTEST_ADDOPTS="",
        )
