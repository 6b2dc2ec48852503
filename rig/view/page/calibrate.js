// A calibration: corners as found in every view, the parts that are covered, what to show next.
class Calibrate {
  constructor() { this.views = new Views($("cal-views")); this.views.hasZebra = false; }
  draw({ header, arrays }) {
    if (this.views.built !== this.views.keyOf(header)) this.views.build(header);
    header.views.forEach((_, i) => {
      const found = arrays[`view_${i}`];
      if (found) this.drawView(header, i, found.data, found.shape[1], found.shape[0]);
    });
    $("advice").textContent = header.advice;
    const seen = header.corners.filter((one) => one.length).length;
    list($("cal-facts"), [
      ["target", `in ${seen} of ${header.views.length} views`],
      ["held", header.moving ? "moving" : "still"],
      ["kept", String(header.kept)],
    ]);
    const problems = header.problems.flatMap((why, i) => (why ? [`${header.views[i].name}: ${why}`] : []));
    $("cal-problems").replaceChildren(...problems.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
    const { errors } = header;
    $("cal-errors").hidden = errors.length < 2;
    $("cal-hint").textContent = errors.length ? `${errors.at(-1)[1].toFixed(3)} % after ${errors.at(-1)[0]} pictures` : "It appears with the first solve, after twelve pictures.";
    if (errors.length > 1) drawChart($("cal-errors"), errors.map(([x, y]) => ({ x, y })), errors);
  }
  drawView(header, i, data, width, height) {
    const card = this.views.cards[i], { plate } = card;
    this.views.picture(plate, data, width, height);
    this.views.judge(card, i, data, width, height);
    const { context, canvas } = plate, sx = canvas.width / width, sy = canvas.height / height;
    const cells = header.cells?.[i] ?? [];
    context.fillStyle = "rgba(76, 195, 138, .28)";
    cells.forEach((row, y) => row.forEach((isSeen, x) => {
      if (isSeen) context.fillRect((x * canvas.width) / row.length + 1, (y * canvas.height) / cells.length + 1, canvas.width / row.length - 2, canvas.height / cells.length - 2);
    }));
    context.fillStyle = header.moving ? "#ffd166" : "#ff6b35";
    for (const [x, y] of header.corners[i]) context.fillRect((x + 0.5) * sx - 1.5, (y + 0.5) * sy - 1.5, 3, 3);
  }
}
