"""What the profile asks of a board and its sensors, put into DepthAI's words and checked first."""

from collections.abc import Mapping, Sequence

from rig.errors import ConfigError, DeviceNotFoundError
from rig.profile import OakCameraConfig
from rig_drivers.oak.controls import Controls
from rig_drivers.oak.sdk import dai

_JOIN_SYNC_GPIO = 6
"""OAK-FFC-4P: FSIN_MODE_SELECT; high connects the line of CAM_A and CAM_D with that of CAM_B and
CAM_C (Luxonis, hardware guide to frame synchronisation)."""

_TYPES = {"gray8": dai.ImgFrame.Type.GRAY8, "nv12": dai.ImgFrame.Type.NV12}
NO_PICTURES = {
    dai.CameraSensorType.TOF: "measures times of flight",
    dai.CameraSensorType.THERMAL: "sees heat",
}
"""Sensors whose frames are no pictures of light."""
_FOLLOWERS = ("AR0234", "IMX")
"""Sensors that can follow a synchronisation line but not drive it (Luxonis, hardware guide to frame
synchronisation)."""
_LINES = ({"CAM_A", "CAM_D"}, {"CAM_B", "CAM_C"})
"""OAK-FFC-4P: the sockets of each synchronisation line."""

Mode = dai.CameraControl.FrameSyncMode


def device_config(config: OakCameraConfig) -> dai.Device.Config:
    """Return what a device must know while it boots."""
    wanted = dai.Device.Config()
    if config.joins_sync_lines:
        gpio = dai.BoardConfig.GPIO
        wanted.board.gpio[_JOIN_SYNC_GPIO] = gpio(gpio.Direction.OUTPUT, gpio.Level.HIGH)
    return wanted


def sync_mode(config: OakCameraConfig, view: str) -> dai.CameraControl.FrameSyncMode | None:
    """Return what the sync pin of a view's sensor is for; None leaves it to the board."""
    match config.sync:
        case "auto":
            return None
        case "off":
            return Mode.OFF
        case "external":
            return Mode.INPUT
        case "ptp":
            return Mode.TIME_PTP
        case "driven":
            return Mode.OUTPUT if view == config.sync_driver else Mode.INPUT


def board_socket(name: str) -> dai.CameraBoardSocket:
    """Return the socket of a name such as `CAM_B` or `DEVICE/CAM_B`."""
    return dai.CameraBoardSocket.__members__[name.rpartition("/")[2]]


def camera_outputs(
    pipeline: dai.Pipeline, config: OakCameraConfig, sockets: Mapping[str, str]
) -> dict[str, dai.Node.Output]:
    """Create a camera node per view, all controls locked, and return their streams.

    Args:
        pipeline: on an open device.
        config: size, pixels, rate, controls, synchronisation.
        sockets: by view name, of the device of this pipeline.
    """
    outputs: dict[str, dai.Node.Output] = {}
    for view, socket in sockets.items():
        sensor = config.of(view)
        node = pipeline.create(dai.node.Camera)
        if sensor.pixels == "raw10":
            node.build(board_socket(socket), sensor.size_px, config.rate_hz)
            outputs[view] = node.raw
        else:
            node.build(board_socket(socket), sensorFps=config.rate_hz)
            outputs[view] = node.requestOutput(
                sensor.size_px,
                _TYPES[sensor.pixels],
                fps=config.rate_hz,
                enableUndistortion=False,  # nothing is warped before it is measured
            )
        Controls.of(sensor).set_on(node.initialControl)
        mode = sync_mode(config, view)
        if mode is not None:
            node.initialControl.setFrameSyncMode(mode)
    return outputs


def require_sensors(
    features: Sequence[dai.CameraFeatures],
    config: OakCameraConfig,
    sockets: Mapping[str, str],
    device: str,
) -> None:
    """Refuse a profile that the sensors of a board cannot keep, before anything starts.

    Raises:
        DeviceNotFoundError: nothing is plugged into a socket.
        ConfigError: size, rate, pixels or focus do not fit the sensor.
    """
    found = {feature.socket: feature for feature in features}
    for view, socket in sockets.items():
        feature = found.get(board_socket(socket))
        if feature is None:
            there = ", ".join(f"{f.socket.name} {f.sensorName}" for f in features) or "none"
            raise DeviceNotFoundError(
                device,
                f"view {view} needs a sensor at {socket}, the board finds {there}",
                advice="seat its ribbon cable or correct camera.sockets",
            )
        where = f"{device}, view {view} ({feature.sensorName})"
        _require_pictures(feature, where)
        if view == config.sync_driver:
            _require_driver(feature, where)
        _require_sensor(feature, config.of(view), where, _keys(config, view))


def require_one_sync_line(model: str, config: OakCameraConfig, sockets: Mapping[str, str]) -> None:
    """Refuse sensors that wait for pulses on a line that nobody drives.

    Args:
        model: name of the board.
        config: synchronisation.
        sockets: by view name, of this device.

    Raises:
        ConfigError: sensors are on both lines of an OAK-FFC-4P, which are not joined.
    """
    used = {name.rpartition("/")[2] for name in sockets.values()}
    if config.sync != "driven" or config.joins_sync_lines or "FFC-4P" not in model.upper():
        return
    if all(used & line for line in _LINES):
        raise ConfigError(
            f"{model}: camera.sync_driver {config.sync_driver} is to drive sensors at "
            f"{', '.join(sorted(used))}, which are on two synchronisation lines",
            advice="set camera.joins_sync_lines = true",
        )


def resized(feature: dai.CameraFeatures, size_px: tuple[int, int]) -> str | None:
    """Say how pictures of a size come about where the sensor has no mode of that size.

    The device takes a larger mode, scales it by one factor and cuts what is left over, about the
    middle.

    Args:
        feature: of the sensor.
        size_px: width and height that are asked for.

    Returns:
        None where nothing is scaled or cut.
    """
    sizes = {(mode.width, mode.height) for mode in feature.configs}
    width, height = size_px
    if size_px in sizes or not sizes:
        return None
    larger = [(w, h) for w, h in sizes if w >= width and h >= height]
    full_width, full_height = min(larger, default=(feature.width, feature.height))
    scale = max(width / full_width, height / full_height)
    cut_x, cut_y = round(full_width * scale - width), round(full_height * scale - height)
    parts = [f"{width} x {height} px of a sensor of {full_width} x {full_height} px:"]
    if scale < 1.0:
        parts.append(f"scaled by {scale:.3f}")
    if cut_x or cut_y:
        parts.append(f"cut by {cut_x} x {cut_y} px")
    return " ".join(parts)


def _require_pictures(feature: dai.CameraFeatures, where: str) -> None:
    for kind, what in NO_PICTURES.items():
        if kind in feature.supportedTypes:
            raise ConfigError(
                f"{where}: {what}, rig needs pictures of light",
                advice="take it out of camera.sockets",
            )


def _require_driver(feature: dai.CameraFeatures, where: str) -> None:
    if feature.sensorName.upper().startswith(_FOLLOWERS):
        raise ConfigError(
            f"{where}: is to drive the others, such a sensor can only follow",
            advice="name an OV9282 or OV9782 in camera.sync_driver, or drive all from outside with "
            'camera.sync = "external"',
        )


def _keys(config: OakCameraConfig, view: str) -> str:
    """Where keys of a view's sensor stand in the profile."""
    return f"camera.sensors.{view}" if view in config.sensors else "camera"


def _require_sensor(
    feature: dai.CameraFeatures, config: OakCameraConfig, where: str, keys: str
) -> None:
    width, height = config.size_px
    if width > feature.width or height > feature.height:
        raise ConfigError(
            f"{where}: asked for {width} x {height} px, the sensor has {feature.width} x "
            f"{feature.height}",
            advice=f"lower {keys}.width_px and height_px",
        )
    modes = [c for c in feature.configs if c.width >= width and c.height >= height]
    fastest_hz = max((mode.maxFps for mode in modes), default=config.rate_hz)
    if config.rate_hz > fastest_hz:
        raise ConfigError(
            f"{where}: asked for {config.rate_hz:g} Hz, it reaches {fastest_hz:g} Hz at this size",
            advice="lower camera.rate_hz",
        )
    _require_pixels(feature, config, where, keys)
    if feature.hasAutofocus and config.lens_position is None:
        raise ConfigError(
            f"{where}: has autofocus, and a lens that moves changes the geometry",
            advice=f"lock it with {keys}.lens_position",
        )
    if config.lens_position is not None and not feature.hasAutofocus:
        raise ConfigError(f"{where}: has no focus motor", advice=f"remove {keys}.lens_position")


def _require_pixels(
    feature: dai.CameraFeatures, config: OakCameraConfig, where: str, keys: str
) -> None:
    kinds = feature.supportedTypes
    if config.pixels == "nv12" and dai.CameraSensorType.COLOR not in kinds:
        raise ConfigError(
            f"{where}: asked for colour, the sensor is monochrome",
            advice=f'use {keys}.pixels = "gray8"',
        )
    if config.pixels == "nv12" and any(side % 2 for side in config.size_px):
        raise ConfigError(
            f"{where}: asked for nv12 of {config.width_px} x {config.height_px} px, whose colour "
            "is that of squares of 2 x 2 px",
            advice=f"use even {keys}.width_px and height_px",
        )
    if config.pixels != "raw10":
        return
    if dai.CameraSensorType.MONO not in kinds:
        raise ConfigError(
            f"{where}: raw pixels of a colour sensor are a mosaic",
            advice=f'use {keys}.pixels = "gray8", "nv12" or a monochrome sensor',
        )
    sizes = sorted({(mode.width, mode.height) for mode in feature.configs})
    if sizes and config.size_px not in sizes:
        there = ", ".join(f"{width} x {height}" for width, height in sizes)
        raise ConfigError(
            f"{where}: asked for raw {config.width_px} x {config.height_px} px, its modes are "
            f"{there}",
            advice="raw pixels cannot be scaled",
        )
