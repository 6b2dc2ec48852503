"""Faults that change nothing that anyone can see, each with the reason."""

from collections.abc import Mapping

from benchmarks.mutants.operators import Mutation

_NORMALISED = "only the direction of the vector counts: it is brought to length 1 below"
_ONE_AXIS = "the array has two axes, so that the last one is also number 1"

_ONLY_FASTER = "SQLAlchemy keeps the compiled statement or makes it anew: the same statement"

_REASONS: dict[tuple[str, str, str, str], str] = {
    (
        "sim/rig_sim/scenes/light.py",
        "across = np.cross(normals, "
        "np.where(np.abs(normals[..., :1]) < 0.5, [1, 0, 0], [0, 1, 0]))",
        "1",
        "(2)",
    ): _NORMALISED,
    (
        "sim/rig_sim/scenes/light.py",
        "light = np.zeros(points_mm.shape[:-1])",
        "-1",
        "(1)",
    ): _ONE_AXIS,
    (
        "sim/rig_sim/scenes/light.py",
        "free = np.zeros(points_mm.shape[:-1])",
        "-1",
        "(1)",
    ): _ONE_AXIS,
    (
        "rig/targets/corners.py",
        "for quarter in range(4):",
        "4",
        "(5)",
    ): "a fifth quarter turn is the first way up again, and of two alike the first is taken",
    (
        "rig/optics/calibrated.py",
        "if away > _MISPLACED * float(np.hypot(view.x_steps, view.y_steps)) + 1e-9:",
        "away > _MISPLACED * float(np.hypot(view.x_steps, view.y_steps)) + 1e-9",
        "(away >= _MISPLACED * float(np.hypot(view.x_steps, view.y_steps)) + 1e-09)",
    ): "the 1e-9 is there for rounding: nothing lies exactly on the limit with it",
    (
        "rig/plan.py",
        "if way_mm < ramp_mm:",
        "way_mm < ramp_mm",
        "(way_mm <= ramp_mm)",
    ): "where the way is just that of both ramps, both formulas are two of their times",
    (
        "rig/depth/pfm.py",
        'order = "<f4" if float(scale) < 0 else ">f4"',
        "float(scale) < 0",
        "(float(scale) <= 0)",
    ): "a scale of 0 was refused before",
    (
        "drivers/rig_drivers/oak/watchdog.py",
        "offsets_s = [(t_s - times_s[0] + half_s) % period_s - half_s for t_s in times_s]",
        "t_s - times_s[0] + half_s",
        "(t_s - times_s[0] - half_s)",
    ): "half a period further and half a period back are one place modulo the period",
    (
        "sim/rig_sim/carriage.py",
        "if abs(rotor.end_velocity_mm_s) < 1e-6 and way_mm != 0.0:",
        "abs(rotor.end_velocity_mm_s) < 1e-6",
        "(abs(rotor.end_velocity_mm_s) <= 1e-06)",
    ): "phases end at rest to within rounding or at full speed, none at just this border",
    (
        "rig/check/reach.py",
        "design = np.stack([np.ones_like(inverse), inverse], axis=-1)",
        "-1",
        "(1)",
    ): _ONE_AXIS,
    (
        "rig/check/photon_transfer.py",
        "if mean.size < _FEWEST_PIXELS:",
        "mean.size < _FEWEST_PIXELS",
        "(mean.size <= _FEWEST_PIXELS)",
    ): "so few pixels fill one bin at most, and a line needs three",
    ("rig/database/columns.py", "cache_ok = True", "True", "(False)"): _ONLY_FASTER,
}
"""By path, the line, what stands there and what replaces it, each without line ends."""


def equivalents() -> Mapping[tuple[str, str, str, str], str]:
    """Return all of them, with their reasons."""
    return _REASONS


def reason(mutation: Mutation) -> str | None:
    """Return why a fault changes nothing; None where it should be noticed."""
    before, after = (" ".join(text.split()) for text in (mutation.before, mutation.after))
    return _REASONS.get((mutation.path, mutation.row, before, after))
