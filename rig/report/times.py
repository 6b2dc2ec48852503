"""Where the time of a sweep went, in words."""

from rig.sweep.take import SweepTimes


def times_text(times: SweepTimes) -> str:
    """Return what the bench needed, and how many times as long the sweep took."""
    parts = (
        f"moves {times.moves_s:.1f} s + settling {times.settling_s:.1f} s + exposures "
        f"{times.exposures_s:.1f} s = {times.needed_s:.1f} s"
    )
    if times.is_simulated:
        return f"{parts} of simulated time"
    if times.total_s is None or times.needed_s <= 0.0:
        return parts
    ratio = times.total_s / times.needed_s
    return f"{parts}; the sweep took {times.total_s:.1f} s ({ratio:.2f} times)"
