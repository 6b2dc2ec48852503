"""Runs `rig` and writes down the peak of its resident memory, MB: LOG ARGUMENTS..."""

import resource
import sys
from pathlib import Path

from rig.cli import main

log = Path(sys.argv.pop(1))
sys.argv[0] = "rig"
try:
    main()
finally:
    log.write_text(str(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0))
