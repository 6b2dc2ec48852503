// The page itself: what is shown, where the cursor is, and what the keys do.
const $ = (id) => document.getElementById(id);
const isDark = window.matchMedia("(prefers-color-scheme: dark)");
const query = new URLSearchParams(window.location.search);
const STALE_MS = 2500;
const number = (value, digits = 1) => (Number.isFinite(value) ? value.toFixed(digits) : "–");

const app = {
  shown: null, shows: "depth", tool: "point", range: {}, isHeld: false, link: null, words: {}, drawn: 0,
  marks: { cursor: null, isPinned: false, line: null, region: null }, drag: null, isFrozen: false, state: "connecting",
  came: 0, draws: [], pending: false,
};
const map = new Plate($("map"));
const views = new Views($("views"));
const epis = [new Epi($("epi-h"), $("epi-h-text"), "row"), new Epi($("epi-v"), $("epi-v-text"), "column")];
const thin = Math.max(1, Math.round(Math.sqrt(256000 / (Number(query.get("points")) || 256000))));
const drift = new Drift();
const cloud = new Cloud($("cloud"), thin);
cloud.changed = () => schedule();
const others = { sweep: new Sweep(), calibrate: new Calibrate() };

// ---- frames come in

function took(message) {
  const { header } = message;
  document.body.dataset.mode = header.mode;
  if (header.mode !== "capture") {
    app.other = message;
    app.came = performance.now();
    document.title = `${header.rig} – rig`;
    $("rig").textContent = header.rig;
    $("mode").textContent = header.mode;
    return schedule(header.number);
  }
  const isFirst = app.shown === null;
  app.shown = new Shown(message);
  app.came = performance.now();
  if (isFirst) begin();
  schedule(message.header.number);
}

function begin() {
  const { header, width, height } = app.shown;
  document.title = `${header.rig} – rig`;
  $("rig").textContent = header.rig;
  $("mode").textContent = header.mode;
  $("maptab").textContent = app.shown.isDepth ? "Depth" : "Slope";
  $("empty").hidden = true;
  $("plate").style.aspectRatio = `${width} / ${height}`;
  app.marks.cursor = { x: width >> 1, y: height >> 1 };
}

function schedule(ack) {
  if (ack !== undefined) app.ack = ack;
  if (app.pending) return;
  app.pending = true;
  requestAnimationFrame(() => {
    app.pending = false;
    draw();
    if (app.ack === undefined) return;
    app.link.say({ ack: app.ack });
    app.ack = undefined;
    app.drawn++;
    app.draws.push(performance.now());
    if (app.draws.length > 40) app.draws.shift();
  });
}

// ---- drawing

function draw() {
  const { shown } = app;
  if (app.other) return others[app.other.header.mode].draw(app.other);
  if (!shown) return;
  app.none = isDark.matches ? NONE.dark : NONE.light;
  drawMap(shown);
  if (isSeen("p-views")) views.draw(shown);
  drawMarks();
  drawVitals(shown);
  drift.draw(shown.header);
  want();
}

const isSeen = (id) => $(id).getBoundingClientRect().top < window.innerHeight;

// Range of the colours: it follows what comes, calmly, unless it is held.
function rangeOf(name, values) {
  const now = robustRange(values), before = app.range[name];
  if (!now || (before && app.isHeld)) return before ?? now ?? [0, 1];
  const isFar = !before || Math.abs(now[0] - before[0]) + Math.abs(now[1] - before[1]) > 0.5 * (before[1] - before[0]);
  app.range[name] = isFar ? now : before.map((one, k) => one + 0.1 * (now[k] - one));
  return app.range[name];
}

function drawMap(shown) {
  const { width, height } = shown, isCloud = app.shows === "cloud";
  $("cloud").hidden = !isCloud;
  $("over").hidden = isCloud;
  const name = shown.isDepth ? "depth" : "slope";
  if (app.shows === "label") return drawLabels(shown);
  if (app.shows === "picture") {
    if (shown.colour()) map.rgb(shown.colour(), width, height);
    else map.codes(shown.picture(), width, height, GREYS);
    return drawLegend(null);
  }
  if (app.shows === "sigma") {
    const twice = (shown.twice ??= shown.sigma()?.map((one) => 2 * one));
    if (!twice) return;
    const range = [0, rangeOf("sigma", twice)[1]];
    map.values(twice, width, height, VIRIDIS, range, false, app.none);
    return drawLegend(VIRIDIS, range, false, `k = 2, ${shown.header.unit}`);
  }
  const range = rangeOf(name, shown.map());
  if (isCloud) {
    tellEmpty(cloud.draw(shown, range));
    if (shown.colour()) return drawLegend(null);
  }
  else map.values(shown.map(), width, height, TURBO, range, shown.isDepth, app.none);
  drawLegend(TURBO, range, shown.isDepth, shown.isDepth ? "mm" : "px per step");
}

function drawLabels(shown) {
  const label = shown.label();
  if (!label) return;
  const colours = [...LABEL_PIXELS];
  colours[0] = app.none;
  map.codes(label, shown.width, shown.height, colours);
  drawLegend("labels");
}

function tellEmpty(text) {
  $("empty").hidden = text === null;
  if (text) $("empty").textContent = text;
}

function drawLegend(colours, range, isTurned, unit = "") {
  const legend = $("legend"), key = JSON.stringify([typeof colours === "string" ? colours : colours?.[0], range?.map((one) => one.toPrecision(5)), isTurned, unit]);
  if (legend.dataset.key === key) return;
  legend.dataset.key = key;
  legend.classList.toggle("gone", colours === null);
  legend.classList.toggle("named", colours === "labels");
  const ticks = $("ticks");
  $("unit").textContent = unit;
  ticks.replaceChildren();
  if (colours === null) return;
  if (colours === "labels") {
    LABELS.forEach(([name, hex], i) => {
      const line = ticks.appendChild(document.createElement("span"));
      line.innerHTML = "<i></i>";
      line.firstChild.style.background = i ? `#${hex.toString(16).padStart(6, "0")}` : ink("--none");
      line.append(name);
    });
    return;
  }
  // From the smallest value to the largest; colours are turned where small is warm.
  const stops = Array.from({ length: 17 }, (_, k) => colours[Math.round((255 * (isTurned ? 16 - k : k)) / 16)]);
  $("scale").style.setProperty("--ramp", stops.map((one) => `rgb(${one & 255} ${(one >> 8) & 255} ${(one >> 16) & 255})`).join(", "));
  const [low, high] = range, found = ticksBetween(low, high, 6);
  for (const tick of found.ticks) {
    const line = ticks.appendChild(document.createElement("span"));
    line.textContent = tick.toFixed(found.digits).replace("-", "−");
    line.style.setProperty("--at", `${(100 * (tick - low)) / (high - low)}%`);
  }
}

function drawMarks() {
  const { shown, marks } = app;
  if (!shown) return;
  const box = $("plate").getBoundingClientRect();
  drawOverlay($("over"), box, shown, marks);
  drawReadout(shown, marks.cursor);
  if (isSeen("p-epi")) epis.forEach((epi) => epi.draw(shown, marks.cursor));
  $("profile").hidden = !marks.line;
  $("profile-hint").hidden = Boolean(marks.line);
  if (marks.line) drawProfile($("profile"), shown, marks.line);
  drawPlane(shown);
}

// What is known at a pixel, as a person writes it.
function readAt(shown, { x, y }) {
  const i = y * shown.width + x, value = shown.map()[i], sigma = shown.sigma()?.[i];
  const digits = shown.isDepth ? 1 : 3;
  return {
    value, sigma, label: LABELS[shown.label()?.[i] ?? 0]?.[0],
    text: Number.isNaN(value) ? "no answer" : `${value.toFixed(digits).replace("-", "−")} ± ${(2 * sigma).toFixed(digits)}`,
  };
}

function drawReadout(shown, cursor) {
  if (!cursor) {
    $("value").textContent = "–";
    $("facts").replaceChildren();
    return;
  }
  const read = readAt(shown, cursor), slope = shown.slope()?.[cursor.y * shown.width + cursor.x];
  $("value").innerHTML = "";
  $("value").append(read.text);
  if (!Number.isNaN(read.value)) $("value").insertAdjacentHTML("beforeend", ` <small>${shown.isDepth ? "mm" : "px per step"} <i>(k=2)</i></small>`);
  const facts = [["x, y", `${cursor.x}, ${cursor.y}`], ["grey", shown.picture()[cursor.y * shown.width + cursor.x]], ["label", read.label]];
  if (shown.isDepth) facts.splice(2, 0, ["slope", Number.isFinite(slope) ? `${signed(slope, 3)} px` : "–"]);
  const colour = shown.colour()?.subarray(3 * (cursor.y * shown.width + cursor.x)).subarray(0, 3);
  if (colour) facts.splice(2, 0, ["red, green, blue", colour.join(", ")]);
  list($("facts"), facts);
}

function list(root, pairs) {
  root.replaceChildren(...pairs.map(([name, value, title]) => {
    const row = document.createElement("div"), term = document.createElement("dt"), what = document.createElement("dd");
    term.textContent = name;
    what.textContent = value;
    if (title) row.title = title;
    row.append(term, what);
    return row;
  }));
}

function drawPlane(shown) {
  const { region } = app.marks;
  $("plane").hidden = !region;
  $("plane-hint").hidden = Boolean(region);
  if (!region) return;
  const found = qualityOf(shown, region, Number($("truth").value) || 0);
  const rows = [["fill", `${number(found.fill_pct)} %`, "Share of the region's pixels with an answer"]];
  if (found.why) rows.push(["plane", found.why]);
  else if (shown.isDepth) {
    rows.push(
      ["distance", `${number(found.distance_mm)} mm`, "Of the fitted plane at the middle of the region"],
      ["tilt", `${number(found.tilt_deg)}°`, "Between the plane's normal and the optical axis"],
      ["rms", `${number(found.rms_mm, 2)} mm`, "Root mean square of the distances to the plane"],
      ["flatness", `${number(found.flatness_mm, 2)} mm`, "What 98 % of the distances to the plane span"],
      ["sub-pixel rms", `${number(found.subpixel_px, 3)} px`, "The same as slope, px per view step"],
    );
    if (found.accuracy_mm !== undefined) {
      rows.push(["z-accuracy", `${signed(found.accuracy_mm, 2)} mm`, "Distance of the plane less the true one"], ["z-accuracy", `${signed(found.accuracy_pct, 3)} %`]);
    }
  } else {
    rows.push(["slope", `${number(found.slope_px, 3)} px`], ["flatness", `${number(found.flatness_px, 3)} px`], ["sub-pixel rms", `${number(found.subpixel_px, 3)} px`]);
  }
  rows.push(["pixels", String(found.pixels)]);
  list($("plane"), rows);
}

function drawVitals(shown) {
  const { header } = shown, { words } = app;
  const dropped = Object.values(header.dropped).reduce((sum, one) => sum + one, 0);
  const label = shown.label();
  if (label && (shown.answer_pct === undefined)) {
    let known = 0;
    for (let i = 0; i < label.length; i++) if (label[i]) known++;
    shown.answer_pct = (100 * known) / label.length;
  }
  $("fps").textContent = number(header.frames_per_s);
  $("measuring").textContent = `${number(header.measuring_ms, 0)} ms`;
  $("age").textContent = words.age_ms == null ? "–" : `${number(header.latency_ms + words.age_ms, 0)} ms`;
  $("answer").textContent = `${number(shown.answer_pct, 0)} %`;
  $("drops").textContent = String(dropped);
  const first = app.draws[0], last = app.draws.at(-1);
  const exposures = header.views.map((one) => one.exposure_ms).filter((one) => one !== null);
  list($("run"), [
    ["depth by", header.curve ?? "slopes only"],
    ["rectified by", header.calibration === null ? "nothing" : `calibration ${header.calibration}`],
    ["frame", String(header.frame)],
    ["taken", new Date(header.time_ms).toLocaleTimeString([], { hour12: false })],
    ["shown here", `${number(last > first ? (1000 * (app.draws.length - 1)) / (last - first) : NaN)} fps`],
    ["to this page", words.age_ms == null ? "–" : `${number(words.age_ms)} ms`],
    ["left out here", String(words.skipped ?? 0)],
    ["skew", `${number(header.skew_ms, 2)} ms`],
    ...(exposures.length ? [["exposure", `${number(Math.min(...exposures), 2)} ms`]] : []),
    ...(header.temperature_degc === null ? [] : [["camera", `${number(header.temperature_degc)} °C`]]),
    ["pages", String(words.pages ?? 1)],
    ...Object.entries(header.dropped).filter(([, count]) => count).map(([why, count]) => [`dropped: ${why}`, String(count)]),
  ]);
  const told = header.warnings.join("\n");
  if ($("warnings").dataset.told !== told) {
    $("warnings").dataset.told = told;
    $("warnings").replaceChildren(...header.warnings.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  }
}

// ---- how the link is

function stateIs(state, text = null) {
  app.state = state;
  tell(text, state === "lost" || state === "ended" ? "bad" : "");
  showState();
}

function showState() {
  const quiet_s = (performance.now() - app.came) / 1000;
  const isStale = app.state === "open" && app.shown && !app.other && !app.isFrozen && quiet_s * 1000 > STALE_MS;
  const name = app.state !== "open" ? app.state : app.isFrozen ? "frozen" : !app.shown && !app.other ? "waiting" : isStale ? `no frame for ${quiet_s.toFixed(0)} s` : "live";
  $("state").textContent = name;
  $("lamp").dataset.state = app.state !== "open" ? app.state : app.isFrozen ? "frozen" : isStale ? "stale" : app.shown || app.other ? "live" : "waiting";
}
setInterval(showState, 500);

function tell(text, kind = "") {
  $("notice").hidden = !text;
  $("notice").textContent = text ?? "";
  $("notice").dataset.kind = kind;
  clearTimeout(app.notice);
  if (text && kind !== "bad") app.notice = setTimeout(() => tell(null), 6000);
}

function heard(words) {
  Object.assign(app.words, words);
  if ("answer" in words) tell(words.answer, words.done ? "good" : "bad");
  if (!("recording" in words)) return;
  for (const name of ["save", "record"]) $(name).classList.toggle("cannot", words[name] !== null);
  $("record").setAttribute("aria-pressed", String(words.recording));
  $("record").querySelector("span").textContent = words.recording ? "Stop" : "Record";
}

// ---- what a person does

function show(name) {
  app.shows = name;
  for (const tab of $("tabs").children) tab.setAttribute("aria-selected", String(tab.dataset.shows === name));
  tellEmpty(app.shown ? null : "Waiting for the first frame");
  want();
  schedule();
}

// Colour is three times the bytes of a grey picture: it comes while it is looked at. Looks at the cameras are few: they come when there are more.
function want() {
  const wants = ["views", "sigma", "label", "slope", "rectified"];
  if (app.shows === "picture" || app.shows === "cloud") wants.push("colour");
  if (app.shown && drift.isBehind(app.shown.header)) wants.push("drift");
  if (String(wants) !== String(app.link.wants)) app.link.want(wants);
}

function take(tool) {
  app.tool = tool;
  app.drag = null;
  for (const one of $("tools").children) one.setAttribute("aria-checked", String(one.dataset.tool === tool));
}

function freeze() {
  app.isFrozen = !app.isFrozen;
  app.link.freeze(app.isFrozen || document.hidden);
  $("freeze").setAttribute("aria-pressed", String(app.isFrozen));
  $("freeze").querySelector("span").textContent = app.isFrozen ? "Go on" : "Freeze";
  $("frozen").hidden = !app.isFrozen;
  $("frozen").textContent = `frozen at ${new Date().toLocaleTimeString([], { hour12: false })}`;
  app.came = performance.now();
  showState();
}

function press(name) {
  const why = app.words[name];
  if (why) return tell(why, "bad");
  app.link.say({ do: name === "record" && app.words.recording ? "stop" : name });
}

function hold() {
  app.isHeld = !app.isHeld;
  $("legend").setAttribute("aria-pressed", String(app.isHeld));
}

function toggleZebra() {
  views.hasZebra = !views.hasZebra;
  $("zebra").setAttribute("aria-pressed", String(views.hasZebra));
  schedule();
}

function forget() { views.best = views.best.map(() => 0); }

function pixelAt(event) {
  const box = $("plate").getBoundingClientRect(), { width, height } = app.shown;
  const into = (value, count) => Math.max(0, Math.min(count - 1, Math.floor(value)));
  return { x: into(((event.clientX - box.left) / box.width) * width, width), y: into(((event.clientY - box.top) / box.height) * height, height) };
}

const region = (a, b) => ({ left: Math.min(a.x, b.x), right: Math.max(a.x, b.x), top: Math.min(a.y, b.y), bottom: Math.max(a.y, b.y) });

function extend(to) {
  const { marks, drag, tool } = app;
  marks.cursor = to;
  if (!drag) return;
  if (tool === "line") marks.line = { from: drag, to };
  if (tool === "region") marks.region = region(drag, to);
}

$("over").addEventListener("pointerdown", (event) => {
  if (!app.shown) return;
  $("over").setPointerCapture(event.pointerId);
  $("over").focus({ preventScroll: true });
  const at = pixelAt(event);
  app.drag = at;
  if (app.tool === "point") app.marks.isPinned = event.pointerType === "mouse" ? !app.marks.isPinned : true;
  app.marks.cursor = at;
  drawMarks();
});
$("over").addEventListener("pointermove", (event) => {
  if (!app.shown || (!app.drag && (app.marks.isPinned || app.tool !== "point"))) return;
  extend(pixelAt(event));
  drawMarks();
});
for (const name of ["pointerup", "pointercancel"]) $("over").addEventListener(name, () => { app.drag = null; });

function move(dx, dy) {
  const { marks, shown } = app;
  if (!shown || !marks.cursor) return;
  const within = (value, count) => Math.max(0, Math.min(count - 1, value));
  marks.isPinned = true;
  extend({ x: within(marks.cursor.x + dx, shown.width), y: within(marks.cursor.y + dy, shown.height) });
  drawMarks();
}

function arrow(dx, dy, isFast) {
  if (app.shows === "cloud") return cloud.turn(-0.06 * dx * (isFast ? 4 : 1), -0.06 * dy * (isFast ? 4 : 1));
  move(dx * (isFast ? 10 : 1), dy * (isFast ? 10 : 1));
}

function letGo() {
  Object.assign(app.marks, { isPinned: false, line: null, region: null });
  app.drag = null;
  drawMarks();
}

const KEYS = {
  1: () => show("depth"), 2: () => show("sigma"), 3: () => show("label"), 4: () => show("picture"), 5: () => show("cloud"),
  p: () => take("point"), l: () => take("line"), g: () => take("region"),
  " ": freeze, s: () => press("save"), r: () => press("record"), h: hold, z: toggleZebra, b: forget,
  "?": () => $("keys").showModal(), escape: letGo,
  enter: () => { app.drag = app.drag || app.tool === "point" ? null : { ...app.marks.cursor }; },
  "+": () => cloud.closer(1.15), "=": () => cloud.closer(1.15), "-": () => cloud.closer(1 / 1.15), 0: () => { cloud.front(); schedule(); },
  arrowleft: (fast) => arrow(-1, 0, fast), arrowright: (fast) => arrow(1, 0, fast), arrowup: (fast) => arrow(0, -1, fast), arrowdown: (fast) => arrow(0, 1, fast),
};
window.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "INPUT" || $("keys").open) return;
  const key = event.key.toLowerCase();
  if (key === "enter" && event.target.tagName === "BUTTON") return;
  const act = KEYS[key];
  if (!act) return;
  event.preventDefault();
  act(event.shiftKey);
});

for (const tab of $("tabs").children) tab.addEventListener("click", () => show(tab.dataset.shows));
for (const tool of $("tools").children) tool.addEventListener("click", () => take(tool.dataset.tool));
for (const [id, act] of Object.entries({ freeze, save: () => press("save"), record: () => press("record"), help: () => $("keys").showModal(), legend: hold, zebra: toggleZebra, best: forget })) {
  $(id).addEventListener("click", act);
}
$("drift-by").addEventListener("click", () => {
  drift.isByWarmth = !drift.isByWarmth;
  $("drift-by").setAttribute("aria-pressed", String(drift.isByWarmth));
  schedule();
});
$("truth").addEventListener("input", drawMarks);
window.addEventListener("resize", () => schedule());
isDark.addEventListener("change", () => { $("legend").dataset.key = ""; schedule(); });
// Nobody sees a hidden page: it takes nothing until it is seen again.
document.addEventListener("visibilitychange", () => app.link.freeze(app.isFrozen || document.hidden));

app.link = new Link({ onFrame: took, onWords: heard, onState: stateIs });
want();
// For the console, and for whoever tests the page.
window.rig = { app, readAt, qualityOf, alongLine, sharpness, smallestEigenvector, Rays, move, show, cloud };
