"""OctoPrint's virtual printer on a TCP port; runs in an environment of its own, beside OctoPrint.

    python octoprint_bridge.py FOLDER

FOLDER takes its settings. The port is printed; every program that connects finds a printer that has
just started. The emulator is left as it is but for what it does not know: M211, and that motors
count 100 steps per mm, as its M114 has it.
"""

import socket
import sys
import threading

from octoprint.plugin import plugin_manager, plugin_settings
from octoprint.plugins.virtual_printer import VirtualPrinterPlugin
from octoprint.plugins.virtual_printer.virtual import VirtualPrinter
from octoprint.settings import settings


class Stage(VirtualPrinter):
    """The emulator, with soft end stops."""

    def _gcode_M211(self, data: str) -> None:  # noqa: N802
        self._send("echo:Soft endstops: On  Min: X0.00 Y0.00 Z0.00   Max: X900.00 Y200.00 Z180.00")


def serve(folder: str) -> None:
    """Serve one program after the other until killed."""
    settings(init=True, basedir=folder)
    plugin_manager(init=True)
    defaults = VirtualPrinterPlugin().get_settings_defaults()
    defaults["m114FormatString"] = "X:{x:.2f} Y:{y:.2f} Z:{z:.2f} E:0.00 Count X:{a} Y:{b} Z:{c}"
    options = plugin_settings("virtual_printer", defaults=defaults)
    with socket.create_server(("127.0.0.1", 0)) as server:
        print(server.getsockname()[1], flush=True)  # noqa: T201
        while True:
            client, _ = server.accept()
            printer = Stage(options, None, data_folder=folder, read_timeout=0.2)
            for axis in ("X", "Y", "Z"):
                put(printer, f"M92 {axis}100\n".encode())
            pump = threading.Thread(target=pass_on, args=(printer, client), daemon=True)
            pump.start()
            take_from(client, printer)
            printer.close()
            client.close()


def take_from(client: socket.socket, printer: VirtualPrinter) -> None:
    """Pass lines to the printer until the program hangs up."""
    waiting = b""
    while data := client.recv(4096):
        *lines, waiting = (waiting + data).split(b"\n")
        for line in lines:
            put(printer, line + b"\n")


def put(printer: VirtualPrinter, data: bytes) -> None:
    """Write all of it; the printer's buffer takes 64 bytes at a time."""
    while data:
        data = data[printer.write(data) :]


def pass_on(printer: VirtualPrinter, client: socket.socket) -> None:
    """Pass what the printer says to the program."""
    while printer.outgoing is not None:
        line = printer.readline()
        if line:
            try:
                client.sendall(line.rstrip(b"\r\n") + b"\n")
            except OSError:
                return


if __name__ == "__main__":
    serve(sys.argv[1])
