// What a region of a map says of a flat thing. Formulae: docs/reference/depth-quality.md.

// Points (x, y, z) of pixels in the reference camera's frame, mm.
class Rays {
  constructor(camera) {
    this.focal = camera.focal_px;
    [this.cx, this.cy] = camera.principal_point_px;
    this.rotation = camera.common_from_reference;
  }
  // Direction of a pixel with z = 1.
  at(x, y) {
    const ray = [(x - this.cx) / this.focal, (y - this.cy) / this.focal, 1];
    const turned = [0, 1, 2].map((c) => ray.reduce((sum, one, r) => sum + one * this.rotation[r][c], 0));
    return [turned[0] / turned[2], turned[1] / turned[2], 1];
  }
}

// Eigenvector of the smallest eigenvalue of a symmetric 3 x 3 matrix, by Jacobi's rotations.
function smallestEigenvector(matrix) {
  const a = matrix.map((row) => [...row]);
  const v = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  for (let sweep = 0; sweep < 30; sweep++) {
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]]) {
      if (a[p][q] === 0) continue;
      const theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
      const t = (theta < 0 ? -1 : 1) / (Math.abs(theta) + Math.hypot(theta, 1));
      const c = 1 / Math.hypot(t, 1), s = t * c;
      for (let k = 0; k < 3; k++) [a[k][p], a[k][q]] = [c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]];
      for (let k = 0; k < 3; k++) [a[p][k], a[q][k]] = [c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]];
      for (let k = 0; k < 3; k++) [v[k][p], v[k][q]] = [c * v[k][p] - s * v[k][q], s * v[k][p] + c * v[k][q]];
    }
  }
  const least = [0, 1, 2].reduce((best, i) => (a[i][i] < a[best][best] ? i : best), 0);
  return v.map((row) => row[least]);
}

function percentile(sorted, share) {
  const place = share * (sorted.length - 1), low = Math.floor(place);
  const high = Math.min(low + 1, sorted.length - 1);
  return sorted[low] + (place - low) * (sorted[high] - sorted[low]);
}

const rms = (values) => Math.sqrt(values.reduce((sum, one) => sum + one * one, 0) / values.length);

// Flatness of residuals: what 98 % of them span.
function spread98(residuals) {
  const sorted = Float64Array.from(residuals).sort();
  return percentile(sorted, 0.99) - percentile(sorted, 0.01);
}

// All pixels of a region (corners included) that have an answer which was measured.
function answered(shown, region) {
  const map = shown.map(), label = shown.label(), found = [];
  let total = 0;
  for (let y = region.top; y <= region.bottom; y++) {
    for (let x = region.left; x <= region.right; x++) {
      total++;
      const i = y * shown.width + x;
      if (!Number.isNaN(map[i]) && (!label || label[i] !== 4)) found.push([x, y, map[i]]);
    }
  }
  return { found, total };
}

// Least squares of the distance to the plane, in mm; needs the pinhole camera.
function planeOfDepth(found, rays, slopePerInverse, region) {
  const points = found.map(([x, y, z]) => { const ray = rays.at(x, y); return [ray[0] * z, ray[1] * z, z]; });
  const middle = [0, 1, 2].map((k) => points.reduce((sum, p) => sum + p[k], 0) / points.length);
  const moments = [0, 1, 2].map((r) => [0, 1, 2].map((c) =>
    points.reduce((sum, p) => sum + (p[r] - middle[r]) * (p[c] - middle[c]), 0)));
  let normal = smallestEigenvector(moments);
  if (normal[2] < 0) normal = normal.map((one) => -one);
  const offset = normal.reduce((sum, one, k) => sum + one * middle[k], 0);
  const away = points.map((p) => p[0] * normal[0] + p[1] * normal[1] + p[2] * normal[2] - offset);
  const depthOn = (ray) => offset / (normal[0] * ray[0] + normal[1] * ray[1] + normal[2]);
  const subpixel = found.map(([x, y, z]) => slopePerInverse * (1 / z - 1 / depthOn(rays.at(x, y))));
  return {
    rms_mm: rms(away),
    flatness_mm: spread98(away),
    subpixel_px: rms(subpixel),
    distance_mm: depthOn(rays.at((region.left + region.right) / 2, (region.top + region.bottom) / 2)),
    tilt_deg: (180 / Math.PI) * Math.acos(Math.min(1, normal[2])),
  };
}

// Without depth: slope = a + b x + c y by least squares, px per view step.
function planeOfSlope(found) {
  const n = found.length;
  const mean = [0, 1, 2].map((k) => found.reduce((sum, one) => sum + one[k], 0) / n);
  let xx = 0, xy = 0, yy = 0, xm = 0, ym = 0;
  for (const [x, y, m] of found) {
    const dx = x - mean[0], dy = y - mean[1], dm = m - mean[2];
    xx += dx * dx; xy += dx * dy; yy += dy * dy; xm += dx * dm; ym += dy * dm;
  }
  const det = xx * yy - xy * xy;
  const b = (xm * yy - ym * xy) / det, c = (ym * xx - xm * xy) / det;
  const off = found.map(([x, y, m]) => m - mean[2] - b * (x - mean[0]) - c * (y - mean[1]));
  return { subpixel_px: rms(off), flatness_px: spread98(off), slope_px: mean[2] };
}

// Everything about one region; `why` says what is missing.
function qualityOf(shown, region, truth_mm) {
  const { found, total } = answered(shown, region);
  const result = { pixels: total, fill_pct: (100 * found.length) / total };
  const spans = (k) => new Set(found.map((one) => one[k])).size > 2;
  if (found.length < 12 || !spans(0) || !spans(1)) return { ...result, why: "too few pixels with an answer" };
  if (!shown.isDepth) return { ...result, ...planeOfSlope(found) };
  const { camera, pitch_mm } = shown.header;
  if (!camera) return { ...result, why: "the focal length is unknown: run rig calibrate" };
  const plane = planeOfDepth(found, new Rays(camera), camera.focal_px * pitch_mm, region);
  if (truth_mm > 0) {
    plane.accuracy_mm = plane.distance_mm - truth_mm;
    plane.accuracy_pct = (100 * plane.accuracy_mm) / truth_mm;
  }
  return { ...result, ...plane };
}
