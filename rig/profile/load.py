"""Profiles from files: find, override, validate, and say plainly what is wrong."""

import difflib
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, cast, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from rig.errors import ConfigError
from rig.profile.by_kind import config_of
from rig.profile.cameras import CameraConfig
from rig.profile.models import Profile
from rig.profile.stages import StageConfig

_MOST_ERRORS_SHOWN = 3


def profile_folders() -> tuple[Path, ...]:
    """Return where profile names are looked up: the working folder first, then the shipped ones."""
    package = Path(__file__).resolve().parent.parent
    candidates = (Path.cwd(), package, package.parent)
    folders = (folder / "calib_profiles" for folder in candidates)
    return tuple(dict.fromkeys(folder.resolve() for folder in folders if folder.is_dir()))


def profile_files() -> Iterator[Path]:
    """Yield every profile that can be named; of two with one name only the first found."""
    seen: set[str] = set()
    for folder in profile_folders():
        for path in sorted(folder.glob("*.toml")):
            if path.stem not in seen:
                seen.add(path.stem)
                yield path


def find_profile(name_or_path: str) -> Path:
    """Return the file of a profile given by name or by path.

    Raises:
        ConfigError: there is no such file; the message names the nearest one.
    """
    path = Path(name_or_path).expanduser()
    if path.suffix == ".toml" or path.parent != Path():
        if path.is_file():
            return path
        raise ConfigError(f"profile {name_or_path}: no such file; `rig profile list` shows names")
    known = {file.stem: file for file in profile_files()}
    if name_or_path in known:
        return known[name_or_path]
    near = difflib.get_close_matches(name_or_path, known, n=1, cutoff=0.5)
    hint = f"did you mean {near[0]}?" if near else f"there are: {', '.join(sorted(known))}"
    raise ConfigError(f"profile {name_or_path}: not found in calib_profiles; {hint}")


def load_profile(name_or_path: str, overrides: Sequence[str] = ()) -> Profile:
    """Read, override and validate a profile.

    Args:
        name_or_path: a name in `calib_profiles` or a path to a TOML file.
        overrides: `key.path=value` each; the value is TOML, or else taken as plain text. A list
            entry is named by its `name` or its index: `views.left.x_steps=-1.02`.

    Raises:
        ConfigError: no such profile, not TOML, or not a profile; names file, key and nearest key.
    """
    path = find_profile(name_or_path)
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}") from error
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from error
    camera = data.get("camera")
    for key in _path_keys(camera):
        if isinstance(camera, dict) and isinstance(camera.get(key), str):
            camera[key] = str(path.resolve().parent / Path(camera[key]).expanduser())
    for override in overrides:
        _apply_override(data, override)
    return parse_profile(data, source=str(path))


def parse_profile(data: object, *, source: str) -> Profile:
    """Validate plain data as a profile; `source` names it in messages.

    Raises:
        ConfigError: see `load_profile`.
    """
    try:
        return Profile.model_validate(data)
    except ValidationError as error:
        errors = error.errors(include_url=False)
        shown = "; ".join(_describe(item, data) for item in errors[:_MOST_ERRORS_SHOWN])
        more = len(errors) - _MOST_ERRORS_SHOWN
        raise ConfigError(
            f"{source}: {shown}" + (f"; and {more} more" if more > 0 else "")
        ) from error


def _apply_override(data: dict[str, Any], override: str) -> None:
    key, equals, text = override.partition("=")
    parts = key.strip().split(".")
    if not equals or not all(parts):
        raise ConfigError(f"--set {override}: write it as key.path=value")
    node: Any = data
    for depth, part in enumerate(parts):
        index: Any = part
        if isinstance(node, list):
            index = _list_index(cast("list[Any]", node), part, ".".join(parts[:depth]), override)
        elif not isinstance(node, dict):
            raise ConfigError(f"--set {override}: {'.'.join(parts[:depth])} has no keys below it")
        elif depth < len(parts) - 1:
            node.setdefault(part, {})
        if depth == len(parts) - 1:
            node[index] = _toml_value(text.strip())
        else:
            node = node[index]


def _list_index(node: list[Any], part: str, where: str, override: str) -> int:
    names = [str(item.get("name", "")) if isinstance(item, dict) else "" for item in node]
    if part in names:
        return names.index(part)
    if part.isdigit() and int(part) < len(node):
        return int(part)
    known = ", ".join(name for name in names if name) or f"0..{len(node) - 1}"
    raise ConfigError(f"--set {override}: {where} has no {part}; there are: {known}")


def _toml_value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


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
    found = item.get("input")
    shown = f" (found {found!r})" if isinstance(found, int | float | str | bool) else ""
    message = item["msg"].removeprefix("Value error, ")
    return f"{key}: {message}{shown}" if key else message


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
    return get_args(field.annotation)[0] if field is not None else None
