"""What the profile asks of a board and its sensors, put into DepthAI's words and checked first."""

from collections.abc import Mapping, Sequence

from rig.errors import ConfigError, DeviceNotFoundError
from rig.profile import OakCameraConfig
from rig_drivers.oak.controls import Controls
from rig_drivers.oak.sdk import dai

_JOIN_SYNC_GPIO = 6
"""OAK-FFC-4P: FSIN_MODE_SELECT; high connects the line of CAM_A and CAM_D with that of CAM_B and
CAM_C (Luxonis, hardware guide to frame synchronisation)."""

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
    size, rate_hz = (config.width_px, config.height_px), config.rate_hz
    outputs: dict[str, dai.Node.Output] = {}
    for view, socket in sockets.items():
        node = pipeline.create(dai.node.Camera)
        if config.pixels == "raw10":
            node.build(board_socket(socket), size, rate_hz)
            outputs[view] = node.raw
        else:
            node.build(board_socket(socket), sensorFps=rate_hz)
            outputs[view] = node.requestOutput(
                size,
                dai.ImgFrame.Type.GRAY8,
                fps=rate_hz,
                enableUndistortion=False,  # nothing is warped before it is measured
            )
        Controls.of(config).set_on(node.initialControl)
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
        _require_sensor(feature, config, f"{device}, view {view} ({feature.sensorName})")


def _require_sensor(feature: dai.CameraFeatures, config: OakCameraConfig, where: str) -> None:
    width, height = config.width_px, config.height_px
    if width > feature.width or height > feature.height:
        raise ConfigError(
            f"{where}: asked for {width} x {height} px, the sensor has {feature.width} x "
            f"{feature.height}",
            advice="lower camera.width_px and height_px",
        )
    modes = [c for c in feature.configs if c.width >= width and c.height >= height]
    fastest_hz = max((mode.maxFps for mode in modes), default=config.rate_hz)
    if config.rate_hz > fastest_hz:
        raise ConfigError(
            f"{where}: asked for {config.rate_hz:g} Hz, it reaches {fastest_hz:g} Hz at this size",
            advice="lower camera.rate_hz",
        )
    if config.pixels == "raw10":
        _require_raw(feature, config, where)
    if feature.hasAutofocus and config.lens_position is None:
        raise ConfigError(
            f"{where}: has autofocus, and a lens that moves changes the geometry",
            advice="lock it with camera.lens_position",
        )
    if config.lens_position is not None and not feature.hasAutofocus:
        raise ConfigError(f"{where}: has no focus motor", advice="remove camera.lens_position")


def _require_raw(feature: dai.CameraFeatures, config: OakCameraConfig, where: str) -> None:
    if dai.CameraSensorType.MONO not in feature.supportedTypes:
        raise ConfigError(
            f"{where}: raw pixels of a colour sensor are a mosaic",
            advice='use camera.pixels = "gray8" or a monochrome sensor',
        )
    sizes = sorted({(mode.width, mode.height) for mode in feature.configs})
    if sizes and (config.width_px, config.height_px) not in sizes:
        there = ", ".join(f"{width} x {height}" for width, height in sizes)
        raise ConfigError(
            f"{where}: asked for raw {config.width_px} x {config.height_px} px, its modes are "
            f"{there}",
            advice="raw pixels cannot be scaled",
        )
