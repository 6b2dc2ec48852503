"""A sheet into a file, in the format that its name tells."""

from pathlib import Path

from rig.errors import ConfigError, OptionError
from rig.files import put_in_place
from rig.targets.printing.drawing import Drawing
from rig.targets.printing.pdf import pdf_of
from rig.targets.printing.png import png_of
from rig.targets.printing.svg import svg_of


def write_sheet(path: Path, drawing: Drawing, dots_per_in: float) -> None:
    """Write a sheet as PDF, SVG or PNG: there completely or not at all.

    Raises:
        ConfigError: another suffix, or the file cannot be written.
    """
    match path.suffix.lower():
        case ".pdf":
            data = pdf_of(drawing)
        case ".svg":
            data = svg_of(drawing)
        case ".png":
            data = png_of(drawing, dots_per_in)
        case other:
            raise OptionError(
                f"--out {path}: {other or 'no suffix'}", advice="use .pdf, .svg or .png"
            )
    try:
        put_in_place(path, data)
    except OSError as error:
        raise ConfigError(
            f"--out {path}: cannot be written: {error.strerror}", advice="choose another place"
        ) from error
