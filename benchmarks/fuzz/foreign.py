"""Calibrations of other tools: valid files in each way that they are written, changed."""

import json
import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks.fuzz import mutate
from benchmarks.fuzz.foreign_ways import WAYS
from benchmarks.fuzz.geometry import known_geometry, lens_of, sized, some_of
from rig.export.formats import formats_of
from rig.export.geometry_format import export_geometry, geometry_format
from rig.export.geometry_import import into_one_view, match_views, read_foreign
from rig.geometry.rig_geometry import RigGeometry
from rig.profile import Profile
from rig.profile.load import load_profile
from tests.support.small_sim import SMALL_PAIR

Read = Callable[[], object]
Draw = Callable[[random.Random], Read]
FORMATS = formats_of("geometry")
_JSON = (".json",)
_YAML = (".yaml", ".yml")


@dataclass(frozen=True)
class Way:
    """One valid file or folder of a format."""

    place: Path
    content: Mapping[Path, bytes]

    def put(self) -> None:
        """Write all of its files, and take away what is there besides."""
        for file in self.place.parent.rglob("*"):
            if file.is_file() and file not in self.content:
                file.unlink()
        for file, content in self.content.items():
            file.write_bytes(content)


def imports(name: str) -> Callable[[Path], Draw]:
    """One of the formats of other tools."""

    def prepare(folder: Path) -> Draw:
        ways = list(_ways(name, folder))
        profiles = [load_profile("sim"), load_profile("sim", SMALL_PAIR)]
        others = [None, known_geometry(), sized(known_geometry(), 1280, 720)]

        def draw(rng: random.Random) -> Read:
            way = rng.choice(ways)
            way.put()
            place = _changed(rng, way)
            profile = rng.choice(profiles)
            chance = rng.random()
            said = name if chance < 0.8 else None
            if chance > 0.98:
                said = rng.choice([other for other in FORMATS if other != name])
            kept = rng.choice(others)
            names = _Names(rng.random(), rng.random())
            return lambda: _read(place, said, profile, names, kept)

        return draw

    return prepare


def _changed(rng: random.Random, way: Way) -> Path:
    """Change some of its files; returns the place that is read."""
    files = list(way.content)
    file = rng.choice(files)
    match rng.randrange(30):
        case 0 | 1:
            file.unlink()
        case 2:
            file.write_bytes(rng.choice(files).read_bytes())
        case 3:
            return file if way.place.is_dir() else way.place.parent
        case _:
            file.write_bytes(_other(rng, file, way.content[file]))
    return way.place


def _other(rng: random.Random, file: Path, valid: bytes) -> bytes:
    try:
        written = valid.decode()
    except UnicodeDecodeError:
        return mutate.raw(rng, valid)
    chance = rng.random()
    if chance < 0.02:
        return mutate.raw(rng, valid)
    if chance < 0.05:
        return mutate.many(rng, written).encode(errors="replace")
    if chance < 0.7 and (file.suffix in _JSON or written.startswith('{\n "')):
        return mutate.as_json(rng, json.loads(written)).encode(errors="replace")
    if chance < 0.6 and file.suffix in _YAML and not written.startswith("%YAML"):
        return mutate.as_yaml(rng, written).encode(errors="replace")
    if written.startswith("<?xml"):
        return mutate.xml(rng, written).encode(errors="replace")
    if chance < 0.3:
        return mutate.block(rng, written).encode(errors="replace")
    return mutate.text(rng, written).encode(errors="replace")


@dataclass(frozen=True)
class _Names:
    """Which views are named, drawn before the cameras of the file are known."""

    chance: float
    turn: float

    def of(self, cameras: Sequence[str], profile: Profile) -> dict[str, str]:
        """Return some, all, or none of the cameras by the names of views."""
        views = [view.name for view in profile.views]
        start = int(self.turn * len(cameras))
        turned = [*cameras[start:], *cameras[:start]]
        if self.chance < 0.5:
            return dict(zip(turned, views, strict=False))
        if self.chance < 0.6:
            return dict(zip(turned[:1], views[-1:], strict=False))
        return {"nobody": views[0]} if self.chance < 0.65 else {}


def _read(
    place: Path, said: str | None, profile: Profile, names: _Names, others: RigGeometry | None
) -> object:
    found = read_foreign(place, said)
    geometry = found.geometry
    view_of = names.of(geometry.names, profile)
    if len(geometry.names) == 1:
        return into_one_view(geometry, profile, view_of, others)
    return match_views(geometry, profile, view_of)


def _ways(name: str, folder: Path) -> Sequence[Way]:
    """Write every rig in every way of a format."""
    five = known_geometry()
    rigs = [five, some_of(five, 2), some_of(five, 1)]
    rigs += [lens_of(some_of(five, 2), lens) for lens in ("none", "fisheye", "brown8")]
    rigs.append(sized(rigs[2], 320, 200))
    held = geometry_format(name)
    found: list[Way] = []
    for number, rig in enumerate(rigs):
        made = folder / f"rig{number}"
        made.mkdir(parents=True)
        if held.write is not None:
            path = export_geometry(_called(name, rig), held, made, may_refit=True).path
            found.append(_way(path if path.is_file() else made))
    for number, write in enumerate(WAYS.get(name, ())):
        made = folder / f"way{number}"
        made.mkdir(parents=True)
        found.append(_way(write(five, made)))
    return found


def _called(name: str, rig: RigGeometry) -> RigGeometry:
    """DepthAI names cameras by their sockets."""
    if name != "depthai":
        return rig
    return replace(rig, names=tuple(f"CAM_{letter}" for letter in "ABCDE"[: len(rig.names)]))


def _way(place: Path) -> Way:
    folder = place if place.is_dir() else place.parent
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    return Way(place, {file: file.read_bytes() for file in files})
