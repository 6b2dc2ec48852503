"""Real pictures that are not part of the repository; tests that want them skip without."""

import os
from pathlib import Path

SHARED = Path(os.environ.get("RIG_SHARED_DATA", Path(__file__).parents[3] / "shared" / "data"))
