"""Time of the very first estimate of an installation, of the first of a process, and its memory."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

_FIRST = """
import resource, sys, time
import numpy as np
from rig.epipolar import RectifiedViews, SlopePrior, estimate_slopes
arm = np.array([k for k in range(-4, 5) if k], float)
x, y = np.r_[0.0, arm, 0 * arm], np.r_[0.0, 0 * arm, arm]
size = int(sys.argv[1])
frames = np.random.default_rng(0).integers(0, 255, (17, size, size), dtype=np.uint8)
views = RectifiedViews(frames, x, y, 0)
start, start_cpu = time.perf_counter(), time.process_time()
first = estimate_slopes(views, (-4.0, 4.0))
if size < 100:
    hypothesis = np.zeros((size, size), np.float32)
    estimate_slopes(views, (-4.0, 4.0), SlopePrior(hypothesis, hypothesis + 0.1))
    estimate_slopes(views, (-40.0, 40.0))
print(time.perf_counter() - start, time.process_time() - start_cpu,
      resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""


def first_use() -> None:
    """Print them, measured in processes of their own with an empty cache of machine code."""
    root = Path(__file__).parents[2]
    with tempfile.TemporaryDirectory() as cache:
        for name, size in (("cold", 64), ("warm", 64), ("9 + 9 views of 512 x 512", 512)):
            done = subprocess.run(
                [sys.executable, "-c", _FIRST, str(size)],
                cwd=root,
                env={**os.environ, "NUMBA_CACHE_DIR": cache},
                capture_output=True,
                text=True,
                check=True,
            )
            wall_s, cpu_s, peak_mb = (float(word) for word in done.stdout.split())
            print(f"{name:28} wall {wall_s:6.1f} s  cpu {cpu_s:6.1f} s  peak {peak_mb:5.0f} MB")
