"""The XML form of OpenCV's FileStorage as the same plain values that its YAML gives."""

from pathlib import Path
from xml.etree import ElementTree

from rig.bounded_text import read_text
from rig.errors import FormatError
from rig.export.fields import Fields, mapping

_MATRIX = "opencv-matrix"
_MOST_BYTES = 1_000_000


def read_xml(path: Path) -> Fields:
    """Return the top-level fields; matrices are mappings with rows, cols and data.

    Raises:
        StoreError: it cannot be read.
        FormatError: it is no XML of OpenCV, or defines entities, which no such file does.
    """
    text = read_text(path, _MOST_BYTES)
    if "<!" in text.replace("<!--", ""):
        raise FormatError(
            f"{path}: defines entities or a document type",
            advice="give the file as OpenCV's FileStorage wrote it",
        )
    try:
        root = ElementTree.fromstring(text)  # noqa: S314 - without entities it only nests
    except ElementTree.ParseError as error:
        raise FormatError(
            f"{path}: is no XML: {error}", advice="give the file as written"
        ) from error
    if root.tag != "opencv_storage":
        raise FormatError(
            f"{path}: its root is {root.tag}, expected opencv_storage",
            advice="give a file of OpenCV's FileStorage",
        )
    try:
        return mapping(_value(root), str(path))
    except RecursionError as error:
        raise FormatError(f"{path}: is nested too deep") from error


def _value(node: ElementTree.Element) -> object:
    if node.get("type_id") == _MATRIX:
        fields = {child.tag: (child.text or "").split() for child in node}
        return {
            "rows": _scalar(" ".join(fields.get("rows", []))),
            "cols": _scalar(" ".join(fields.get("cols", []))),
            "data": [_scalar(word) for word in fields.get("data", [])],
        }
    children = list(node)
    if not children:
        return _scalar((node.text or "").strip())
    if all(child.tag == "_" for child in children):
        return [_value(child) for child in children]
    return {child.tag: _value(child) for child in children}


def _scalar(word: str) -> str | float:
    """A number where it is one; OpenCV quotes text that looks like a number."""
    try:
        return float(word)
    except ValueError:
        return word.strip('"')
