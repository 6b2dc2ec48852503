"""A sheet as PDF 1.4 (ISO 32000-1): one page of filled paths and text in Helvetica."""

from rig.targets.printing.drawing import Area, Disc, Drawing, Line

_POINTS_PER_MM = 72.0 / 25.4
_ARC = 0.5522847498
"""4 / 3 (sqrt 2 - 1): reach of the handles of a quarter of a circle, in radii."""


def pdf_of(drawing: Drawing) -> bytes:
    """Return the file; the same sheet gives the same bytes."""
    width, height = drawing.width_mm * _POINTS_PER_MM, drawing.height_mm * _POINTS_PER_MM
    # From mm with y down to points with y up, once for everything.
    scale = f"{_POINTS_PER_MM:.10g}"
    parts = [f"q {scale} 0 0 -{scale} 0 {height:.6f} cm"]
    parts += [_area(area) for area in drawing.areas]
    parts += [_line(line) for line in drawing.lines]
    parts.append("Q")
    content = "\n".join(parts).encode("ascii")
    bodies = [
        b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width:.6f} {height:.6f}] "
        "/Contents 4 0 R /Resources << /Font << /F 5 0 R >> >> >>".encode("ascii"),
        b"<< /Length %d >>\nstream\n%s\nendstream" % (len(content), content),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
        f"<< /Title ({_escaped(drawing.title)}) /Producer (rig) >>".encode("ascii"),
    ]
    return _file(bodies)


def _area(area: Area) -> str:
    grey = "0 g" if area.ink == "black" else "1 g"
    rects = "\n".join(
        f"{r.x_mm:.6f} {r.y_mm:.6f} {r.width_mm:.6f} {r.height_mm:.6f} re" for r in area.rects
    )
    discs = "\n".join(map(_disc, area.discs))
    shapes = "\n".join(part for part in (rects, discs) if part)
    return f"{grey}\n{shapes}\nf"


def _disc(disc: Disc) -> str:
    """Four Bezier curves, which stay within 0.03 % of the radius."""
    x, y, r = disc.x_mm, disc.y_mm, disc.radius_mm
    k = _ARC * r
    points = [
        *((x + r, y + k), (x + k, y + r), (x, y + r)),
        *((x - k, y + r), (x - r, y + k), (x - r, y)),
        *((x - r, y - k), (x - k, y - r), (x, y - r)),
        *((x + k, y - r), (x + r, y - k), (x + r, y)),
    ]
    numbers = [f"{a:.6f} {b:.6f}" for a, b in points]
    curves = "\n".join(f"{' '.join(numbers[n : n + 3])} c" for n in range(0, 12, 3))
    return f"{x + r:.6f} {y:.6f} m\n{curves}\nh"


def _line(line: Line) -> str:
    # The page is mirrored: the text matrix turns the letters upright again.
    return (
        f"0 g BT /F {line.height_mm:.4f} Tf 1 0 0 -1 {line.x_mm:.4f} {line.y_mm:.4f} Tm "
        f"({_escaped(line.text)}) Tj ET"
    )


def _escaped(text: str) -> str:
    return text.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")


def _file(bodies: list[bytes]) -> bytes:
    """Objects 1, 2, ... with their cross-reference table; the last one is the information."""
    out = bytearray(b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n")
    places: list[int] = []
    for number, body in enumerate(bodies, start=1):
        places.append(len(out))
        out += b"%d 0 obj\n%s\nendobj\n" % (number, body)
    table = len(out)
    out += b"xref\n0 %d\n0000000000 65535 f \n" % (len(bodies) + 1)
    out += b"".join(b"%010d 00000 n \n" % place for place in places)
    out += b"trailer\n<< /Size %d /Root 1 0 R /Info %d 0 R >>\n" % (len(bodies) + 1, len(bodies))
    out += b"startxref\n%d\n%%%%EOF\n" % table
    return bytes(out)
