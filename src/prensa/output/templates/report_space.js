// The view in space of a report: bodies and tools as triangles in WebGL 2, turned by mouse or finger. No library, no network.
"use strict";
window.prensaSpace = (function () {
const VERTEX = `#version 300 es
in vec3 x, X; in float v;
uniform mat4 view, place; uniform mat3 turn; uniform vec3 shift; uniform float lift, tool;
out vec3 at, first, normal; out float value;
void main() {  // X: initial place of a point of a body, normal at a point of a tool
  at = turn * (place * vec4(x, 1.0)).xyz + shift; value = v;
  first = tool > 0.0 ? at : turn * X + shift; normal = turn * (place * vec4(X, 0.0)).xyz;
  gl_Position = view * vec4(at, 1.0); gl_Position.z -= lift;
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 at, first, normal; in float value;
uniform vec4 cut, plain; uniform vec3 eye, light; uniform vec2 ends; uniform float lit, tool; uniform sampler2D palette;
out vec4 colour;
void main() {
  if (dot(cut.xyz, first) > cut.w) discard;
  float t = clamp((value - ends.x) / (ends.y - ends.x), 0.0, 1.0);
  vec4 c = plain.a > 0.0 ? plain : texture(palette, vec2((255.0 * t + 0.5) / 256.0, 0.5));
  vec3 n = normalize(tool > 0.0 ? normal : cross(dFdx(at), dFdy(at)));
  if (dot(n, eye) < 0.0) n = -n;
  colour = vec4(c.rgb * mix(1.0, 0.6 + 0.4 * max(dot(n, light), 0.0), lit), c.a);
}`;
const TOOL = [0.62, 0.66, 0.72, 0.4], INK = [0.0, 0.0, 0.0, 0.45], UNIT = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const VIEWS = {iso: [40, 25], front: [0, 0], right: [90, 0], left: [-90, 0], back: [180, 0], top: [0, 90], bottom: [0, -90]};
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

function program(gl) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text); gl.compileShader(shader); gl.attachShader(made, shader);
  }
  ["x", "X", "v"].forEach((name, k) => gl.bindAttribLocation(made, k, name));
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made) || "no shaders");
  return made;
}

// A camera without perspective: degrees about the upright axis and above the horizontal plane, centre, half of the height.
function camera() {
  return {
    turn: VIEWS.iso[0], lift: VIEWS.iso[1], centre: [0, 0, 0], half: 1, depth: 1,
    axes() {
      const a = this.turn * Math.PI / 180, b = this.lift * Math.PI / 180;
      const eye = [Math.cos(b) * Math.sin(a), Math.sin(b), Math.cos(b) * Math.cos(a)], right = [Math.cos(a), 0, -Math.sin(a)];
      return {eye, right, up: cross(eye, right)};
    },
    matrix(aspect) {
      const {eye, right, up} = this.axes(), rows = [right.map(v => v / this.half / aspect), up.map(v => v / this.half), eye.map(v => -v / this.depth)];
      const out = new Float32Array(16);
      rows.forEach((row, i) => { for (let j = 0; j < 3; j++) out[4 * j + i] = row[j]; out[12 + i] = -dot(row, this.centre); });
      out[15] = 1;
      return out;
    },
    fit(box, aspect) {
      const {right, up} = this.axes(), ends = [Infinity, -Infinity, Infinity, -Infinity];
      this.centre = [0, 1, 2].map(k => 0.5 * (box[2 * k] + box[2 * k + 1]));
      for (let k = 0; k < 8; k++) {
        const p = [0, 1, 2].map(a => box[2 * a + (k >> a & 1)] - this.centre[a]), x = dot(p, right), y = dot(p, up);
        ends[0] = Math.min(ends[0], x); ends[1] = Math.max(ends[1], x); ends[2] = Math.min(ends[2], y); ends[3] = Math.max(ends[3], y);
      }
      this.half = 1.12 * Math.max(0.5 * (ends[3] - ends[2]), 0.5 * (ends[1] - ends[0]) / aspect);
      this.depth = 20 * Math.hypot(box[1] - box[0], box[3] - box[2], box[5] - box[4]);
    },
  };
}

// parts: {x, X (3n), v: values (n) of each copy, faces, lines, caps: three index arrays}; tools: {x, n (3n) normals, faces, place
// (16), copies that show it}; copies: {turn (9, by rows), shift}; what is drawn is in `state`.
function viewer(canvas) {
  const gl = canvas.getContext("webgl2", {antialias: true, alpha: false});
  if (!gl) return null;
  const code = program(gl), uniform = {}, cam = camera(), buffers = new Map();
  for (let k = 0; k < gl.getProgramParameter(code, gl.ACTIVE_UNIFORMS); k++) {
    const {name} = gl.getActiveUniform(code, k);
    uniform[name] = gl.getUniformLocation(code, name);
  }
  gl.useProgram(code);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  for (const [name, value] of [[gl.TEXTURE_MIN_FILTER, gl.NEAREST], [gl.TEXTURE_MAG_FILTER, gl.NEAREST], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE]])
    gl.texParameteri(gl.TEXTURE_2D, name, value);
  gl.enable(gl.DEPTH_TEST);
  gl.depthFunc(gl.LEQUAL);
  gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  function bound(target, data) {  // a buffer of an array, filled once
    let made = buffers.get(data);
    if (!made) {
      made = gl.createBuffer();
      buffers.set(data, made);
      gl.bindBuffer(target, made);
      gl.bufferData(target, data, gl.STATIC_DRAW);
    } else gl.bindBuffer(target, made);
  }
  function arrays(list) {
    list.forEach((data, k) => {
      if (!data) { gl.disableVertexAttribArray(k); gl.vertexAttrib1f(k, 0); return; }
      bound(gl.ARRAY_BUFFER, data);
      gl.enableVertexAttribArray(k);
      gl.vertexAttribPointer(k, k < 2 ? 3 : 1, gl.FLOAT, false, 0, 0);
    });
  }
  function elements(kind, index) {
    if (!index || !index.length) return;
    bound(gl.ELEMENT_ARRAY_BUFFER, index);
    gl.drawElements(kind, index.length, gl.UNSIGNED_INT, 0);
  }
  function forget(kept) {  // arrays of another frame
    for (const [data, made] of buffers) if (!kept.has(data)) { gl.deleteBuffer(made); buffers.delete(data); }
  }
  function colours(list) {
    const bytes = new Uint8Array(4 * list.length);
    list.forEach((c, k) => { for (let j = 0; j < 3; j++) bytes[4 * k + j] = parseInt(c.slice(1 + 2 * j, 3 + 2 * j), 16); bytes[4 * k + 3] = 255; });
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, list.length, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  }
  function draw(s) {  // s: parts, tools, copies, ends, palette, cut: null or {axis, at}, caps: whether sections close the cut, lines
    const ratio = Math.min(window.devicePixelRatio || 1, 2), w = Math.round(canvas.clientWidth * ratio), h = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const {eye, right, up} = cam.axes(), light = [0, 1, 2].map(k => 0.25 * right[k] + 0.55 * up[k] + 0.8 * eye[k]), size = Math.hypot(...light);
    forget(new Set([...s.parts.flatMap(p => [p.x, p.X, ...p.v, p.faces, p.lines, ...p.caps]), ...s.tools.flatMap(t => [t.x, t.n, t.faces])]));
    gl.viewport(0, 0, w, h);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    colours(s.palette);
    gl.uniformMatrix4fv(uniform.view, false, cam.matrix(w / h));
    gl.uniformMatrix4fv(uniform.place, false, UNIT);
    gl.uniform3fv(uniform.eye, eye);
    gl.uniform3fv(uniform.light, light.map(v => v / size));
    gl.uniform2fv(uniform.ends, s.ends);
    const out = [0, 0, 0, 1];
    if (s.cut) { const way = eye[s.cut.axis] < 0 ? -1 : 1; out[s.cut.axis] = way; out[3] = way * s.cut.at + 1e-6 * cam.depth; }
    const paint = (plain, lit, lift) => {
      gl.uniform4fv(uniform.plain, plain); gl.uniform1f(uniform.lit, lit); gl.uniform1f(uniform.lift, lift);
    };
    const mirrored = c => { gl.uniformMatrix3fv(uniform.turn, true, c.turn); gl.uniform3fv(uniform.shift, c.shift); };
    for (const p of s.parts) {
      s.copies.forEach((c, k) => {
        arrays([p.x, p.X, p.v[k]]);
        mirrored(c);
        gl.uniform4fv(uniform.cut, out);
        paint([0, 0, 0, 0], 1, 0);
        elements(gl.TRIANGLES, p.faces);
        if (s.lines) { paint(INK, 0, 2e-4); gl.enable(gl.BLEND); elements(gl.LINES, p.lines); gl.disable(gl.BLEND); }
        if (s.cut && s.caps) { gl.uniform4fv(uniform.cut, [0, 0, 0, 1]); paint([0, 0, 0, 0], 0.35, 0); elements(gl.TRIANGLES, p.caps[s.cut.axis]); }
      });
    }
    gl.uniform4fv(uniform.cut, out);
    gl.uniform1f(uniform.tool, 1);
    paint(TOOL, 1, -1e-4);  // behind the body where both touch
    for (const shown of [false, true]) {  // first what is in front of all tools, then its colour alone: a glass of one layer
      gl.colorMask(shown, shown, shown, shown);
      if (shown) gl.enable(gl.BLEND);
      for (const t of s.tools) {
        arrays([t.x, t.n, null]);
        gl.uniformMatrix4fv(uniform.place, false, t.place);
        for (const c of t.copies) { mirrored(c); elements(gl.TRIANGLES, t.faces); }
      }
    }
    gl.uniform1f(uniform.tool, 0);
    gl.disable(gl.BLEND);
  }
  return {cam, draw, gl};
}

// Turning, shifting and zooming: left button or a finger turns; right or middle button, Shift, or two fingers shift; Ctrl and
// wheel, or two fingers, zoom. A click that does not move is told to `tap`.
function steer(canvas, cam, changed, tap) {
  const held = new Map();
  let moved = 0, before = null;
  const length = () => 2 * cam.half / canvas.clientHeight;  // of a pixel
  function shift(dx, dy) {
    const {right, up} = cam.axes(), size = length();
    for (let k = 0; k < 3; k++) cam.centre[k] -= size * (dx * right[k] - dy * up[k]);
  }
  const pair = () => { const [a, b] = [...held.values()]; return {x: 0.5 * (a.x + b.x), y: 0.5 * (a.y + b.y), d: Math.hypot(a.x - b.x, a.y - b.y)}; };
  canvas.addEventListener("pointerdown", e => {
    canvas.setPointerCapture(e.pointerId);
    held.set(e.pointerId, {x: e.clientX, y: e.clientY});
    if (held.size === 1) moved = 0;
    before = held.size === 2 ? pair() : null;
  });
  canvas.addEventListener("pointermove", e => {
    const last = held.get(e.pointerId);
    if (!last) return;
    const dx = e.clientX - last.x, dy = e.clientY - last.y;
    moved += Math.abs(dx) + Math.abs(dy);
    held.set(e.pointerId, {x: e.clientX, y: e.clientY});
    if (held.size === 2) {
      const now = pair();
      if (before && before.d > 0 && now.d > 0) { cam.half *= before.d / now.d; shift(now.x - before.x, now.y - before.y); }
      before = now;
    } else if (held.size === 1) {
      if (e.shiftKey || e.buttons & 6) shift(dx, dy);
      else { cam.turn -= 0.5 * dx; cam.lift = Math.max(-90, Math.min(90, cam.lift + 0.5 * dy)); }
    }
    changed();
  });
  const gone = e => {
    if (held.delete(e.pointerId) && e.type === "pointerup" && moved < 6 && !held.size) tap(e.offsetX, e.offsetY);
    before = null;
  };
  canvas.addEventListener("pointerup", gone);
  canvas.addEventListener("pointercancel", gone);
  canvas.addEventListener("contextmenu", e => e.preventDefault());
  canvas.addEventListener("wheel", e => {
    if (!e.ctrlKey && !e.metaKey) return;  // the page scrolls too
    e.preventDefault();
    cam.half *= Math.exp(0.002 * Math.max(-200, Math.min(200, e.deltaY)));
    changed();
  }, {passive: false});
}

// Directions of the axes and a scale, drawn over the picture.
function marks(overlay, cam, axes, unit, text) {
  const ratio = window.devicePixelRatio || 1, w = overlay.clientWidth, h = overlay.clientHeight, g = overlay.getContext("2d");
  overlay.width = w * ratio; overlay.height = h * ratio;
  g.scale(ratio, ratio);
  g.font = "13px system-ui, sans-serif"; g.textAlign = "center"; g.textBaseline = "middle"; g.lineWidth = 2;
  const {eye, right, up} = cam.axes();
  [0, 1, 2].sort((a, b) => eye[a] - eye[b]).forEach(k => {
    const dx = 26 * right[k], dy = -26 * up[k];
    g.strokeStyle = g.fillStyle = ["#D55E00", "#009E73", "#0072B2"][k];
    g.beginPath(); g.moveTo(44, h - 44); g.lineTo(44 + dx, h - 44 + dy); g.stroke();
    g.fillText(axes[k], 44 + 1.4 * dx, h - 44 + 1.4 * dy);
  });
  const most = 2 * cam.half / h * Math.min(0.3 * w, 160), power = 10 ** Math.floor(Math.log10(most)), size = [5, 2, 1].find(k => k * power <= most) * power;
  const pixels = size * h / (2 * cam.half);
  g.strokeStyle = g.fillStyle = "#1a1a1a"; g.lineWidth = 1.5;
  g.beginPath(); g.moveTo(w - 14 - pixels, h - 18); g.lineTo(w - 14, h - 18); g.stroke();
  g.fillText(`${text(size)} ${unit}`, w - 14 - pixels / 2, h - 30);
}

// The point of a part that is nearest to a place (pixels) of the picture, of the triangle in front there; null beside them.
function picked(canvas, cam, s, px, py) {
  const {eye, right, up} = cam.axes(), size = 2 * cam.half / canvas.clientHeight;
  const qx = (px - canvas.clientWidth / 2) * size, qy = (canvas.clientHeight / 2 - py) * size;
  const way = s.cut ? (eye[s.cut.axis] < 0 ? -1 : 1) : 0;
  let best = -Infinity, found = null;
  s.parts.forEach((p, number) => s.copies.forEach(c => {
    const n = p.v[0].length, X = new Float64Array(n), Y = new Float64Array(n), Z = new Float64Array(n), off = new Uint8Array(n);
    for (let i = 0; i < n; i++) {
      const imaged = (x, k) => c.turn[3 * k] * x[3 * i] + c.turn[3 * k + 1] * x[3 * i + 1] + c.turn[3 * k + 2] * x[3 * i + 2] + c.shift[k];
      const at = [0, 1, 2].map(k => imaged(p.x, k) - cam.centre[k]);
      X[i] = dot(at, right); Y[i] = dot(at, up); Z[i] = dot(at, eye);
      if (way) off[i] = way * (imaged(p.X, s.cut.axis) - s.cut.at) > 1e-6 * cam.depth;
    }
    const look = (index, cap) => {
      for (let t = 0; t < index.length; t += 3) {
        const [i, j, k] = [index[t], index[t + 1], index[t + 2]];
        if (!cap && (off[i] || off[j] || off[k])) continue;
        const area = (X[j] - X[i]) * (Y[k] - Y[i]) - (X[k] - X[i]) * (Y[j] - Y[i]);
        const a = ((X[j] - qx) * (Y[k] - qy) - (X[k] - qx) * (Y[j] - qy)) / area, b = ((X[k] - qx) * (Y[i] - qy) - (X[i] - qx) * (Y[k] - qy)) / area;
        if (!(a >= 0 && b >= 0 && a + b <= 1)) continue;
        const z = a * Z[i] + b * Z[j] + (1 - a - b) * Z[k];
        if (z > best) { best = z; found = {number, point: a >= b && a >= 1 - a - b ? i : b >= 1 - a - b ? j : k}; }
      }
    };
    look(p.faces, false);
    if (s.cut && s.caps) look(p.caps[s.cut.axis], true);
  }));
  return found;
}
return {VIEWS, viewer, steer, marks, picked};
})();
