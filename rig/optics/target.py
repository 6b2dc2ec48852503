"""From a profile's `[target]` to the target that is looked for."""

from rig.profile import (
    AprilGridConfig,
    AsymmetricCirclesConfig,
    CharucoConfig,
    CheckerboardConfig,
    TargetConfig,
)
from rig.targets import AprilGrid, CharucoBoard, CircleGrid, Target
from rig.targets.checkerboard import Checkerboard


def target_of(config: TargetConfig) -> Target:
    """Return the target that a profile describes.

    Raises:
        ConfigError: there is no such target, such as one of more markers than the dictionary holds.
    """
    match config:
        case CheckerboardConfig():
            return Checkerboard(config.columns, config.rows, config.square_mm)
        case CharucoConfig():
            return CharucoBoard(
                squares_across=config.squares_across,
                squares_down=config.squares_down,
                square_mm=config.square_mm,
                marker_mm=config.marker_mm,
                dictionary=config.dictionary,
                inverted=config.inverted,
                legacy_pattern=config.legacy_pattern,
            )
        case AprilGridConfig():
            return AprilGrid(
                tag_columns=config.tag_columns,
                tag_rows=config.tag_rows,
                tag_mm=config.tag_mm,
                spacing=config.spacing,
                border_bits=config.border_bits,
                first_tag=config.first_tag,
            )
        case AsymmetricCirclesConfig():
            return CircleGrid(config.columns, config.rows, config.spacing_mm, config.diameter_mm)
