"""Kinds of cameras and stages by name: ours from one table, other people's by entry points."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from importlib.metadata import EntryPoint, entry_points
from pkgutil import resolve_name
from typing import Any, Generic, TypeVar, cast, get_args

from rig.discovery import FoundDevice, Search
from rig.errors import ConfigError, DeviceNotFoundError, RigError
from rig.profile import builtin
from rig.profile.cameras import CameraConfig
from rig.profile.kinds import CONTRACT, CameraKind, StageKind
from rig.profile.model import Model
from rig.profile.stages import StageConfig

KindT = TypeVar("KindT", CameraKind[Any], StageKind[Any])


@dataclass(frozen=True, slots=True)
class Door(Generic[KindT]):
    """The way in for all kinds of one sort of device."""

    group: str
    """Name of the entry points: `rig.cameras` or `rig.stages`."""
    noun: str
    sort: type[KindT]
    base: type[Model]
    """What every config of the sort derives from."""
    table: Mapping[str, str]
    """Ours, by name: where each is described."""

    def kind(self, name: str) -> KindT:
        """Return a kind by its name.

        Raises:
            ConfigError: there is none, or the package that claims it cannot be used.
        """
        if name in self.table:
            return cast("KindT", resolve_name(self.table[name]))
        entries = self._entries()
        claims = [entry for entry in entries if entry.name == name]
        if claims:
            return self._plugged(claims[0], claims)
        names = sorted({*self.table, *(entry.name for entry in entries)})
        near = get_close_matches(name, names, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]}?" if near else "is its package installed?"
        raise ConfigError(
            f"there is no {self.noun} {name!r}, there are: {', '.join(names)}", advice=hint
        )

    def kinds(self) -> tuple[KindT, ...]:
        """Return every kind that can be used: ours in the order of the table, then the others."""
        return (*map(self.kind, self.table), *self._others()[0])

    def problems(self) -> tuple[str, ...]:
        """Return one line for every plug-in that cannot be used; it begins with its package."""
        return self._others()[1]

    def _others(self) -> tuple[tuple[KindT, ...], tuple[str, ...]]:
        entries = self._entries()
        good: list[KindT] = []
        problems: list[str] = []
        for entry in entries:
            try:
                good.append(self._plugged(entry, [e for e in entries if e.name == entry.name]))
            except ConfigError as error:
                problems.append(str(error))
        return tuple(good), tuple(problems)

    def _entries(self) -> Sequence[EntryPoint]:
        """The entry points of other packages; of a package found twice, as a path is, one."""
        found = {(_package(entry), entry.name): entry for entry in entry_points(group=self.group)}
        return [found[key] for key in sorted(found)]

    def _plugged(self, entry: EntryPoint, claims: Sequence[EntryPoint]) -> KindT:
        """Load one plug-in; whatever is wrong with it is one line that names its package.

        Raises:
            ConfigError: it cannot be used.
        """
        package, name = _package(entry), entry.name
        whose = f"{package}: its {self.noun} {name!r} cannot be used"
        if name in self.table:
            raise ConfigError(
                f"{whose}, rig has a {self.noun} of this name", advice="ask for another name"
            )
        if len(claims) > 1:
            others = ", ".join(p for p in map(_package, claims) if p != package)
            raise ConfigError(
                f"{whose}, {others} claims the name as well", advice="uninstall one of them"
            )
        try:
            kind: object = entry.load()
        except Exception as error:
            what = " ".join(f"{type(error).__name__}: {error}".split())
            raise ConfigError(
                f"{whose}, {what}", advice=f"mend, update or uninstall {package}"
            ) from error
        trouble = self._trouble_with(kind, name)
        if trouble is not None:
            raise ConfigError(f"{whose}, {trouble}", advice=f"update or uninstall {package}")
        good = cast("KindT", kind)
        if good.search is None:
            return good
        return replace(good, search=_guarded(good.search, package))

    def _trouble_with(self, kind: object, name: str) -> str | None:
        """Return why a value is no description of this kind; None where it is one."""
        contract = getattr(kind, "contract", None)
        if contract != CONTRACT:
            return (
                f"it is made for contract {contract}, this rig has contract {CONTRACT}: "
                "their versions do not fit each other"
            )
        if not isinstance(kind, self.sort):
            return f"the entry point gives a {type(kind).__name__}, not a {self.sort.__name__}"
        if kind.name != name:
            return f"it calls itself {kind.name!r}; entry point and kind must have one name"
        return _trouble_with_config(kind.config, self.base, name)


def _trouble_with_config(config: object, base: type[Model], name: str) -> str | None:
    if not (isinstance(config, type) and issubclass(config, base)):
        return f"its config is no {base.__name__}; derive it from that"
    if config.model_config.get("extra") != "forbid" or not config.model_config.get("frozen"):
        return f'its config is open; {config.__name__} needs extra="forbid" and frozen=True'
    if get_args(config.model_fields["kind"].annotation) != (name,):
        return f'{config.__name__}.kind must be Literal["{name}"]'
    return None


def _package(entry: EntryPoint) -> str:
    return "an unknown package" if entry.dist is None else entry.dist.name


def _guarded(search: Search, package: str) -> Search:
    """Let a search of somebody else fail with a note, whatever it raises."""

    def find(timeout_s: float) -> Sequence[FoundDevice]:
        try:
            return search.find(timeout_s)
        except RigError:
            raise
        except Exception as error:
            raise DeviceNotFoundError(
                package,
                f"its search failed, {type(error).__name__}: {error}",
                advice="mend or update it",
            ) from error

    guarded: Callable[[float], Sequence[FoundDevice]] = find
    return replace(search, find=guarded)


CAMERAS: Door[CameraKind[Any]] = Door(
    "rig.cameras", "camera", CameraKind, CameraConfig, builtin.CAMERAS
)
STAGES: Door[StageKind[Any]] = Door("rig.stages", "stage", StageKind, StageConfig, builtin.STAGES)
