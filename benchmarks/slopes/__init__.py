"""The dense slope estimator beside OpenCV's matchers: `python -m benchmarks.slopes`."""
