"""What page and recording cost a whole capture: `python -m benchmarks.whole_loop [SECONDS]`.

The verb itself on the simulated rig (five views, 640 x 400), whose one picture was rendered before:
plain, with the live page and a program that takes every map from it, with a recording, and with
both, in turn. Frames per second are those that `rig capture` states. Pictures are made up by the
simulator (noise on a rendering), which takes its share of the same cores.
"""

import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from threading import Thread

from benchmarks.view import ALL, CLIENT

RIG = (sys.executable, "-m", "rig")
ROUNDS = 3
WAYS = {
    "plain": (),
    "page": ("--view",),
    "recording": ("--record",),
    "page and recording": ("--view", "--record"),
}
ADDRESS = re.compile(r"(http://\S+)")


def sweep() -> None:
    """Give the rig a curve; its pictures are rendered here, once."""
    subprocess.run([*RIG, "sweep", "sim", "--count", "7", "--samples", "2"], check=True)


def watch(errors_of_capture: Path, started: subprocess.Popen[str]) -> subprocess.Popen[str] | None:
    """Take every map from the page whose address the capture prints."""
    for line in started.stderr or ():
        with errors_of_capture.open("a") as told:
            told.write(line)
        if found := ADDRESS.search(line):
            url = f"{found[1].replace('http', 'ws', 1)}live"
            return subprocess.Popen(
                [sys.executable, "-c", CLIENT, url, json.dumps(ALL)],
                stdout=subprocess.PIPE,
                text=True,
            )
    return None


def capture(folder: Path, options: tuple[str, ...], seconds: float) -> dict[str, object]:
    """Run the verb and return what it says of itself, with the frames that the page took."""
    command = [*RIG, "capture", "sim", "--seconds", str(seconds), "--json"]
    for option in options:
        command.append(option)
        if option == "--record":
            command.append(str(folder / f"{len(list(folder.iterdir()))}.mcap"))
    started = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=folder
    )
    client = watch(folder / "told.txt", started) if "--view" in options else None
    drain = Thread(target=lambda: [None for _ in started.stderr or ()], daemon=True)
    drain.start()
    answer: dict[str, object] = json.loads((started.stdout or sys.stdin).read())
    if started.wait() != 0:
        raise SystemExit(f"{' '.join(command)} ended with {started.returncode}")
    if client is not None:
        answer["page"] = len(json.loads(client.communicate()[0])["ages_ms"]) + 1
    return answer


def main() -> None:
    """Print frames per second of each way, as medians over rounds taken in turn."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 15.0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ["RIG_DATABASE"] = f"sqlite:///{folder}/rig.sqlite"
        os.environ["RIG_CACHE_DIR"] = f"{folder}/renders"
        sweep()
        capture(folder, (), 2.0)
        fps: dict[str, list[float]] = {way: [] for way in WAYS}
        last: dict[str, dict[str, object]] = {}
        for _ in range(ROUNDS):
            for way, options in WAYS.items():
                last[way] = capture(folder, options, seconds)
                fps[way].append(float(str(last[way]["fps"])))
        plain = statistics.median(fps["plain"])
        for way, found in fps.items():
            median = statistics.median(found)
            print(
                f"{way}: {median:.2f} fps ({median / plain:.3f} x plain), latency "
                f"{last[way]['latency_ms']} ms, dropped {last[way]['dropped']}"
                + (f", page took {last[way]['page']}" if "page" in last[way] else "")
                + f" of {last[way]['frames']}"
            )


if __name__ == "__main__":
    main()
