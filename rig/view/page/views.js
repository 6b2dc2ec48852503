// All views as the cameras gave them: is each in focus, is each well exposed?
const CLIPPED = 254;
const ZEBRA = { bright: pixel(255, 45, 85), dark: pixel(64, 120, 255) };

// Contrast of fine structure in the middle half of a picture: root mean square of the Laplacian over
// the mean grey value, per cent. It is largest where the lens is in focus; only ratios mean anything.
function sharpness(data, width, height) {
  let squares = 0, sum = 0, count = 0;
  const x0 = Math.max(1, width >> 2), x1 = Math.min(width - 1, width - (width >> 2));
  for (let y = Math.max(1, height >> 2); y < Math.min(height - 1, height - (height >> 2)); y++) {
    for (let i = y * width + x0; i < y * width + x1; i++) {
      const bend = 4 * data[i] - data[i - 1] - data[i + 1] - data[i - width] - data[i + width];
      squares += bend * bend;
      sum += data[i];
      count++;
    }
  }
  return sum > 0 ? (100 * Math.sqrt(squares / count)) / (sum / count) : 0;
}

function exposure(data) {
  let bright = 0, dark = 0, sum = 0;
  for (let i = 0; i < data.length; i++) {
    if (data[i] >= CLIPPED) bright++;
    else if (data[i] === 0) dark++;
    sum += data[i];
  }
  return { mean: sum / data.length, bright_pct: (100 * bright) / data.length, dark_pct: (100 * dark) / data.length };
}

class Views {
  constructor(root) {
    this.root = root;
    this.cards = [];
    this.best = [];
    this.hasZebra = true;
    this.measured = 0;
  }
  // Views stand as the cameras do, where that is a small grid; else one after another.
  build(header) {
    const columns = [...new Set(header.x_steps.map((x) => Math.round(x)))].sort((a, b) => a - b);
    const rows = [...new Set(header.y_steps.map((y) => Math.round(y)))].sort((a, b) => a - b);
    const places = header.x_steps.map((x, i) => [columns.indexOf(Math.round(x)), rows.indexOf(Math.round(header.y_steps[i]))]);
    const isGrid = columns.length <= 3 && rows.length <= 3 && new Set(places.map(String)).size === places.length;
    this.root.replaceChildren();
    this.root.style.gridTemplateColumns = isGrid ? `repeat(${columns.length}, minmax(0, 1fr))` : "";
    this.best = header.views.map(() => 0);
    this.cards = header.views.map((view, i) => {
      const card = document.createElement("figure");
      card.innerHTML = '<div class="pic"><canvas></canvas><span class="clip"></span></div><figcaption><span class="name"></span><span class="score"></span></figcaption><div class="meter"><i></i><b></b></div>';
      if (isGrid) [card.style.gridColumn, card.style.gridRow] = places[i].map((one) => one + 1);
      card.classList.toggle("reference", i === header.reference);
      card.querySelector(".name").textContent = view.name;
      this.root.append(card);
      return { card, plate: new Plate(card.querySelector("canvas")), score: card.querySelector(".score"), clip: card.querySelector(".clip"), bar: card.querySelector("i"), mark: card.querySelector("b") };
    });
    this.built = this.keyOf(header);
  }
  keyOf({ views, x_steps, y_steps }) { return JSON.stringify([views.map((one) => one.name), x_steps, y_steps]); }
  draw(shown) {
    const { header, arrays } = shown;
    if (!arrays.view_0) return;
    if (this.built !== this.keyOf(header)) this.build(header);
    const now = performance.now(), isDue = now - this.measured > 200;
    if (isDue) this.measured = now;
    this.cards.forEach((card, i) => {
      const { data, shape: [height, width] } = arrays[`view_${i}`];
      this.picture(card.plate, data, width, height);
      if (isDue) this.judge(card, i, data, width, height);
    });
  }
  picture(plate, data, width, height) {
    const thin = Math.max(1, Math.floor(width / 320)), w = Math.floor(width / thin), h = Math.floor(height / thin);
    const pixels = plate.sized(w, h);
    for (let y = 0, k = 0; y < h; y++) {
      for (let x = 0, i = y * thin * width; x < w; x++, i += thin, k++) {
        const grey = data[i], isStripe = ((x + y) & 7) < 4;
        pixels[k] = this.hasZebra && isStripe && grey >= CLIPPED ? ZEBRA.bright
          : this.hasZebra && isStripe && grey === 0 ? ZEBRA.dark : GREYS[grey];
      }
    }
    plate.context.putImageData(plate.image, 0, 0);
  }
  judge(card, i, data, width, height) {
    const score = sharpness(data, width, height), { mean, bright_pct, dark_pct } = exposure(data);
    this.best[i] = Math.max(this.best[i], score);
    card.score.textContent = score.toFixed(1);
    card.score.title = "Sharpness: contrast of fine structure, per cent of the mean grey value";
    card.bar.style.width = `${this.best[i] ? (100 * score) / this.best[i] : 0}%`;
    card.bar.classList.toggle("off", score < 0.9 * this.best[i]);
    const clipped = bright_pct >= 0.05 || dark_pct >= 0.05;
    card.clip.textContent = clipped ? [bright_pct >= 0.05 ? `▲ ${bright_pct.toFixed(1)} %` : "", dark_pct >= 0.05 ? `▼ ${dark_pct.toFixed(1)} %` : ""].join(" ").trim() : "";
    card.clip.title = "Share of pixels that are white (▲) or black (▼)";
    card.card.title = `mean grey ${mean.toFixed(0)} of 255`;
  }
}
