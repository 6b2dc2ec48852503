// Colours of values: near is warm and far is cool, as in the pictures that rig writes.
const TURBO = ramp("30123b 4040a2 466be3 4294ff 28bceb 18ddc2 32f298 6dfe62 a4fc3c cbed34 ecd13a fdae35 fb8122 ec530f d23105 ac1701 7a0403");
const VIRIDIS = ramp("440154 472d7b 3b528b 2c728e 21918c 27ad81 5cc863 aadc32 fde725");
const LABELS = [
  ["no answer", 0x2c3138], ["nearer than focus", 0xf28e3b], ["beyond focus", 0x3f7fd0],
  ["at an occlusion", 0xe6d34a], ["filled", 0x9b6fd1],
];
const NONE = { dark: 0xff2b2622, light: 0xffd6d1cc };

// 256 colours (little-endian ABGR, as canvas pixels are) through stops that are evenly spaced.
function ramp(stops) {
  const rgb = stops.split(" ").map((hex) => parseInt(hex, 16));
  return Uint32Array.from({ length: 256 }, (_, i) => {
    const place = (i / 255) * (rgb.length - 1), low = Math.min(Math.floor(place), rgb.length - 2);
    const mix = (shift) => {
      const a = (rgb[low] >> shift) & 255, b = (rgb[low + 1] >> shift) & 255;
      return Math.round(a + (place - low) * (b - a));
    };
    return pixel(mix(16), mix(8), mix(0));
  });
}

function pixel(red, green, blue) { return ((255 << 24) | (blue << 16) | (green << 8) | red) >>> 0; }
const fromHex = (hex) => pixel(hex >> 16, (hex >> 8) & 255, hex & 255);
const LABEL_PIXELS = LABELS.map(([, hex]) => fromHex(hex));
const GREYS = Uint32Array.from({ length: 256 }, (_, i) => pixel(i, i, i));

// The middle 98 % of values, by a sample of them.
function robustRange(values) {
  const step = Math.max(1, Math.floor(values.length / 6000) | 1), some = [];
  for (let i = 0; i < values.length; i += step) if (!Number.isNaN(values[i])) some.push(values[i]);
  if (some.length < 2) return null;
  const sorted = Float64Array.from(some).sort();
  const low = percentile(sorted, 0.01), high = percentile(sorted, 0.99);
  return high > low ? [low, high] : [low - 0.5, low + 0.5];
}

// Round numbers between two values, about so many.
function ticksBetween(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((m) => m * power).find((one) => one >= rough);
  const ticks = [];
  for (let one = Math.ceil(low / step) * step; one <= high + 1e-9 * step; one += step) ticks.push(one);
  return { ticks, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}
