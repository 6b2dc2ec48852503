"""From a profile's `[target]` to the target that is looked for."""

from rig.profile import CharucoConfig, TargetConfig
from rig.targets import CharucoBoard, Target
from rig.targets.checkerboard import Checkerboard


def target_of(config: TargetConfig) -> Target:
    """Return the target that a profile describes.

    Raises:
        ConfigError: there is no such board, such as more markers than the dictionary holds.
    """
    if isinstance(config, CharucoConfig):
        return CharucoBoard(
            squares_across=config.squares_across,
            squares_down=config.squares_down,
            square_mm=config.square_mm,
            marker_mm=config.marker_mm,
            dictionary=config.dictionary,
            inverted=config.inverted,
            legacy_pattern=config.legacy_pattern,
        )
    return Checkerboard(config.columns, config.rows, config.square_mm)
