// A sweep: the board as it is seen, the plan, the curve as it grows, the errors where it was not fitted.
class Sweep {
  constructor() {
    this.views = new Views($("sweep-views"));
    this.board = new Plate($("board"));
    this.asked = null;
    $("ask").addEventListener("submit", (event) => {
      event.preventDefault();
      $("put").disabled = true;
      app.link.say({ do: "put", reading: $("reading").value.trim() });
    });
  }
  // Enter in the field is the button: somebody with a board in the hands finds it without looking.
  ask(question) {
    $("ask").hidden = !question;
    if (!question || question.number === this.asked) return;
    this.asked = question.number;
    $("put").disabled = false;
    $("ask-text").textContent = question.text;
    $("reading").value = "";
    $("reading").focus();
  }
  draw({ header, arrays }) {
    this.views.draw({ header, arrays });
    this.drawBoard(header, arrays.image);
    this.drawPlan(header);
    this.drawCurve(header);
    this.drawErrors(header);
    this.ask(header.asked);
    this.tell(header);
  }
  drawBoard({ corners, outline, problem }, image) {
    $("board-empty").hidden = Boolean(image);
    if (!image) return;
    const [height, width] = image.shape;
    $("board-plate").style.aspectRatio = `${width} / ${height}`;
    this.board.codes(image.data, width, height, GREYS);
    const box = $("board-plate").getBoundingClientRect(), context = fitted($("board-over"), box.width, box.height);
    const at = ([x, y]) => [((x + 0.5) / width) * box.width, ((y + 0.5) / height) * box.height];
    const path = new Path2D();
    for (const corner of corners) {
      const [x, y] = at(corner);
      path.moveTo(x + 4, y);
      path.arc(x, y, 4, 0, 7);
    }
    const edge = new Path2D();
    outline.forEach((corner, k) => (k ? edge.lineTo(...at(corner)) : edge.moveTo(...at(corner))));
    if (outline.length) edge.closePath();
    for (const [style, wide] of [["rgba(0,0,0,.6)", 3.5], [ink("--accent"), 1.6]]) {
      context.strokeStyle = style;
      context.lineWidth = wide;
      context.stroke(path);
      context.stroke(edge);
    }
    $("problem").hidden = !problem;
    $("problem").textContent = problem ?? "";
  }
  drawPlan({ stops, at, done, samples }) {
    const canvas = $("plan"), box = canvas.getBoundingClientRect(), context = fitted(canvas, box.width, box.height);
    const all = stops.map(({ mm }) => mm), low = Math.min(...all), high = Math.max(...all), next = at === null ? 0 : at + 1;
    const px = (mm) => 14 + ((box.width - 28) * (mm - low)) / (high - low || 1);
    context.font = `11px ${ink("--mono")}`;
    context.fillStyle = ink("--quiet");
    for (const [mm, align] of [[low, "left"], [high, "right"]]) {
      context.textAlign = align;
      context.fillText(`${mm.toFixed(0)} mm`, px(mm) + (align === "left" ? -12 : 12), box.height - 3);
    }
    stops.forEach(({ mm, role, direction }, k) => {
      const y = direction === "backward" ? 24 : 12, isDone = (k + 1) * samples <= done;
      context.beginPath();
      if (role === "holdout") context.rect(px(mm) - 4, y - 4, 8, 8);
      else context.arc(px(mm), y, 4.5, 0, 7);
      context.fillStyle = context.strokeStyle = k === at ? ink("--accent") : isDone ? ink("--good") : ink("--quiet");
      context.lineWidth = 1.5;
      if (isDone || k === at) context.fill();
      else context.stroke();
      if (k !== next || next >= stops.length || done >= stops.length * samples) return;
      context.beginPath();
      context.arc(px(mm), y, 8.5, 0, 7);
      context.strokeStyle = ink("--accent");
      context.stroke();
    });
  }
  drawCurve({ points, result }) {
    $("curve-hint").hidden = points.length > 1;
    const marks = points.map(({ mm, px, role }) => ({ x: mm, y: px, isHollow: role === "holdout" }));
    drawChart($("curve"), marks, result?.curve ?? []);
  }
  drawErrors({ result }) {
    const errors = result?.holdout ?? [];
    $("errors").hidden = !errors.length;
    $("errors-hint").hidden = Boolean(errors.length);
    $("errors-hint").textContent = result ? "Nothing was held out: nobody knows the error." : "They appear when the curve is fitted.";
    if (errors.length) drawChart($("errors"), errors.map(([x, y]) => ({ x, y, isHollow: true })), [[errors[0][0], 0], [errors.at(-1)[0], 0]]);
  }
  tell(header) {
    const { stops, at, sample, samples, done, total, failures, residual_px, result } = header, stop = at === null ? null : stops[at];
    $("sweep-value").textContent = stop ? `${stop.mm.toFixed(1)} mm` : "homing";
    const following = at === null ? stops[0] : stops[at + 1];
    list($("sweep-facts"), [
      ["stop", at === null ? `– of ${stops.length}` : `${at + 1} of ${stops.length}`],
      ["sample", sample === null ? "–" : `${sample + 1} of ${samples}`],
      ["role", stop ? `${stop.role}, ${stop.direction}` : "–"],
      ["next", following ? `${following.mm.toFixed(1)} mm` : "none"],
      ["taken", `${done} of ${total}`],
      ["measured", String(header.points.length)],
      ["without a slope", String(failures)],
      ["track residual", residual_px === null ? "–" : `${residual_px.toFixed(3)} px`],
    ]);
    $("headline").hidden = !result;
    if (!result) return;
    $("headline").textContent = result.headline;
    $("headline").dataset.kind = result.gates.length ? "bad" : "good";
    $("gates").replaceChildren(...result.gates.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  }
}

// Marks and a line over round numbers.
function drawChart(canvas, marks, line) {
  const box = canvas.getBoundingClientRect(), context = fitted(canvas, box.width, box.height);
  const all = [...marks.map(({ x, y }) => [x, y]), ...line];
  if (all.length < 2) return;
  const span = (k) => {
    const values = all.map((one) => one[k]), low = Math.min(...values), high = Math.max(...values);
    const room = 0.06 * (high - low) || 0.5;
    return [low - room, high + room];
  };
  const [x0, x1] = span(0), [y0, y1] = span(1), left = 52, right = box.width - 8, top = 8, bottom = box.height - 22;
  const px = (x) => left + ((right - left) * (x - x0)) / (x1 - x0), py = (y) => bottom - ((bottom - top) * (y - y0)) / (y1 - y0);
  context.font = `11px ${ink("--mono")}`;
  context.fillStyle = ink("--quiet");
  context.strokeStyle = ink("--line");
  context.textAlign = "right";
  const vertical = ticksBetween(y0, y1, 5), across = ticksBetween(x0, x1, 5);
  for (const tick of vertical.ticks) {
    context.beginPath(); context.moveTo(left, py(tick)); context.lineTo(right, py(tick)); context.stroke();
    context.fillText(tick.toFixed(vertical.digits).replace("-", "−"), left - 6, py(tick) + 4);
  }
  context.textAlign = "center";
  for (const tick of across.ticks) context.fillText(tick.toFixed(across.digits), px(tick), box.height - 6);
  context.strokeStyle = ink("--text");
  context.lineWidth = 1.2;
  const path = new Path2D();
  line.forEach(([x, y], k) => (k ? path.lineTo(px(x), py(y)) : path.moveTo(px(x), py(y))));
  context.stroke(path);
  context.strokeStyle = context.fillStyle = ink("--accent");
  context.lineWidth = 1.6;
  for (const { x, y, isHollow } of marks) {
    context.beginPath();
    context.arc(px(x), py(y), 4, 0, 7);
    if (isHollow) context.stroke();
    else context.fill();
  }
}
