"""One door for pictures from outside.

What a file claims is compared with limits, and its parts are checked, before it is decoded.
"""

from rig.pictures.decode import decoded
from rig.pictures.size import MOST_BYTES, PictureError

__all__ = ["MOST_BYTES", "PictureError", "decoded"]
