"""Sections of a profile whose `kind` selects their model, also from other people's packages."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Union

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, TypeAdapter, ValidationError
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, InitErrorDetails, PydanticCustomError, core_schema

from rig.errors import ConfigError
from rig.profile.cameras import CameraConfig
from rig.profile.model import Model
from rig.profile.plugins import CAMERAS, STAGES, Door
from rig.profile.stages import StageConfig


@dataclass(frozen=True, slots=True, eq=False)  # the same by identity, as annotations are hashed
class _ByKind:
    """Validates a section as what its `kind` says; only that kind is loaded."""

    door: Door[Any]
    without: tuple[str, ...] = ()
    """Kinds that may not stand here: those that hold such a section themselves."""

    def validated(self, section: object) -> Model:
        if isinstance(section, self.door.base):
            return section
        if not isinstance(section, Mapping):
            raise PydanticCustomError("no_table", "must be a table with a kind")
        kind = section.get("kind")
        if not isinstance(kind, str):
            names = ", ".join(self.door.table)
            raise _at_kind(section, "kind_missing", f"missing; one of: {names}, or of a plug-in")
        if kind in self.without:
            raise _at_kind(section, "kind_unknown", f"a {kind} cannot stand within another camera")
        try:
            config: type[Model] = self.door.kind(kind).config
        except ConfigError as error:
            raise _at_kind(section, "kind_unknown", str(error)) from error
        return config.model_validate(section)

    def __get_pydantic_core_schema__(
        self, source: object, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            self.validated, serialization=core_schema.simple_ser_schema("any")
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        configs = tuple(kind.config for kind in self.door.kinds() if kind.name not in self.without)
        union: Any = Annotated[Union[configs], Field(discriminator="kind")]  # noqa: UP007
        return handler(TypeAdapter(union).core_schema)


def _at_kind(section: Mapping[Any, Any], error: str, text: str) -> ValidationError:
    told = PydanticCustomError(error, "{text}", {"text": text})  # pyright: ignore[reportArgumentType]
    details = InitErrorDetails(type=told, loc=("kind",), input=section.get("kind", section))
    return ValidationError.from_exception_data("section", [details])


def config_of(section: object, base: type[Model]) -> type[Model]:
    """Return the model of a section whose kind may be wrong or missing, then that of all kinds.

    Args:
        section: as it stands in the file.
        base: `CameraConfig` or `StageConfig`.
    """
    door: Door[Any] = CAMERAS if base is CameraConfig else STAGES
    kind = section.get("kind") if isinstance(section, Mapping) else None
    if not isinstance(kind, str):
        return base
    try:
        return door.kind(kind).config
    except ConfigError:
        return base


CameraSection = Annotated[CameraConfig, _ByKind(CAMERAS)]
InnerCameraSection = Annotated[CameraConfig, _ByKind(CAMERAS, without=("scan", "lenslet"))]
"""A camera that another one holds."""
StageSection = Annotated[StageConfig, _ByKind(STAGES)]
