"""Faults that change nothing that anyone can see, each with the reason."""

from benchmarks.mutants.operators import Mutation

_REASONS: dict[tuple[str, str, str], str] = {}
"""By path, what stands there and what replaces it, each on one line."""


def reason(mutation: Mutation) -> str | None:
    """Return why a fault changes nothing; None where it should be noticed."""
    before = " ".join(mutation.before.split())
    return _REASONS.get((mutation.path, before, " ".join(mutation.after.split())))
