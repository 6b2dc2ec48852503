"""A sheet as SVG 1.1, in mm."""

from xml.sax.saxutils import escape

from rig.targets.printing.drawing import Area, Drawing, Line


def svg_of(drawing: Drawing) -> bytes:
    """Return the file; the same sheet gives the same bytes."""
    width, height = f"{drawing.width_mm:g}", f"{drawing.height_mm:g}"
    return "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}mm" height="{height}mm" '
            f'viewBox="0 0 {width} {height}">',
            f"<title>{escape(drawing.title)}</title>",
            f'<rect width="{width}" height="{height}" fill="white"/>',
            *(_area(area) for area in drawing.areas),
            *(_line(line) for line in drawing.lines),
            "</svg>\n",
        ]
    ).encode("utf-8")


def _area(area: Area) -> str:
    path = "".join(
        f"M{r.x_mm:.6f} {r.y_mm:.6f}h{r.width_mm:.6f}v{r.height_mm:.6f}h{-r.width_mm:.6f}z"
        for r in area.rects
    )
    path += "".join(
        f"M{d.x_mm - d.radius_mm:.6f} {d.y_mm:.6f}"
        f"a{d.radius_mm:.6f} {d.radius_mm:.6f} 0 1 0 {2 * d.radius_mm:.6f} 0"
        f"a{d.radius_mm:.6f} {d.radius_mm:.6f} 0 1 0 {-2 * d.radius_mm:.6f} 0z"
        for d in area.discs
    )
    return f'<path fill="{area.ink}" d="{path}"/>'


def _line(line: Line) -> str:
    return (
        f'<text x="{line.x_mm:.4f}" y="{line.y_mm:.4f}" font-size="{line.height_mm:.4f}" '
        f'font-family="Helvetica, Arial, sans-serif">{escape(line.text)}</text>'
    )
