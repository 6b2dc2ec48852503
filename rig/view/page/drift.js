// How each view has turned since the calibration: pitch and roll against time or temperature, with bands of k = 2.
const DRIFT_AXES = [["pitch", "--accent"], ["roll", "--roll"]];

class Drift {
  constructor() {
    this.isByWarmth = false;
    this.series = null;
  }
  // Whether there are looks that the page has not drawn.
  isBehind(header) { return header.drift_looks !== null && header.drift_looks !== (this.series?.looks ?? null); }
  draw(header) {
    if (header.drift) this.series = header.drift;
    $("p-drift").hidden = header.drift_looks === null;
    if (!this.series) return;
    const key = [header.drift_looks, this.series.looks, this.isByWarmth, $("drifts").clientWidth, isDark.matches, window.devicePixelRatio].join();
    if (key === this.drawn) return;
    this.drawn = key;
    const { series } = this, isWarm = series.look_degc.filter((one) => one !== null).length > 1;
    $("drift-by").hidden = !isWarm;
    $("drift-of").textContent = `pitch and roll since calibration ${series.calibration}`;
    $("drift-hint").textContent = series.looks ? this.words() : "The first look comes within ten seconds, the next ones every half minute.";
    $("drift-key").hidden = !series.looks;
    const names = Object.keys(series.views), root = $("drifts");
    if (String(names) !== this.built) {
      this.built = String(names);
      root.replaceChildren(...names.map((name) => {
        const figure = document.createElement("figure"), text = document.createElement("figcaption"), canvas = document.createElement("canvas");
        canvas.setAttribute("aria-label", `Pitch and roll of ${name}`);
        figure.append(text, canvas);
        return figure;
      }));
    }
    names.forEach((name, k) => this.drawView(root.children[k], name, series.views[name], isWarm && this.isByWarmth));
  }
  words() {
    const { series } = this, last = series.probability.at(-1), warm = series.look_degc.at(-1);
    const warmth = warm === null || series.degc === null ? "" : `, ${signed(warm - series.degc, 1)} °C since then`;
    return `${series.looks} look${series.looks === 1 ? "" : "s"}${warmth}; chance of the last ${Number.isFinite(last) ? last.toPrecision(2) : "–"}`;
  }
  drawView(figure, name, view, isByWarmth) {
    const { series } = this, [text, canvas] = figure.children;
    const at = isByWarmth ? series.look_degc : series.time_ms.map((one) => (one - series.time_ms.at(-1)) / 6e4);
    const marks = view.turned_deg.flatMap((turned, k) => (turned && at[k] !== null ? [{ x: at[k], turned, sigma: view.sigma_deg[k] ?? [0, 0] }] : []));
    if (isByWarmth) marks.sort((a, b) => a.x - b.x);
    const last = view.turned_deg.findLastIndex((one) => one !== null);
    text.replaceChildren(name, ...DRIFT_AXES.map(([axis, colour], k) => {
      const told = document.createElement("b");
      told.style.color = `var(${colour})`;
      told.textContent = last < 0 ? "–" : `${axis} ${signed(view.turned_deg[last][k], 3)} ± ${(2 * (view.sigma_deg[last]?.[k] ?? NaN)).toFixed(3)}°`;
      return told;
    }));
    const box = canvas.getBoundingClientRect(), context = fitted(canvas, box.width, box.height);
    if (!marks.length) return;
    const ends = marks.flatMap(({ turned, sigma }) => turned.flatMap((one, k) => [one - 2 * sigma[k], one + 2 * sigma[k]]));
    const known = (view.known_deg ?? []).map((one) => 2 * one);
    const low = Math.min(...ends, 0, ...known.map((one) => -one)), high = Math.max(...ends, 0, ...known);
    const room = 0.08 * (high - low) || 1e-3, y0 = low - room, y1 = high + room;
    const first = marks[0].x, final = marks.at(-1).x, apart = final - first || 1, x0 = first === final ? first - 0.5 : first;
    const left = 58, right = box.width - 8, top = 6, bottom = box.height - 18;
    const px = (x) => left + ((right - left) * (x - x0)) / apart, py = (y) => bottom - ((bottom - top) * (y - y0)) / (y1 - y0);
    // What the calibration itself is sure of: nothing within it has changed for certain.
    known.forEach((one, k) => {
      context.globalAlpha = 0.16;
      context.fillStyle = ink(DRIFT_AXES[k][1]);
      context.fillRect(left, py(one), right - left, py(-one) - py(one));
      context.globalAlpha = 1;
    });
    context.font = `11px ${ink("--mono")}`;
    context.fillStyle = ink("--quiet");
    context.strokeStyle = ink("--line");
    const vertical = ticksBetween(y0, y1, 3), across = ticksBetween(x0, x0 + apart, 4);
    context.textAlign = "right";
    for (const tick of vertical.ticks) {
      context.beginPath(); context.moveTo(left, py(tick)); context.lineTo(right, py(tick)); context.stroke();
      context.fillText(`${tick.toFixed(vertical.digits).replace("-", "−")}°`, left - 6, py(tick) + 4);
    }
    const unit = isByWarmth ? " °C" : " min";
    across.ticks.forEach((tick, k) => {
      context.textAlign = k === across.ticks.length - 1 ? "right" : "center";
      context.fillText(tick.toFixed(across.digits).replace("-", "−") + (k === across.ticks.length - 1 ? unit : ""), Math.min(px(tick), right), box.height - 4);
    });
    DRIFT_AXES.forEach(([, colour], k) => {
      const band = new Path2D(), line = new Path2D();
      marks.forEach(({ x, turned, sigma }, i) => band[i ? "lineTo" : "moveTo"](px(x), py(turned[k] + 2 * sigma[k])));
      [...marks].reverse().forEach(({ x, turned, sigma }) => band.lineTo(px(x), py(turned[k] - 2 * sigma[k])));
      marks.forEach(({ x, turned }, i) => line[i ? "lineTo" : "moveTo"](px(x), py(turned[k])));
      context.strokeStyle = context.fillStyle = ink(colour);
      if (!isByWarmth) {
        context.globalAlpha = 0.25;
        context.fill(band);
        context.globalAlpha = 1;
      }
      context.lineWidth = 1.6;
      if (!isByWarmth) context.stroke(line);
      if (marks.length > 60 && !isByWarmth) return;
      for (const { x, turned, sigma } of marks) {
        context.beginPath();
        context.arc(px(x), py(turned[k]), 2.5, 0, 7);
        context.fill();
        context.lineWidth = 1;
        context.beginPath(); context.moveTo(px(x), py(turned[k] - 2 * sigma[k])); context.lineTo(px(x), py(turned[k] + 2 * sigma[k])); context.stroke();
      }
    });
  }
}
