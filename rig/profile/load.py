"""Profiles from files: find, override, validate, and say plainly what is wrong."""

import difflib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast, get_args

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from rig.bounded_text import parse_toml, read_text
from rig.errors import ConfigError, FormatError, OptionError, StoreError
from rig.places import profile_files
from rig.profile.by_kind import config_of
from rig.profile.cameras import CameraConfig
from rig.profile.models import Profile
from rig.profile.overrides import Override, apply_overrides, plain_path, read_override
from rig.profile.stages import StageConfig
from rig.profile.targets import TargetConfig
from rig.profile.wording import merged, wording

_MOST_ERRORS_SHOWN = 3
_TARGET: TypeAdapter[TargetConfig] = TypeAdapter(TargetConfig)


def find_profile(name_or_path: str) -> Path:
    """Return the file of a profile given by name or by path.

    Raises:
        ConfigError: there is no such file; the message names the nearest one.
    """
    path = Path(name_or_path).expanduser()
    if path.suffix == ".toml" or path.parent != Path():
        if path.is_file():
            return path
        raise ConfigError(
            f"profile {name_or_path}: no such file", advice="`rig profile list` shows names"
        )
    known = {file.stem: file for file in profile_files()}
    if name_or_path in known:
        return known[name_or_path]
    near = difflib.get_close_matches(name_or_path, known, n=1, cutoff=0.5)
    hint = f"did you mean {near[0]}?" if near else f"there are: {', '.join(sorted(known))}"
    raise ConfigError(f"profile {name_or_path}: not found in calib_profiles", advice=hint)


def load_profile(name_or_path: str, overrides: Sequence[str] = ()) -> Profile:
    """Read, override and validate a profile.

    Args:
        name_or_path: a name in `calib_profiles` or a path to a TOML file.
        overrides: `key.path=value` each; the value is TOML, or else taken as plain text. A list
            entry is named by its `name` or its index: `views.left.x_steps=-1.02`. A new `kind`
            replaces its section, of which those keys stay that the new kind knows as well.

    Raises:
        ConfigError: no such profile, not TOML, or not a profile; names file, key and nearest key.
        OptionError: an override makes no profile of a file that is one.
    """
    path = find_profile(name_or_path)
    data = _read(path)
    written = [read_override(text) for text in overrides]
    apply_overrides(data, written, _keys_of_kind)
    try:
        return Profile.model_validate(data)
    except ValidationError as error:
        errors = merged(error.errors(include_url=False))
        if written and _is_profile(path):
            raise OptionError(_told(_blamed(written, data, errors), errors, data)) from error
        raise ConfigError(_told(str(path), errors, data)) from error


def parse_profile(data: object, *, source: str) -> Profile:
    """Validate plain data as a profile; `source` names it in messages.

    Raises:
        ConfigError: see `load_profile`.
    """
    try:
        return Profile.model_validate(data)
    except ValidationError as error:
        errors = merged(error.errors(include_url=False))
        raise ConfigError(_told(source, errors, data)) from error


def parse_target(data: Mapping[str, object], *, source: str) -> TargetConfig:
    """Validate plain data as the `[target]` of a profile; `source` names it in messages.

    Raises:
        ConfigError: it is none; names key and value.
    """
    try:
        return _TARGET.validate_python(data)
    except ValidationError as error:
        errors = [{**item, "loc": ("target", *item["loc"])} for item in error.errors()]
        raise ConfigError(_told(source, cast("list[ErrorDetails]", errors), data)) from error


def _read(path: Path) -> dict[str, Any]:
    try:
        data = parse_toml(read_text(path))
    except (StoreError, FormatError) as error:
        raise ConfigError(error.found, advice=error.advice) from error
    except ValueError as error:
        raise ConfigError(f"{path}: not valid TOML: {error}", advice="correct this line") from error
    _start_at(path.resolve().parent, data.get("camera"))
    return data


def _start_at(folder: Path, camera: object) -> None:
    """Let relative paths of a camera, and of the one inside it, start at a folder."""
    if not isinstance(camera, dict):
        return
    for key in _path_keys(camera):
        if isinstance(camera.get(key), str):
            camera[key] = str(folder / Path(camera[key]).expanduser())
    _start_at(folder, camera.get("raw"))


def _told(source: str, errors: Sequence[ErrorDetails], data: object) -> str:
    """Say what is wrong, of `source`, the first few errors in full."""
    shown = "; ".join(_describe(item, data) for item in errors[:_MOST_ERRORS_SHOWN])
    more = len(errors) - _MOST_ERRORS_SHOWN
    return f"{source}: {shown}" + (f"; and {more} more" if more > 0 else "")


def _is_profile(path: Path) -> bool:
    """Whether the file is one without any override."""
    try:
        Profile.model_validate(_read(path))
    except ValidationError:
        return False
    return True


def _blamed(
    overrides: Sequence[Override], data: Mapping[str, Any], errors: Sequence[ErrorDetails]
) -> str:
    """Name the overrides at whose keys the errors are, or all of them where that is not clear."""
    places = [tuple(_walk(item["loc"], data)[1]) for item in errors]

    def is_at_fault(override: Override) -> bool:
        path = plain_path(data, override.path)
        return any(path[: len(p)] == p[: len(path)] for p in places if p)

    found = [override for override in overrides if is_at_fault(override)] or overrides
    return ", ".join(f"--set {override.text}" for override in found)


def _keys_of_kind(section: str, kind: str) -> Iterable[str] | None:
    """Return the keys of a section of this kind, None where there is no such kind."""
    field = Profile.model_fields.get(section)
    models = () if field is None else _models_in(field.annotation)
    for model in models:
        known = config_of({"kind": kind}, model) if model in (CameraConfig, StageConfig) else model
        if _kind(known) == kind:
            return known.model_fields
    return None


def _path_keys(camera: object) -> tuple[str, ...]:
    config = config_of(camera, CameraConfig)
    return config.path_keys if issubclass(config, CameraConfig) else ()


def _describe(item: ErrorDetails, data: object) -> str:
    location = item["loc"]
    model, path = _walk(location, data)
    key = ".".join(path)
    if item["type"] == "extra_forbidden":
        known = [] if model is None else list(model.model_fields)
        near = difflib.get_close_matches(path[-1], known, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]}?" if near else f"known here: {', '.join(known)}"
        return f"{key}: unknown key; {hint}"
    if item["type"] == "missing":
        return f"{key}: missing"
    return f"{key}: {wording(item)}" if key else wording(item)


def _walk(location: Sequence[int | str], data: object) -> tuple[type[BaseModel] | None, list[str]]:
    """Follow an error's location; return the model that holds its last key, and the plain path."""
    annotation: Any = Profile
    holder: type[BaseModel] | None = Profile
    path: list[str] = []
    for step in location:
        choices = list(_models_in(annotation))
        tagged = [m for m in choices if len(choices) > 1 and _kind(m) == step]
        if tagged:  # the tag of a discriminated union is not a key of the file
            annotation = tagged[0]
            continue
        holder = choices[0] if choices else None
        path.append(str(step))
        if holder is not None and isinstance(step, str) and step in holder.model_fields:
            annotation = holder.model_fields[step].annotation
            if holder is Profile:
                annotation = _section_model(annotation, step, data)
        elif holder is not None and not isinstance(step, int) and annotation is holder:
            annotation = None
    return holder, path


def _section_model(annotation: Any, key: str, data: object) -> Any:
    """Return the model that the `kind` of a section selects, where one does."""
    section = cast("dict[str, Any]", data).get(key) if isinstance(data, dict) else None
    for base in (CameraConfig, StageConfig):
        if base in _models_in(annotation):
            return config_of(section, base)
    return annotation


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    else:
        for argument in get_args(annotation):
            yield from _models_in(argument)


def _kind(model: type[BaseModel]) -> object:
    field = model.model_fields.get("kind")
    return next(iter(get_args(field.annotation)), None) if field is not None else None
