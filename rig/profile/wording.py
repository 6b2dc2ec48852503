"""What is wrong with a value, in words of a profile and not in those of the validating library."""

from collections.abc import Mapping, Sequence

from pydantic_core import ErrorDetails

_NEEDS = {
    "model_type": "needs a section of keys and values",
    "model_attributes_type": "needs a section of keys and values",
    "dict_type": "needs a section of keys and values",
    "list_type": "needs a list",
    "tuple_type": "needs a list",
    "too_short": "needs a list of {min_length} or more",
    "too_long": "takes at most {max_length} entries",
    "int_type": "needs a whole number",
    "int_parsing": "needs a whole number",
    "int_from_float": "needs a whole number",
    "int_parsing_size": "needs a whole number of fewer digits",
    "float_type": "needs a number",
    "float_parsing": "needs a number",
    "finite_number": "needs a finite number",
    "greater_than": "must be above {gt}",
    "greater_than_equal": "must be at least {ge}",
    "less_than": "must be below {lt}",
    "less_than_equal": "must be at most {le}",
    "bool_type": "needs true or false",
    "bool_parsing": "needs true or false",
    "string_type": "needs text",
    "string_unicode": "needs text in UTF-8",
    "string_too_short": "needs text of at least {min_length} characters",
    "string_too_long": "needs text of at most {max_length} characters",
    "string_pattern_mismatch": "needs text of the form {pattern}",
    "literal_error": "must be {expected}",
    "enum": "must be {expected}",
    "choice": "needs {choice}",
    "union_tag_invalid": "is of no known kind; there are: {expected_tags}",
    "union_tag_not_found": "needs a kind",
}
_CHOICES = {"bool": "true or false", "int": "a whole number", "float": "a number", "str": "text"}
"""Where a value may be of several plain types, the path ends with the name of the type tried."""
_OWN = {"no_table", "kind_missing", "kind_unknown"}
"""Refusals of ours, which have their words already."""
_SHOWN = 60


def wording(item: ErrorDetails) -> str:
    """Return what is wrong, with what was found."""
    context = item.get("ctx", {})
    if item["type"] == "value_error":
        return str(context["error"])
    if item["type"] in _OWN:
        return item["msg"]
    needs = _NEEDS.get(item["type"], "cannot be used").format_map(context)
    return f"{needs}, found {_found(item['input'])}"


def merged(errors: Sequence[ErrorDetails]) -> list[ErrorDetails]:
    """Make one error of those that a value of several possible types is refused with."""
    tried: dict[tuple[int | str, ...], list[ErrorDetails]] = {}
    for item in errors:
        tried.setdefault(item["loc"][:-1] if _names_type(item) else item["loc"], []).append(item)
    kept: list[ErrorDetails] = []
    for place, items in tried.items():
        if len(items) > 1 and all(map(_names_type, items)):
            types = [_CHOICES[str(item["loc"][-1])] for item in items]
            needs = f"{', '.join(types[:-1])} or {types[-1]}"
            kept.append({**items[0], "loc": place, "type": "choice", "ctx": {"choice": needs}})
        else:
            kept += items
    return kept


def _names_type(item: ErrorDetails) -> bool:
    return (
        bool(item["loc"])
        and item["type"].endswith(("_type", "_parsing"))
        and item["loc"][-1] in _CHOICES
    )


def _found(value: object) -> str:
    match value:
        case bool():
            return str(value).lower()
        case str() | int() | float():
            shown = repr(value)
            return shown if len(shown) <= _SHOWN else f"{shown[:_SHOWN]}..."
        case Mapping():
            return f"a section of {len(value)} keys"
        case list() | tuple():
            return f"a list of {len(value)}"
        case None:
            return "nothing"
        case _:
            return f"a {type(value).__name__}"
