"""The result of a calibration of lenslets as JSON contract, and in words."""

from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from rig.calibrate.lenslets import LensletResult


def lenslets_as_dict(result: "LensletResult") -> dict[str, object]:
    """Return what `--json` prints."""
    return {
        "calibration": result.calibration_id,
        "rig": result.rig,
        "database": result.database,
        "file": str(result.file),
        "report": str(result.report),
        "pictures": result.pictures,
        **result.quality,
    }


def lenslet_lines(result: "LensletResult") -> list[str]:
    """Return the result in words."""
    quality = cast("dict[str, Any]", dict(result.quality))
    width_px, height_px = quality["view_size_px"]
    return [
        f"calibration {result.calibration_id} of {result.rig}: {quality['lenslets']} lenslets, "
        f"{quality['lattice']}, {quality['spacing_px']:.3f} px apart, turned "
        f"{quality['rotation_deg']:+.3f} deg",
        f"  centres: single ones scatter {quality['residual_px']:.3f} px, the lattice is good to "
        f"+-{2.0 * quality['corner_sigma_px']:.4f} px in the corners (k=2)",
        f"  lenslets: {quality['missing']} missing, {quality['dirty']} dirty; their light differs "
        f"by {quality['gain_rms_pct']:.2f} % rms",
        f"  white picture over fit: {quality['white_rms_pct']:.2f} % rms of single pixels",
        f"  views of {width_px} x {height_px} px",
        f"  report: {result.report}",
    ]
