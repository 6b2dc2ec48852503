"""`rig capture --serve foxglove`: live topics for Foxglove and Lichtblick over a websocket.

The messages are those of a recording. The server is that of `foxglove-sdk` (extra `foxglove`); it
runs on threads of its own, and a client that is too slow loses the oldest messages.
"""

from typing import Any, Final

from rig.errors import OutputError
from rig.live.camera import DepthCamera
from rig.live.frame import DepthFrame
from rig.recording.foxglove_messages import FoxgloveMessage, messages_of, schema_of
from rig.robots.extra import robot_extra
from rig.robots.frames import RobotFrames
from rig.robots.ros2_recording import require_no_depth

DEFAULT_HOST: Final = "127.0.0.1"
DEFAULT_PORT: Final = 8765
"""What Foxglove and Lichtblick offer by themselves."""
_FRAMES_WAITING: Final = 2
"""Frames that may wait for a client that is too slow."""


class FoxgloveServer:
    """Serves every frame to the clients that are there; costs next to nothing without one.

    Args:
        camera: open.
        host: address to listen at; any other than loopback lets everyone in the network look.
        port: 0 takes a free one.
        points: whether to serve the cloud as well.

    Raises:
        ConfigError: the extra `foxglove` is not installed.
        OutputError: the port is taken, or there is no such address.
        StoreError: a view has a name that is taken.
    """

    name = "foxglove"

    def __init__(
        self,
        camera: DepthCamera,
        *,
        host: str = DEFAULT_HOST,
        port: int = DEFAULT_PORT,
        points: bool = False,
    ) -> None:
        with robot_extra("foxglove", "foxglove", "topics of Foxglove"):
            # Here, because only those who ask for it have it.
            import foxglove  # noqa: PLC0415
        require_no_depth(camera.views)
        self._foxglove: Any = foxglove
        self._frames = RobotFrames(camera.run, points=points)
        self._context: Any = foxglove.Context()
        self._channels: dict[str, Any] = {}
        topics = 3 * len(camera.views) + 6
        try:
            self._server: Any = foxglove.start_server(
                name=camera.run.profile.name,
                host=host,
                port=port,
                context=self._context,
                message_backlog_size=_FRAMES_WAITING * topics,
            )
        except (RuntimeError, OSError, ValueError, OverflowError) as error:
            raise OutputError(
                f"asked to serve Foxglove at {host}:{port}: {error}",
                advice="is it taken? choose another with --serve-port, or --serve-host",
            ) from error

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self._server.port)

    def write(self, frame: DepthFrame) -> None:
        """Give a frame to the clients.

        Raises:
            ConfigError: names of the views fit no topics.
        """
        if self._channels and not any(c.has_sinks() for c in self._channels.values()):
            return
        seen = self._frames.of(frame)
        for message in messages_of(frame.views, frame.time_ns, seen.depth, seen.scene):
            channel = self._channel(message)
            if channel.has_sinks():
                channel.log(b"".join(message.payload), log_time=frame.time_ns)

    def close(self) -> None:
        """Let all clients go."""
        for channel in self._channels.values():
            channel.close()
        self._server.stop()

    def _channel(self, message: FoxgloveMessage) -> Any:
        if message.topic not in self._channels:
            self._channels[message.topic] = self._foxglove.Channel(
                message.topic,
                schema=self._schema(message),
                message_encoding="protobuf",
                context=self._context,
            )
        return self._channels[message.topic]

    def _schema(self, message: FoxgloveMessage) -> Any:
        return self._foxglove.Schema(
            name=message.schema_name, encoding="protobuf", data=schema_of(message.schema)
        )
