// Values along a drawn line, with what they are sure of (k = 2).
function alongLine(shown, line) {
  const { from, to } = line, count = Math.max(2, Math.round(Math.hypot(to.x - from.x, to.y - from.y)) + 1);
  const map = shown.map(), sigma = shown.sigma();
  return Array.from({ length: count }, (_, k) => {
    const share = k / (count - 1);
    const x = Math.round(from.x + share * (to.x - from.x)), y = Math.round(from.y + share * (to.y - from.y));
    const i = y * shown.width + x;
    return { at: share * Math.hypot(to.x - from.x, to.y - from.y), value: map[i], sigma: sigma ? sigma[i] : 0 };
  });
}

function drawProfile(canvas, shown, line) {
  const box = canvas.getBoundingClientRect(), context = fitted(canvas, box.width, box.height);
  const samples = alongLine(shown, line), known = samples.filter((one) => !Number.isNaN(one.value));
  const left = 52, top = 8, right = box.width - 8, bottom = box.height - 22;
  context.font = `11px ${ink("--mono")}`;
  if (known.length < 2) {
    context.fillStyle = ink("--quiet");
    context.fillText("no answers along the line", left, box.height / 2);
    return;
  }
  const sorted = Float64Array.from(known.map((one) => one.value)).sort();
  const typical = Float64Array.from(known.map((one) => one.sigma)).sort();
  const room = Math.max(2.5 * percentile(typical, 0.5), 0.06 * (percentile(sorted, 0.98) - percentile(sorted, 0.02)), 1e-3);
  const low = percentile(sorted, 0.02) - room, high = percentile(sorted, 0.98) + room;
  const end = samples.at(-1).at;
  const px = (at) => left + ((right - left) * at) / end, py = (value) => bottom - ((bottom - top) * (value - low)) / (high - low);
  context.strokeStyle = ink("--line");
  context.fillStyle = ink("--quiet");
  context.lineWidth = 1;
  const vertical = ticksBetween(low, high, 4), across = ticksBetween(0, end, 6);
  context.textAlign = "right";
  for (const tick of vertical.ticks) {
    context.beginPath(); context.moveTo(left, py(tick)); context.lineTo(right, py(tick)); context.stroke();
    context.fillText(tick.toFixed(vertical.digits), left - 6, py(tick) + 4);
  }
  context.textAlign = "center";
  for (const tick of across.ticks) context.fillText(tick.toFixed(across.digits) + (tick === across.ticks.at(-1) ? " px" : ""), Math.min(px(tick), right - 14), box.height - 6);
  context.save();
  context.beginPath(); context.rect(left, top, right - left, bottom - top); context.clip();
  for (const run of runsOf(samples)) {
    const band = new Path2D();
    run.forEach((one, k) => (k ? band.lineTo(px(one.at), py(one.value + 2 * one.sigma)) : band.moveTo(px(one.at), py(one.value + 2 * one.sigma))));
    [...run].reverse().forEach((one) => band.lineTo(px(one.at), py(one.value - 2 * one.sigma)));
    context.globalAlpha = 0.22;
    context.fillStyle = ink("--accent");
    context.fill(band);
    context.globalAlpha = 1;
    const curve = new Path2D();
    run.forEach((one, k) => (k ? curve.lineTo(px(one.at), py(one.value)) : curve.moveTo(px(one.at), py(one.value))));
    if (run.length === 1) curve.lineTo(px(run[0].at) + 1, py(run[0].value));
    context.strokeStyle = ink("--accent");
    context.lineWidth = 1.6;
    context.stroke(curve);
  }
  context.restore();
}

// Stretches without a gap.
function runsOf(samples) {
  const runs = [[]];
  for (const one of samples) {
    if (Number.isNaN(one.value)) { if (runs.at(-1).length) runs.push([]); } else runs.at(-1).push(one);
  }
  return runs.filter((run) => run.length);
}
