// Pictures and maps on a canvas, pixel by pixel.
class Plate {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
  }
  sized(width, height) {
    if (this.canvas.width !== width || this.canvas.height !== height || !this.image) {
      this.canvas.width = width;
      this.canvas.height = height;
      this.image = this.context.createImageData(width, height);
      this.pixels = new Uint32Array(this.image.data.buffer);
    }
    return this.pixels;
  }
  values(values, width, height, colours, [low, high], isTurned, none) {
    const pixels = this.sized(width, height), scale = 255 / (high - low);
    for (let i = 0; i < pixels.length; i++) {
      const value = values[i];
      if (value !== value) { pixels[i] = none; continue; }
      let level = ((value - low) * scale) | 0;
      level = level < 0 ? 0 : level > 255 ? 255 : level;
      pixels[i] = colours[isTurned ? 255 - level : level];
    }
    this.context.putImageData(this.image, 0, 0);
  }
  rgb(data, width, height) {
    const pixels = this.sized(width, height);
    for (let i = 0, k = 0; i < pixels.length; i++, k += 3) pixels[i] = pixel(data[k], data[k + 1], data[k + 2]);
    this.context.putImageData(this.image, 0, 0);
  }
  codes(codes, width, height, colours) {
    const pixels = this.sized(width, height);
    for (let i = 0; i < pixels.length; i++) pixels[i] = colours[codes[i]];
    this.context.putImageData(this.image, 0, 0);
  }
}

// A canvas that is as sharp as the screen.
function fitted(canvas, width, height) {
  const ratio = window.devicePixelRatio || 1;
  const w = Math.max(1, Math.round(width * ratio)), h = Math.max(1, Math.round(height * ratio));
  if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return context;
}

function ink(name) { return getComputedStyle(document.body).getPropertyValue(name).trim(); }

// Cursor, line and region over the map.
function drawOverlay(canvas, box, shown, marks) {
  const context = fitted(canvas, box.width, box.height);
  if (!shown) return;
  const sx = box.width / shown.width, sy = box.height / shown.height;
  const at = ({ x, y }) => [(x + 0.5) * sx, (y + 0.5) * sy];
  const twice = (path) => {
    for (const [style, width] of [["rgba(0,0,0,.65)", 3.5], ["#fff", 1.4]]) {
      context.strokeStyle = style;
      context.lineWidth = width;
      context.stroke(path);
    }
  };
  if (marks.line) {
    const path = new Path2D(), [x0, y0] = at(marks.line.from), [x1, y1] = at(marks.line.to);
    path.moveTo(x0, y0); path.lineTo(x1, y1);
    path.moveTo(x0 + 4, y0); path.arc(x0, y0, 4, 0, 7);
    twice(path);
  }
  if (marks.region) {
    const { left, top, right, bottom } = marks.region, path = new Path2D();
    path.rect(left * sx, top * sy, (right + 1 - left) * sx, (bottom + 1 - top) * sy);
    context.fillStyle = "rgba(255,255,255,.13)";
    context.fill(path);
    twice(path);
  }
  if (marks.cursor) {
    const [x, y] = at(marks.cursor), path = new Path2D(), gap = 7, arm = 15;
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      path.moveTo(x + gap * dx, y + gap * dy);
      path.lineTo(x + arm * dx, y + arm * dy);
    }
    if (marks.isPinned) { path.moveTo(x + gap, y); path.arc(x, y, gap, 0, 7); }
    twice(path);
  }
}
