// One message: see rig/view/wire.py.
const KINDS = { uint8: Uint8Array, uint16: Uint16Array, float32: Float32Array };

function decodeMessage(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {};
  for (const { name, type, shape, start } of header.arrays) {
    const count = shape.reduce((product, one) => product * one, 1);
    arrays[name] = { shape, data: new KINDS[type](buffer, 4 + length + start, count) };
  }
  return { header, arrays };
}

// A frame as the page asks about it: maps in their units, NaN where there is none.
class Shown {
  constructor({ header, arrays }) {
    this.header = header;
    this.arrays = arrays;
    this.isDepth = "depth" in arrays;
    const shape = (arrays.depth ?? arrays.slope).shape;
    [this.height, this.width] = shape;
    this.known = {};
  }
  map() { return this.unpacked(this.isDepth ? "depth" : "slope"); }
  sigma() { return this.unpacked("sigma"); }
  slope() { return this.unpacked("slope"); }
  label() { return this.arrays.label?.data ?? null; }
  unpacked(name) {
    if (!(name in this.arrays)) return null;
    return (this.known[name] ??= unpackSteps(this.arrays[name].data, this.header.steps[name]));
  }
  // The reference view at the pixels of the maps.
  picture() {
    if (this.arrays.image) return this.arrays.image.data;
    return this.arrays[`view_${this.header.reference}`]?.data ?? null;
  }
  // The same in red, green and blue; null where the camera is grey, or nobody asked for it.
  colour() { return this.arrays.colour?.data ?? null; }
  // The pixel of the pictures that a pixel of the maps shows: maps may be of a region, or coarser.
  inPictures({ x, y }) {
    const { x_px, y_px, step } = this.header.grid, middle = step >> 1;
    return { x: x_px + x * step + middle, y: y_px + y * step + middle };
  }
  // A view at the pixels that slopes are of: rectified, or as taken where there is no calibration.
  epipolar(index) {
    if (this.header.calibration === null) return this.arrays[`view_${index}`] ?? null;
    const all = this.arrays.rectified;
    if (!all) return null;
    const [, height, width] = all.shape, size = height * width;
    return { data: all.data.subarray(index * size, (index + 1) * size), shape: [height, width] };
  }
}

function unpackSteps(steps, { step, low }) {
  const values = new Float32Array(steps.length), before = low - step;
  for (let i = 0; i < steps.length; i++) values[i] = steps[i] === 0 ? NaN : before + steps[i] * step;
  return values;
}
