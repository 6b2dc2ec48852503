"""What the numbers in README and docs come from; `python -m benchmarks` prints them all."""
