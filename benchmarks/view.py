"""What the live page costs a capture: `python -m benchmarks.view [FRAMES]`.

Frames of 640 x 400 with five views, depth, sigma, label and slope at 20 a second, one page on
loopback that takes them all (another process). Processor time is that of the whole capturing
process less what it takes without a page; latency is from handing a frame over until the page has
it.
"""

import json
import os
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from scipy.stats import linregress

from rig.live.frame import DepthFrame
from rig.view.frame_message import FrameMessage
from rig.view.live_view import LiveView
from rig.view.notices import Notices
from rig.view.page_file import page
from rig.view.server import ViewServer
from tests.support.shown_frames import scene

FRAMES, FRAMES_PER_S, KINDS = 200, 20.0, 8
WARM_UP = 2000

CLIENT = """
import json, sys, time
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from rig.view.wire import decode
ages, sizes, begun = [], [], time.time()
with connect(sys.argv[1], max_size=None, compression=None) as page:
    page.send(json.dumps({"want": json.loads(sys.argv[2])}))
    first_s = None
    for message in page:
        if isinstance(message, str):
            continue
        now = time.time()
        header, arrays = decode(message)
        try:
            page.send(json.dumps({"ack": header["number"]}))
        except ConnectionClosed:
            break
        if first_s is None:
            first_s = now - begun
        else:
            ages.append(1e3 * now - header["time_ms"])
        sizes.append(len(message))
print(json.dumps({"ages_ms": ages, "bytes": sizes[-1], "first_s": first_s}))
"""
ALL = ("views", "sigma", "label", "slope", "rectified")


def play(view: LiveView, frames: Sequence[DepthFrame]) -> float:
    """Hand frames over at their pace; return the processor time of this process, s a frame."""
    begun_s, used_s = time.monotonic(), time.process_time()
    for i in range(FRAMES):
        time.sleep(max(0.0, begun_s + i / FRAMES_PER_S - time.monotonic()))
        view.write(replace(frames[i % KINDS], index=i, time_ns=time.time_ns()))
    return (time.process_time() - used_s) / FRAMES


def quantiles_ms(values: Sequence[float]) -> tuple[float, float]:
    """50th and 95th percentile."""
    return statistics.median(values), statistics.quantiles(values, n=20)[-1]


def memory(count: int) -> None:
    """Print how memory, handles and threads go over many small frames that one page takes."""
    small = scene(160, 100)
    frames = [small.frame(i) for i in range(KINDS)]
    server = ViewServer[FrameMessage]("127.0.0.1", 0, "t", Notices(lambda _: None)).start()
    view = LiveView(small.run, dict, server)
    url = f"{server.url.replace('http', 'ws')}live"
    client = subprocess.Popen(
        [sys.executable, "-c", CLIENT, url, json.dumps(ALL)], stdout=subprocess.PIPE
    )
    while server.pages == 0:
        time.sleep(0.05)
    at: list[int] = []
    rss: list[float] = []
    handles: set[int] = set()
    threads: set[int] = set()
    for i in range(WARM_UP + count):
        view.write(replace(frames[i % KINDS], index=i, time_ns=time.time_ns()))
        time.sleep(0.002)
        if i >= WARM_UP and i % 100 == 0:
            at.append(i)
            rss.append(_resident_mb())
            handles.add(len(list(Path("/proc/self/fd").iterdir())))
            threads.add(threading.active_count())
    view.close()
    came = len(json.loads(client.communicate()[0])["ages_ms"]) + 1
    fit = linregress(at, rss)
    growth_pct = 100.0 * fit.slope * count / rss[0]
    sure_pct = 100.0 * 1.96 * fit.stderr * count / rss[0]
    print(
        f"memory over {count} frames after {WARM_UP}: {rss[0]:.1f} MB, {growth_pct:+.2f} +- "
        f"{sure_pct:.2f} % (95 %); handles {sorted(handles)}, threads {sorted(threads)}; "
        f"{came} frames came"
    )


def _resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def main() -> None:
    whole = scene(640, 400)
    frames = [whole.frame(i, sway_mm=20.0 * i) for i in range(KINDS)]
    for wants in (ALL, ("views", "sigma", "label"), ()):
        server = ViewServer[FrameMessage]("127.0.0.1", 0, "t", Notices(lambda _: None)).start()
        view = LiveView(whole.run, dict, server)
        alone_s = play(view, frames)
        url = f"{server.url.replace('http', 'ws')}live"
        client = subprocess.Popen(
            [sys.executable, "-c", CLIENT, url, json.dumps(wants)], stdout=subprocess.PIPE
        )
        while server.pages == 0:
            time.sleep(0.05)
        watched_s = play(view, frames)
        view.close()
        found = json.loads(client.communicate()[0])
        p50, p95 = quantiles_ms(found["ages_ms"])
        print(
            f"{', '.join(wants) or 'map and picture only'}: {found['bytes'] / 1e6:.2f} MB a frame, "
            f"{1e3 * (watched_s - alone_s):.2f} ms processor time a frame "
            f"(without a page {1e3 * alone_s:.2f}); to the page {p50:.1f} / {p95:.1f} ms "
            f"(p50 / p95); first picture after {found['first_s']:.2f} s; "
            f"{len(found['ages_ms']) + 1} of {FRAMES} frames came"
        )
    print(f"page: {len(page().html) / 1e3:.0f} kB")
    memory(int(sys.argv[1]) if len(sys.argv) > 1 else 30_000)


if __name__ == "__main__":
    main()
