"""Faults that change nothing that anyone can see, each with the reason."""

from collections.abc import Mapping

from benchmarks.mutants.operators import Mutation

_NORMALISED = "only the direction of the vector counts: it is brought to length 1 below"
_ONE_AXIS = "the array has two axes, so that the last one is also number 1"

_LARGER = "the array is larger than what is used of it"
_TURNS = "one more and one less are the same, modulo 2"
_LONGER = "a slice that reaches farther than the loop over it"
_NEGATIVE = "any negative number stands for none"
_FIRST = "the first sum begins at 0"
_ANY_LENGTH = "rows are worked through in blocks of any length"
_EMPTY = "a drift that is empty has neither rows nor columns"
_LOOKED_AT_AGAIN = "a first look only: `_is_highest` compares with all within two pixels"
_ONLY_FASTER = "SQLAlchemy keeps the compiled statement or makes it anew: the same statement"

_REASONS: dict[tuple[str, str, str, str], str] = {
    (
        "rig/targets/saddles.py",
        "above, here, below = strength[row - 1], strength[row], strength[row + 1]",
        "1",
        "(2)",
    ): _LOOKED_AT_AGAIN,
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
    (
        "rig/epipolar/search/aggregate.py",
        "_LARGE = np.int16(8000)",
        "8000",
        "(8001)",
    ): "whatever no path costs will do",
    (
        "rig/epipolar/search/aggregate.py",
        "path = np.empty((2, 2, 2, labels + 2, width + 2), np.int16)",
        "2",
        "(3)",
    ): _LARGER,
    (
        "rig/epipolar/search/aggregate.py",
        "lowest = np.zeros((2, 2, 2, width + 2), np.int16)",
        "2",
        "(3)",
    ): _LARGER,
    (
        "rig/epipolar/search/aggregate.py",
        "path = np.empty((2, labels + 2, width), np.int16)",
        "2",
        "(3)",
    ): _LARGER,
    (
        "rig/epipolar/search/aggregate.py",
        "lowest = np.empty((2, width), np.int16)",
        "2",
        "(3)",
    ): _LARGER,
    (
        "rig/epipolar/search/aggregate.py",
        "before, after = path[k % 2, side], path[(k + 1) % 2, side]",
        "k + 1",
        "(k - 1)",
    ): _TURNS,
    (
        "rig/epipolar/search/aggregate.py",
        "new = lowest[(k + 1) % 2, side, 1 : 1 + width]",
        "k + 1",
        "(k - 1)",
    ): _TURNS,
    (
        "rig/epipolar/search/aggregate.py",
        "before, after = path[k % 2], path[(k + 1) % 2]",
        "k + 1",
        "(k - 1)",
    ): _TURNS,
    (
        "rig/epipolar/search/aggregate.py",
        "old, new = lowest[k % 2], lowest[(k + 1) % 2]",
        "k + 1",
        "(k - 1)",
    ): _TURNS,
    (
        "rig/epipolar/search/aggregate.py",
        "target = after[label + 1, 1 : 1 + width]",
        "1",
        "(2)",
    ): _LONGER,
    (
        "rig/epipolar/search/plane_sweep.py",
        "rows = np.full((3, HALVES, width), NO_VIEWS, np.float32)",
        "3",
        "(4)",
    ): _LARGER,
    (
        "rig/epipolar/search/plane_sweep.py",
        "change = False",
        "False",
        "(True)",
    ): "views are counted in every row, and not only where another choice shows it",
    (
        "rig/epipolar/search/plane_sweep.py",
        "if drift.shape[1] == 0:  # nothing drifts",
        "1",
        "(2)",
    ): _EMPTY,
    (
        "rig/epipolar/drift_fit.py",
        "if drift.shape[1] == 0:  # nothing drifts",
        "1",
        "(2)",
    ): _EMPTY,
    (
        "rig/epipolar/search/narrow.py",
        "rows = np.full((3, HALVES, width), NO_VIEWS, np.float32)",
        "3",
        "(4)",
    ): _LARGER,
    (
        "rig/epipolar/search/census.py",
        "bits = (bits & fours) + ((bits >> two) & fours)",
        "bits >> two",
        "(bits << two)",
    ): "upper halves of nibbles go to the next nibble, which is added up as well; the top is empty",
    (
        "rig/epipolar/search/cross_check.py",
        "index = np.full((height, width), np.int16(-1), np.int16)",
        "1",
        "(2)",
    ): _NEGATIVE,
    (
        "rig/epipolar/search/cross_check.py",
        "index = np.where(known, np.arange(known.shape[1]), -1)",
        "1",
        "(2)",
    ): _NEGATIVE,
    ("rig/epipolar/stitch.py", "_BLOCK = 128", "128", "(129)"): _ANY_LENGTH,
    ("rig/epipolar/median.py", "_BLOCK = 128", "128", "(129)"): _ANY_LENGTH,
    (
        "rig/epipolar/stitch.py",
        "s, sx, sy = sums[u + _W], sums[u + _WX], sums[u + _WY]",
        "u + _W",
        "(u - _W)",
    ): _FIRST,
    ("rig/epipolar/stitch.py", "sums[u + _W] = w", "u + _W", "(u - _W)"): _FIRST,
    ("rig/epipolar/stitch.py", "sums[u + _W] += total", "u + _W", "(u - _W)"): _FIRST,
    (
        "rig/epipolar/stitch.py",
        "for target, (values, unit) in zip(framed[first:last], maps[first:last], strict=True):",
        "True",
        "(False)",
    ): "both are cut to the same length",
    (
        "drivers/rig_drivers/array/pairing.py",
        "if newest_s < time_s and time_s - newest_s > self.period_s / 4.0:",
        "newest_s < time_s",
        "(newest_s <= time_s)",
    ): "two equal times are not a quarter of a period apart",
    (
        "rig/database/frames.py",
        "with ThreadPoolExecutor(max_workers=min(4, len(multiview.frames))) as pool:",
        "4",
        "(5)",
    ): "any number of threads writes the same pictures",
    (
        "drivers/rig_drivers/v4l2/controls.py",
        "number = 0",
        "0",
        "(1)",
    ): "the numbers of controls begin far above both",
    (
        "rig/calibrate/coverage.py",
        "points_mm = target.points_mm.reshape(-1, 3)",
        "1",
        "(2)",
    ): "numpy takes any negative number for the size that the others tell",
    (
        "rig/devices.py",
        "if duration_s > 0.0:",
        "duration_s > 0.0",
        "(duration_s >= 0.0)",
    ): "to wait for no time is to go on",
    (
        "sim/rig_sim/firmware/zaber/messages.py",
        "address, axis = (*heads[:2], 0, 0)[:2]",
        "2",
        "(3)",
    ): "of the heads no more than two are taken anyway",
}
"""By path, the line, what stands there and what replaces it, each without line ends."""


def equivalents() -> Mapping[tuple[str, str, str, str], str]:
    """Return all of them, with their reasons."""
    return _REASONS


def reason(mutation: Mutation) -> str | None:
    """Return why a fault changes nothing; None where it should be noticed."""
    before, after = (" ".join(text.split()) for text in (mutation.before, mutation.after))
    return _REASONS.get((mutation.path, mutation.row, before, after))
