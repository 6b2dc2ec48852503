// Epipolar-plane images through the cursor: the same row (or column) of all views, each at its place.
const EPI_REACH_PX = 48;

class Epi {
  constructor(canvas, caption, along) {
    this.canvas = canvas;
    this.caption = caption;
    this.isRow = along === "row";
    this.strip = document.createElement("canvas");
    this.plate = new Plate(this.strip);
  }
  // Views on this axis, in their order.
  members({ x_steps, y_steps }) {
    const [along, across] = this.isRow ? [x_steps, y_steps] : [y_steps, x_steps];
    return along.map((step, i) => ({ step, i })).filter(({ i }) => Math.abs(across[i]) < 0.25).sort((a, b) => a.step - b.step);
  }
  draw(shown, cursor) {
    const members = this.members(shown.header), first_view = shown.epipolar(0);
    const box = this.canvas.getBoundingClientRect();
    const letter = this.isRow ? "H" : "V";
    if (!first_view || members.length < 2 || !cursor || box.width < 10) {
      fitted(this.canvas, box.width, box.height);
      this.caption.textContent = `${letter}  ${members.length < 2 ? "one view only" : cursor ? "–" : "no cursor"}`;
      return;
    }
    const at = shown.inPictures(cursor);
    const [height, width] = first_view.shape, centre = this.isRow ? at.x : at.y, length = this.isRow ? width : height;
    const reach = Math.min(EPI_REACH_PX, length >> 1), first = Math.max(0, Math.min(length - 2 * reach, centre - reach));
    const pixels = this.plate.sized(2 * reach, members.length);
    members.forEach(({ i }, row) => {
      const view = shown.epipolar(i).data;
      for (let k = 0; k < 2 * reach; k++) {
        const x = this.isRow ? first + k : at.x, y = this.isRow ? at.y : first + k;
        pixels[row * 2 * reach + k] = GREYS[view[y * width + x] ?? 0];
      }
    });
    this.plate.context.putImageData(this.plate.image, 0, 0);
    const context = fitted(this.canvas, box.width, box.height);
    context.imageSmoothingEnabled = false;
    // Every view lies at its own place, so that a point of the scene draws a straight line.
    const first_step = members[0].step, gaps = members.slice(1).map(({ step }, k) => step - members[k].step);
    const least = Math.min(...gaps), whole = members.at(-1).step - first_step + least, px = box.width / (2 * reach);
    const thick = (box.height * least) / whole, middle = (step) => (box.height * (step - first_step + least / 2)) / whole;
    members.forEach(({ step }, row) => context.drawImage(this.strip, 0, row, 2 * reach, 1, 0, middle(step) - thick / 2 + 0.5, box.width, thick - 1));
    const slope = shown.slope()?.[cursor.y * shown.width + cursor.x];
    this.caption.textContent = `${letter}  ${this.isRow ? `row y = ${at.y}` : `column x = ${at.x}`}  ·  ${Number.isFinite(slope) ? `slope ${signed(slope, 3)} px per step` : "no answer here"}`;
    if (!Number.isFinite(slope)) return;
    const path = new Path2D();
    for (const [row, step] of [first_step, members.at(-1).step].entries()) {
      const x = (centre - slope * step - first + 0.5) * px;
      if (row === 0) path.moveTo(x, middle(step)); else path.lineTo(x, middle(step));
    }
    for (const { step } of members) {
      const x = (centre - slope * step - first + 0.5) * px;
      path.moveTo(x + 3, middle(step));
      path.arc(x, middle(step), 3, 0, 7);
    }
    for (const [style, wide] of [["rgba(0,0,0,.6)", 4], [ink("--accent"), 2]]) {
      context.strokeStyle = style;
      context.lineWidth = wide;
      context.stroke(path);
    }
  }
}

const signed = (value, digits) => (value < 0 ? "−" : "+") + Math.abs(value).toFixed(digits);
