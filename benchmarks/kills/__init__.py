"""Verbs killed, or told to end, at random moments: `python -m benchmarks.kills`."""
