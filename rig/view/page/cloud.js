// The cloud: depth goes to the graphics card as it came, and becomes points there.
const CLOUD_VERTEX = `#version 300 es
precision highp float; precision highp int; precision highp usampler2D;
uniform usampler2D steps, grey;
uniform int width, thin, columns;
uniform float step_mm, focal_px, size_px, low_mm, high_mm;
uniform vec2 centre_px;
uniform mat3 turned;
uniform mat4 screen;
uniform sampler2D colours, rgb;
uniform bool paint;
out vec3 colour;
void main() {
  ivec2 at = ivec2(gl_VertexID % columns, gl_VertexID / columns) * thin;
  float z = (float(texelFetch(steps, at, 0).r) - 1.0) * step_mm;
  if (z <= 0.0) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  vec3 ray = turned * vec3((vec2(at) - centre_px) / focal_px, 1.0);
  vec3 point = ray * (z / ray.z);
  gl_Position = screen * vec4(point, 1.0);
  gl_PointSize = clamp(size_px / gl_Position.w, 1.0, 24.0);
  float level = float(texelFetch(grey, at, 0).r) / 255.0;
  float share = 1.0 - clamp((z - low_mm) / (high_mm - low_mm), 0.0, 1.0);
  colour = paint ? texture(colours, vec2(share, 0.5)).rgb * (0.35 + 0.65 * level) : texelFetch(rgb, at, 0).rgb;
}`;
const CLOUD_FRAGMENT = `#version 300 es
precision mediump float;
in vec3 colour; out vec4 result;
void main() { result = vec4(colour, 1.0); }`;

class Cloud {
  constructor(canvas, thin) {
    this.canvas = canvas;
    this.thin = thin;
    this.front();
    this.listen();
  }
  front() { this.yaw = 0.35; this.pitch = 0.2; this.near = 1; }
  // Returns why there is no cloud, or null.
  start() {
    if (this.gl) return null;
    const gl = this.canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) return "this browser has no WebGL 2";
    this.gl = gl;
    this.program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, CLOUD_VERTEX], [gl.FRAGMENT_SHADER, CLOUD_FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
    }
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS)) return `WebGL: ${gl.getProgramInfoLog(this.program)}`;
    gl.useProgram(this.program);
    this.places = new Proxy({}, { get: (kept, name) => (kept[name] ??= gl.getUniformLocation(this.program, name)) });
    this.textures = [0, 1, 2, 3].map(() => {
      const texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
      for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
      return texture;
    });
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    this.upload(2, gl.RGBA8, 256, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(TURBO.buffer));
    ["steps", "grey", "colours", "rgb"].forEach((name, unit) => gl.uniform1i(this.places[name], unit));
    gl.enable(gl.DEPTH_TEST);
    return null;
  }
  upload(unit, inside, width, height, format, type, data) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, this.textures[unit]);
    gl.texImage2D(gl.TEXTURE_2D, 0, inside, width, height, 0, format, type, data);
  }
  draw(shown, range) {
    if (!shown.isDepth) return "slopes only: a cloud needs a curve";
    const { camera } = shown.header;
    if (!camera) return "the focal length is unknown: run rig calibrate";
    const why = this.start();
    if (why) return why;
    const { gl, places } = this, { width, height } = shown, ratio = window.devicePixelRatio || 1;
    const box = this.canvas.getBoundingClientRect();
    this.canvas.width = Math.max(1, Math.round(box.width * ratio));
    this.canvas.height = Math.max(1, Math.round(box.height * ratio));
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    const back = ink("--plate").match(/\w\w/g).map((hex) => parseInt(hex, 16) / 255);
    gl.clearColor(back[0], back[1], back[2], 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.upload(0, gl.R16UI, width, height, gl.RED_INTEGER, gl.UNSIGNED_SHORT, shown.arrays.depth.data);
    this.upload(1, gl.R8UI, width, height, gl.RED_INTEGER, gl.UNSIGNED_BYTE, shown.picture());
    const inColour = shown.colour();
    if (inColour) this.upload(3, gl.RGB8, width, height, gl.RGB, gl.UNSIGNED_BYTE, inColour);
    const columns = Math.ceil(width / this.thin), rows = Math.ceil(height / this.thin), [low, high] = range ?? [0, 1];
    const screen = this.screen(camera, low, high), pixel_mm = 1.25 * this.thin;
    gl.uniform1i(places.width, width);
    gl.uniform1i(places.thin, this.thin);
    gl.uniform1i(places.columns, columns);
    gl.uniform1i(places.paint, inColour ? 0 : 1);
    gl.uniform1f(places.step_mm, shown.header.steps.depth.step);
    gl.uniform1f(places.focal_px, camera.focal_px);
    gl.uniform1f(places.low_mm, low);
    gl.uniform1f(places.high_mm, high);
    gl.uniform1f(places.size_px, (pixel_mm * ((low + high) / 2) * this.zoom * this.canvas.height) / (2 * camera.focal_px));
    gl.uniform2f(places.centre_px, ...camera.principal_point_px);
    // Rows of the rotation as columns: the rays are turned by its transpose.
    gl.uniformMatrix3fv(places.turned, false, camera.common_from_reference.flat());
    gl.uniformMatrix4fv(places.screen, false, screen);
    gl.drawArrays(gl.POINTS, 0, columns * rows);
    return null;
  }
  // Column-major matrix from the reference camera's frame to the screen, about the middle of the cloud.
  screen(camera, low, high) {
    const middle = (low + high) / 2, aspect = this.canvas.width / this.canvas.height;
    this.zoom = (1.9 * camera.focal_px) / camera.height_px;
    const away = middle / this.near, [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    const turn = [[cy, 0, -sy], [-sp * sy, cp, -sp * cy], [cp * sy, sp, cp * cy]];
    const shift = turn.map((row, k) => -row[2] * middle + (k === 2 ? away : 0));
    const near = away / 50, far = away * 50, a = (far + near) / (far - near), b = (-2 * far * near) / (far - near);
    const rows = [
      [...turn[0], shift[0]].map((one) => (one * this.zoom) / aspect),
      [...turn[1], shift[1]].map((one) => -one * this.zoom),
      [...turn[2], shift[2]].map((one, k) => one * a + (k === 3 ? b : 0)),
      [...turn[2], shift[2]],
    ];
    return [0, 1, 2, 3].flatMap((column) => rows.map((row) => row[column]));
  }
  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.max(-1.5, Math.min(1.5, this.pitch + pitch));
    this.changed?.();
  }
  closer(times) {
    this.near = Math.max(0.1, Math.min(20, this.near * times));
    this.changed?.();
  }
  listen() {
    const fingers = new Map();
    let apart = 0;
    const gap = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a.x - b.x, a.y - b.y); };
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      if (fingers.size === 2) apart = gap();
    });
    this.canvas.addEventListener("pointermove", (event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      if (fingers.size === 1) this.turn((before.x - event.clientX) / -180, (event.clientY - before.y) / 180);
      else if (fingers.size === 2) { const now = gap(); this.closer(now / apart); apart = now; }
    });
    for (const name of ["pointerup", "pointercancel"]) this.canvas.addEventListener(name, (event) => fingers.delete(event.pointerId));
    this.canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.closer(Math.exp(-event.deltaY / 600)); }, { passive: false });
  }
}
