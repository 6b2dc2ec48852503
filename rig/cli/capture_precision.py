"""How sure what was captured is, as JSON contract and in words."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.capture.capture import CaptureSummary


def precision_as_dict(summary: "CaptureSummary") -> dict[str, object]:
    """Return what `--json` prints: of depth, or of slopes where there is none."""
    if summary.valid_mm is not None:
        return {
            "median_k2_mm": summary.median_k2,
            "valid_mm": list(summary.valid_mm),
            "board_plane_rms_mm": summary.board_rms_mm,
        }
    from rig.capture.precision import SURE_PX

    return {
        "median_k2_px": summary.median_k2,
        "sure_pct": summary.sure_pct,
        "sure_below_px": SURE_PX,
    }


def precision_in_words(summary: "CaptureSummary") -> str:
    """Say for a person what the median pixel is worth."""
    if summary.valid_mm is not None:
        near_m, far_m = (limit / 1000.0 for limit in summary.valid_mm)
        pixel = "no pixel has an answer"
        if summary.median_k2 is not None:
            digits = ".0f" if summary.median_k2 >= 10.0 else ".2g"
            pixel = f"one pixel (median) +-{summary.median_k2:{digits}} mm, k=2"
        board = ""
        if summary.board_rms_mm is not None:
            rms_mm = f"{summary.board_rms_mm:.2g} mm rms"
            board = f"; board plane in its sweep {rms_mm} at held-out distances"
        return f"valid {near_m:.2f}-{far_m:.2f} m, {pixel}{board}"
    from rig.capture.precision import SURE_PX

    if summary.median_k2 is None or summary.sure_pct is None:
        return "no slope has an answer"
    return (
        f"{summary.sure_pct:.1f} % of the slopes surer than {SURE_PX:g} px per view step "
        f"(1 sigma); one pixel (median) +-{summary.median_k2:.2g} px, k=2"
    )
