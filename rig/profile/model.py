"""The common ground of all profile sections."""

from pydantic import BaseModel, ConfigDict


class Model(BaseModel):
    """Frozen, closed, and self-describing: field docstrings end up in the JSON Schema."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", use_attribute_docstrings=True, allow_inf_nan=False
    )
