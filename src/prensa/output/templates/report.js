// The interactive part of a report: decodes what the page carries, and drives plots of BokehJS with it. No network, no storage.
"use strict";
(async function () {
const $ = id => document.getElementById(id);
const scene = JSON.parse($("scene").textContent);
$("stills")?.removeAttribute("open");
const SMOOTH = 9000;  // facets up to which cells are divided, so that colours look smooth
const EDGES = 2500;   // cells up to which the mesh is shown at first

// ------------------------------------------------------------------------------------------------ packed arrays
async function inflated(text) {
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
const taken = id => { const text = $(id).textContent.trim(); $(id).remove(); return text; };
const bytes = await inflated(taken("data"));
const library = document.createElement("script");
library.textContent = new TextDecoder().decode(await inflated(taken("library")));
document.head.append(library);
const P = Bokeh.Plotting;

const known = new Map();
function unpack(ref) {  // an array of rows, one a frame (or one for each of the first index of the shape)
  if (known.has(ref)) return known.get(ref);
  const rows = ref.shape.length > 1 ? ref.shape[0] : 1, n = ref.shape.reduce((a, b) => a * b, 1), width = n / rows || 0;
  const planes = ref.kind === "q" ? 3 : 4, whole = new Uint32Array(n);
  for (let p = 0; p < planes; p++) for (let k = 0; k < n; k++) whole[k] |= bytes[ref.at + p * n + k] << (8 * p);
  let out;
  if (ref.kind === "f4") {
    const values = new Float32Array(whole.buffer);
    out = Array.from({length: rows}, (_, r) => values.subarray(r * width, (r + 1) * width));
  } else {
    const plain = Int32Array.from(whole, v => (v >>> 1) ^ -(v & 1));
    if (ref.kind === "i4") {
      for (let k = 1; k < n; k++) plain[k] += plain[k - 1];
      out = Array.from({length: rows}, (_, r) => plain.subarray(r * width, (r + 1) * width));
    } else {
      for (let r = 0; r < rows; r++) for (let k = 1; k < width; k++) plain[r * width + k] += plain[r * width + k - 1];
      for (let k = width; k < n; k++) plain[k] += plain[k - width];
      out = Array.from({length: rows}, (_, r) =>
        Float64Array.from(plain.subarray(r * width, (r + 1) * width), q => ref.low + ref.scale * q));
    }
  }
  known.set(ref, out);
  return out;
}

// ---------------------------------------------------------------------------------------------------- the state
const history = scene.history, frames = scene.frames, U = scene.units;
const state = {frame: Math.max(0, frames.indexOf(history.increment.indexOf(scene.largest))), field: "mises", playing: false};
const listeners = [];
const tell = () => listeners.forEach(f => f());
const watch = new IntersectionObserver(entries => entries.forEach(({target, isIntersecting}) => {
  target.inView = isIntersecting;
  if (isIntersecting && target.stale) { target.stale = false; target.follow(); }
}), {rootMargin: "80px"});
function follows(id, f) {  // what is drawn there follows the slider while it can be seen, and catches up when it comes into view
  const element = $(id);
  element.follow = f;
  watch.observe(element);
  listeners.push(() => { if (element.inView) f(); else element.stale = true; });
}
const row = () => frames[state.frame];
const narrow = () => window.innerWidth < 700;
const text = (v, digits = 4) => {
  if (v === 0) return "0";
  const a = Math.abs(v), s = a >= 1e-3 && a < 1e6 ? String(Number(v.toPrecision(digits))) : v.toExponential(digits - 1);
  return s.replace("-", "−");
};

function look(figure) {  // letters that can be read on a phone, and nothing that needs a mouse to be found
  for (const axis of figure.axes) {
    axis.axis_label_text_font_size = "13px"; axis.major_label_text_font_size = "12px";
    if (axis.formatter.power_limit_high) axis.formatter.power_limit_high = 7;  // 500000, not 5.000e+5
    axis.axis_label_text_font_style = "normal"; axis.axis_label_text_color = "#1a1a1a"; axis.minor_tick_line_color = null;
  }
  for (const grid of [...figure.xgrids, ...figure.ygrids]) grid.grid_line_color = "#e3e5e8";
  figure.outline_line_color = null;
  figure.toolbar.logo = null;
  return figure;
}
function chart(height, more) {
  return look(P.figure({height, sizing_mode: "stretch_width", tools: "pan,box_zoom,reset,save", active_drag: null,
    toolbar_location: "above", ...more}));
}
function legend(figure, names) {  // in HTML above the plot: it wraps on a phone and covers no curve
  return '<p class="legend">' + names.map(([name, colour, dash]) =>
    `<span><i style="border-top:3px ${dash || "solid"} ${colour}"></i>${name}</span>`).join("") + "</p>";
}
function cursor(figure) {
  const span = new Bokeh.Span({dimension: "height", location: NaN, line_color: "#1a1a1a", line_width: 1.5, line_dash: [5, 4]});
  figure.add_layout(span);
  return span;
}
async function show(figure, id) { return P.show(figure, "#" + id); }

// ------------------------------------------------------------------------------------------------ deformed bodies
const fieldOf = key => scene.fields.find(f => f.key === key);
if (scene.fields.length && !fieldOf(state.field)) state.field = scene.fields[0].key;

function bodiesNow() {  // of the group of the frame: places, values, cells
  const group = scene.groups.find(g => state.frame >= g.first && state.frame < g.last), k = state.frame - group.first;
  const scale = Number($("scale").value);
  return group.bodies.map(b => {
    const [X, Y, Z] = unpack(b.X), moved = (at, u) => Float64Array.from(at, (a, i) => a + scale * u[i]);
    const x = moved(X, unpack(b.u[0])[k]), y = moved(Y, unpack(b.u[1])[k]), z = Z && moved(Z, unpack(b.u[2])[k]);
    return {b, k, x, y, z, X, Y, Z, value: valuesOf(b, k)};
  });
}
function valuesOf(b, k) {  // of the field that is shown, at the k-th frame of a group
  const u = axis => unpack(b.u[axis])[k];
  if (state.field === "displacement") return Float64Array.from(u(0), (a, i) => Math.hypot(a, ...b.u.slice(1).map(r => unpack(r)[k][i])));
  if (state.field.startsWith("displacement.")) return u("xyz".indexOf(state.field.split(".")[1]));
  return unpack(b.fields[state.field])[k];
}

function divided(body, copies, px, py) {  // facets with one value each; cells of a coarse mesh in s × s of them
  const nodes = unpack(body.b.facets), m = nodes.length;
  const s = Math.max(1, Math.min(6, Math.floor(Math.sqrt(SMOOTH / (m * copies)))));
  const xs = [], ys = [], vs = [], {x, y, value} = body;
  const add = (a, b, v) => {  // corners moved out by a pixel's share: canvases leave a seam between neighbours
    const n = a.length;
    let cx = 0, cy = 0;
    for (let k = 0; k < n; k++) { cx += a[k] / n; cy += b[k] / n; }
    for (let k = 0; k < n; k++) {
      const dx = (a[k] - cx) / px, dy = (b[k] - cy) / py, d = Math.hypot(dx, dy) || 1;
      a[k] += px * dx / d; b[k] += py * dy / d;
    }
    xs.push(a); ys.push(b); vs.push(v);
  };
  for (let e = 0; e < m; e++) {
    const [a, b, c, d] = nodes[e];
    if (c === d) {  // a triangle: s × s triangles
      const at = (f, i, j) => f[a] + (i * (f[b] - f[a]) + j * (f[c] - f[a])) / s;
      const part = (...corners) => add(corners.map(([i, j]) => at(x, i, j)), corners.map(([i, j]) => at(y, i, j)),
        corners.reduce((sum, [i, j]) => sum + at(value, i, j) / 3, 0));
      for (let i = 0; i < s; i++) for (let j = 0; j < s - i; j++) {
        part([i, j], [i + 1, j], [i, j + 1]);
        if (i + j < s - 1) part([i + 1, j], [i + 1, j + 1], [i, j + 1]);
      }
      continue;
    }
    if (s === 1) {
      add([x[a], x[b], x[c], x[d]], [y[a], y[b], y[c], y[d]], 0.25 * (value[a] + value[b] + value[c] + value[d]));
      continue;
    }
    const at = (f, p, q) => (1 - p) * ((1 - q) * f[a] + q * f[d]) + p * ((1 - q) * f[b] + q * f[c]);
    for (let i = 0; i < s; i++) for (let j = 0; j < s; j++) {
      const p0 = i / s, p1 = (i + 1) / s, q0 = j / s, q1 = (j + 1) / s;
      add([at(x, p0, q0), at(x, p1, q0), at(x, p1, q1), at(x, p0, q1)],
        [at(y, p0, q0), at(y, p1, q0), at(y, p1, q1), at(y, p0, q1)], at(value, (i + 0.5) / s, (j + 0.5) / s));
    }
  }
  return [xs, ys, vs];
}
function pieces(x, y, pairs, into) {  // segments as one broken line
  for (const [a, b] of pairs) { into.x.push(x[a], x[b], NaN); into.y.push(y[a], y[b], NaN); }
}
const ticked = () => scene.offered.filter(([, , side]) => $("mirror-" + side).checked);
function images() {  // in the plane, lines of symmetry that are switched on → functions of (points, axis)
  let found = [[]];
  for (const line of [...($("mirror").checked ? scene.mirror : []), ...ticked()]) found = [...found, ...found.map(l => [...l, line])];
  return found;
}
function inside(body, edge, copies) {  // whether a side of the body lies on a line of symmetry that is switched on
  const size = Math.max(scene.box[1] - scene.box[0], scene.box[3] - scene.box[2]);
  return copies[copies.length - 1].some(([axis, at]) => edge.every(i => Math.abs((axis ? body.Y : body.X)[i] - at) < 1e-6 * size));
}
const flip = (values, lines, axis) => lines.reduce((v, [a, at]) => a === axis ? Array.from(v, c => 2 * at - c) : v, values);
function sign(lines) {
  if (state.field === "stress.xy") return lines.length % 2 ? -1 : 1;
  const axis = "xy".indexOf(state.field.split(".")[1] || "-");
  return state.field.startsWith("displacement.") && lines.some(([a]) => a === axis && !(a === 0 && scene.axisymmetric)) ? -1 : 1;
}

function toolsNow() {
  const out = [];
  for (const tool of scene.tools) {
    const [ux, uy, rz] = ["ux", "uy", "rz"].map(c => history[`${tool.name}.${c}`][row()]);
    const c = Math.cos(rz), s = Math.sin(rz), [ax, ay] = tool.at;
    for (const [px, py] of tool.outlines) {
      const x = [], y = [];
      px.forEach((_, k) => {
        const dx = px[k] - ax, dy = py[k] - ay;
        x.push(ax + ux + c * dx - s * dy); y.push(ay + uy + s * dx + c * dy);
      });
      out.push([x, y]);
    }
  }
  return out;
}

function ownSide(outline, lines, bodies) {  // the part of a tool on the bodies' side of the lines, beyond which its mirror image stands
  for (const [axis, at] of lines) {
    const c = outline[axis], low = Math.min(...c), high = Math.max(...c);
    if (Math.abs(low + high - 2 * at) < 1e-6 * (high - low)) continue;  // its own mirror image: no cut is seen in it
    const own = bodies.flatMap(b => Array.from(axis ? b.y : b.x)), side = own.reduce((s, v) => s + v - at, 0) < 0 ? -1 : 1;
    const kept = [[], []];
    c.forEach((v, k) => {  // Sutherland and Hodgman (1974)
      const next = (k + 1) % c.length, here = side * (v - at), there = side * (c[next] - at);
      if (here >= 0) for (const i of [0, 1]) kept[i].push(outline[i][k]);
      if (here * there < 0) for (const i of [0, 1]) kept[i].push(outline[i][k] + here / (here - there) * (outline[i][next] - outline[i][k]));
    });
    outline = kept;
  }
  return outline;
}

async function picture() {
  if (!frames.length) return;
  const select = $("field");
  for (const f of scene.fields) select.add(new Option(`${f.label} (${f.unit})`, f.key));
  select.value = state.field;
  const source = new Bokeh.ColumnDataSource({data: {xs: [], ys: [], v: []}});
  const lines = new Bokeh.ColumnDataSource({data: {x: [], y: []}}), mesh = new Bokeh.ColumnDataSource({data: {x: [], y: []}});
  const first = new Bokeh.ColumnDataSource({data: {x: [], y: []}}), rigid = new Bokeh.ColumnDataSource({data: {xs: [], ys: []}});
  const mapper = new Bokeh.LinearColorMapper({palette: scene.palettes.viridis, low: 0, high: 1});
  const x_range = new Bokeh.Range1d({start: 0, end: 1}), y_range = new Bokeh.Range1d({start: 0, end: 1});
  const figure = look(P.figure({height: 400, sizing_mode: "stretch_width", x_range, y_range, tools: "pan,wheel_zoom,box_zoom,reset,save",
    toolbar_location: "above", x_axis_label: `${scene.axes[0]} (${U.length})`, y_axis_label: `${scene.axes[1]} (${U.length})`}));
  figure.xgrids.concat(figure.ygrids).forEach(g => { g.visible = false; });
  figure.toolbar.tools.forEach(t => {
    if (t.type === "BoxZoomTool") t.match_aspect = true;
    if (t.type === "WheelZoomTool") { t.modifiers = {ctrl: true}; figure.toolbar.active_scroll = t; }  // the page scrolls too
  });
  if (narrow()) figure.toolbar.active_drag = null;  // a finger that drags moves the page
  figure.background_fill_color = "#ffffff";
  const cells = figure.patches({field: "xs"}, {field: "ys"}, {source, line_color: null, fill_color: {field: "v", transform: mapper}});
  figure.line({field: "x"}, {field: "y"}, {source: mesh, line_color: "#000000", line_alpha: 0.35, line_width: 0.5});
  figure.line({field: "x"}, {field: "y"}, {source: first, line_color: "#737373", line_dash: [5, 4], line_width: 1});
  figure.line({field: "x"}, {field: "y"}, {source: lines, line_color: "#1a1a1a", line_width: 1.2});
  figure.patches({field: "xs"}, {field: "ys"}, {source: rigid, fill_color: "#d9dce1", line_color: "#4a5058", line_width: 1.2,
    hatch_pattern: "/", hatch_color: "#9aa1ab", hatch_scale: 9, hatch_weight: 0.4});
  const wide = (scene.box[1] - scene.box[0]) / (scene.box[3] - scene.box[2]);
  const bar = new Bokeh.ColorBar({color_mapper: mapper, title_text_font_size: "13px", major_label_text_font_size: "12px",
    title_text_font_style: "normal", height: narrow() || wide > 1.2 ? 14 : "auto", width: narrow() || wide > 1.2 ? "auto" : 14, bar_line_color: "#4a5058"});
  figure.add_layout(bar, narrow() || wide > 1.2 ? "below" : "right");
  const hover = new Bokeh.HoverTool({renderers: [cells], point_policy: "follow_mouse",
    tooltips: [["", ""]]});
  figure.add_tools(hover);
  let box = scene.box;
  const heightOf = width => Math.round(Math.max(260, Math.min(window.innerHeight * 0.68, (width - 70) / aspect() + 110)));
  const aspect = () => (box[1] - box[0]) / (box[3] - box[2]);
  figure.height = heightOf($("picture").clientWidth);
  const view = await show(figure, "picture");

  let drawnFor = 0;  // width of the range at the last drawing
  let named = null;  // field whose name stands at the bar
  function fit() {  // the box as large as the frame allows, lengths along x and y alike
    box = scene.box.slice();
    for (const lines of images()) for (const [axis, at] of lines) {
      const [lo, hi] = axis ? [2, 3] : [0, 1], a = 2 * at - scene.box[lo], b = 2 * at - scene.box[hi];
      box[lo] = Math.min(box[lo], a, b); box[hi] = Math.max(box[hi], a, b);
    }
    const inner = view.frame.bbox, w = Math.max(inner.width, 1), h = Math.max(inner.height, 1);
    let dx = box[1] - box[0], dy = box[3] - box[2];
    if (dx / dy > w / h) dy = dx * h / w; else dx = dy * w / h;
    const cx = 0.5 * (box[0] + box[1]), cy = 0.5 * (box[2] + box[3]);
    x_range.setv({start: cx - dx / 2, end: cx + dx / 2, reset_start: cx - dx / 2, reset_end: cx + dx / 2});
    y_range.setv({start: cy - dy / 2, end: cy + dy / 2, reset_start: cy - dy / 2, reset_end: cy + dy / 2});
  }
  function draw() {
    drawnFor = x_range.end - x_range.start;
    const bodies = bodiesNow(), copies = images(), field = fieldOf(state.field), xs = [], ys = [], v = [];
    const out = {x: [], y: []}, grid = {x: [], y: []}, undeformed = {x: [], y: []};
    const wx = 0.9 * (x_range.end - x_range.start) / Math.max(view.frame.bbox.width, 1);
    const wy = 0.9 * (y_range.end - y_range.start) / Math.max(view.frame.bbox.height, 1);
    for (const body of bodies) {
      const [px, py, pv] = divided(body, copies.length * bodies.length, wx, wy);
      const skin = unpack(body.b.outline).filter(edge => !inside(body, edge, copies)), sides = $("mesh").checked ? unpack(body.b.edges) : [];
      for (const lines of copies) {
        const factor = sign(lines);
        for (let k = 0; k < px.length; k++) {
          xs.push(lines.length ? flip(px[k], lines, 0) : px[k]); ys.push(lines.length ? flip(py[k], lines, 1) : py[k]);
          v.push(factor * pv[k]);
        }
        const x = flip(body.x, lines, 0), y = flip(body.y, lines, 1);
        pieces(x, y, skin, out); pieces(x, y, sides, grid);
        if ($("initial").checked) pieces(flip(body.X, lines, 0), flip(body.Y, lines, 1), skin, undeformed);
      }
    }
    let low = field.low, high = field.high;
    if ($("range").value === "now") { low = v.reduce((a, b) => Math.min(a, b), Infinity); high = v.reduce((a, b) => Math.max(a, b), -Infinity); }
    if (field.map !== "viridis") { high = Math.max(Math.abs(low), Math.abs(high)); low = -high; }
    if (!(high > low)) high = low + 1;
    const own = $("tools").checked ? toolsNow().map(outline => ownSide(outline, copies[copies.length - 1], bodies)) : [];
    const tools = copies.flatMap(lines => own.map(([x, y]) => [flip(x, lines, 0), flip(y, lines, 1)]));
    mapper.setv({palette: scene.palettes[field.map], low, high});
    if (field !== named) {  // words of a bar and of a hover are laid out anew when they are set: not at every frame
      named = field;
      bar.title = `${field.label} (${field.unit})`;
      hover.tooltips = [[scene.axes[0], `$x ${U.length}`], [scene.axes[1], `$y ${U.length}`], [field.label, `@v ${field.unit}`]];
    }
    source.data = {xs, ys, v};
    lines.data = out; mesh.data = grid; first.data = undeformed;
    rigid.data = {xs: tools.map(t => t[0]), ys: tools.map(t => t[1])};
  }
  follows("picture", draw);
  for (const id of ["field", "range", "mesh", "initial", "tools", "scale"])
    $(id).addEventListener("input", () => { state.field = select.value; draw(); if (probed) follow(); });
  for (const box of document.querySelectorAll("[id^=mirror]")) box.addEventListener("input", () => { fit(); draw(); });
  figure.on_event("tap", e => probe(e.x, e.y));
  let later = null;
  figure.on_event("rangesupdate", () => {
    clearTimeout(later);
    later = setTimeout(() => { if (x_range.end - x_range.start !== drawnFor) draw(); }, 150);  // facets overlap by a pixel of the zoom
  });
  let width = $("picture").clientWidth;
  new ResizeObserver(() => {
    const now = $("picture").clientWidth;
    if (now === width) return;
    width = now; figure.height = heightOf(now); setTimeout(() => { fit(); draw(); }, 60);
  }).observe($("picture"));
  await new Promise(done => setTimeout(done, 30));  // the frame has its size by then
  fit();
  draw();
}

// ----------------------------------------------------------------------------------------------- bodies in space
const shapes = new Map();
function shape(b, hidden) {  // triangles and sides of its faces but those on hidden planes, triangles of its sections, initial places
  const name = hidden.join(";"), known = shapes.get(b) || {};
  shapes.set(b, known);
  if (known[name]) return known[name];
  const [flat] = unpack(b.facets), a = b.corners, faces = [], lines = [], seen = new Set(), places = unpack(b.X), [X, Y, Z] = places;
  const size = Math.max(...[0, 1, 2].map(k => scene.box[2 * k + 1] - scene.box[2 * k]));
  const on = hidden.map(([n, m, l, at]) => X.map((x, i) => Math.abs(n * x + m * Y[i] + l * Z[i] - at) < 1e-6 * size ? 1 : 0));
  const inside = {3: [0, 1, 2], 4: [0, 1, 2, 0, 2, 3], 6: [0, 3, 5, 3, 1, 4, 5, 4, 2, 3, 4, 5]}[a], ring = a === 6 ? [0, 3, 1, 4, 2, 5] : [...Array(a).keys()];
  for (let f = 0; f < flat.length; f += a) {
    if (on.some(nodes => ring.every(k => nodes[flat[f + k]]))) continue;
    for (const k of inside) faces.push(flat[f + k]);
    ring.forEach((k, i) => {
      const p = flat[f + k], q = flat[f + ring[(i + 1) % a]], key = Math.min(p, q) * X.length + Math.max(p, q);
      if (!seen.has(key)) { seen.add(key); lines.push(p, q); }
    });
  }
  const made = {faces: Uint32Array.from(faces), lines: Uint32Array.from(lines), X: together(X, Y, Z),
    caps: b.sections.map(ref => Uint32Array.from(unpack(ref)[0] || []))};
  known[name] = made;
  return made;
}
function together(x, y, z) {
  const out = new Float32Array(3 * x.length);
  for (let i = 0; i < x.length; i++) { out[3 * i] = x[i]; out[3 * i + 1] = y[i]; out[3 * i + 2] = z[i]; }
  return out;
}
const AS_IT_IS = {turn: [1, 0, 0, 0, 1, 0, 0, 0, 1], shift: [0, 0, 0]};
const placed = ({turn, shift}, p) => [0, 1, 2].map(r => turn[3 * r] * p[0] + turn[3 * r + 1] * p[1] + turn[3 * r + 2] * p[2] + shift[r]);
function planes() {  // of symmetry in space that are switched on: normals, and their products with a place
  return [...($("mirror").checked ? scene.mirror : []), ...ticked().map(([axis, at]) => [...[0, 1, 2].map(k => k === axis ? 1 : 0), at])];
}
function turned() {  // what was modelled and its images about these planes; those offered stand at right angles to all others
  let found = [AS_IT_IS, ...($("mirror").checked ? scene.images : []).map(v => ({turn: v.slice(0, 9), shift: v.slice(9)}))];
  for (const [axis, at] of ticked()) found = [...found, ...found.map(({turn, shift}) => ({
    turn: turn.map((v, k) => Math.floor(k / 3) === axis ? -v : v), shift: shift.map((v, k) => k === axis ? 2 * at - v : v)}))];
  return found;
}
function valuesIn(copy, body) {  // of an image: components are those of turned vectors and stresses
  const [kind, letters] = state.field.split("."), {b, k} = body, R = copy.turn;
  if (copy === AS_IT_IS || !letters || !["displacement", "stress"].includes(kind)) return body.value;
  const [i, j] = Array.from(letters, c => "xyz".indexOf(c)), out = new Float64Array(body.value.length);
  const add = (v, factor) => { if (factor) for (let n = 0; n < out.length; n++) out[n] += factor * v[n]; };
  if (kind === "displacement") { for (const a of [0, 1, 2]) add(unpack(b.u[a])[k], R[3 * i + a]); return out; }
  for (const name of ["xx", "yy", "zz", "xy", "yz", "xz"]) {
    const [p, q] = Array.from(name, c => "xyz".indexOf(c)), there = R[3 * i + p] * R[3 * j + q];
    add(unpack(b.fields[`stress.${name}`])[k], p === q ? there : there + R[3 * i + q] * R[3 * j + p]);
  }
  return out;
}
async function space() {
  if (!frames.length) return;
  const canvas = $("turned"), viewer = window.prensaSpace.viewer(canvas);
  if (!viewer) { $("no-webgl").hidden = false; $("space").hidden = true; $("stills")?.setAttribute("open", ""); return; }
  canvas.addEventListener("webglcontextlost", () => { $("no-webgl").hidden = false; $("stills")?.setAttribute("open", ""); });
  const {cam} = viewer, select = $("field");
  for (const f of scene.fields) select.add(new Option(`${f.label} (${f.unit})`, f.key));
  select.value = state.field;
  [cam.turn, cam.lift] = scene.view;
  const outside = t => ({x: together(...unpack(t.X)), n: together(...unpack(t.N).map(row => Float32Array.from(row, v => v / 127 - 1))), faces: Uint32Array.from(unpack(t.facets)[0])});
  const tools = scene.tools.map(t => ({...outside(t), moves: t.moves, whole: t.whole && {...outside(t.whole), copies: t.whole.copies}}));
  const place = m => Float32Array.from([m[0], m[3], m[6], 0, m[1], m[4], m[7], 0, m[2], m[5], m[8], 0, m[9], m[10], m[11], 1]);
  let now = null, asked = false, covered = false;  // covered: tools were hidden for the pressure under them
  function ends(parts, field) {
    let {low, high} = field;
    if ($("range").value === "now") {
      [low, high] = [Infinity, -Infinity];
      for (const p of parts) for (const values of new Set(p.v)) for (const v of values) { low = Math.min(low, v); high = Math.max(high, v); }
    }
    if (field.map !== "viridis") { high = Math.max(Math.abs(low), Math.abs(high)); low = -high; }
    return [low, high > low ? high : low + 1];
  }
  function prepare() {
    const field = fieldOf(state.field), axis = "xyz".indexOf($("cut").value || "-");
    let copies = turned(), sides = planes();
    // where an image of a side on a plane of symmetry lies across the cut, it closes the cut; others are inside of the whole
    const across = plane => copies.find(({turn}) => axis >= 0 && Math.abs([0, 1, 2].reduce((s, k) => s + turn[3 * axis + k] * plane[k], 0)) > 1 - 1e-9);
    const line = sides.find(across);
    if (axis >= 0 && !line && copies.some(({turn}) => Math.abs(turn[4 * axis]) < 1 - 1e-9)) {
      copies = [AS_IT_IS]; sides = [];  // the cut through turned images is not in the page: what was modelled is shown
    }
    const hidden = sides.filter(plane => !across(plane));
    const base = $("mirror").checked && copies.length > 1 ? scene.images.length + 1 : 1;  // those about offered planes come after
    const parts = bodiesNow().map(body => {
      const own = Float32Array.from(body.value);
      const v = copies.map(copy => { const values = valuesIn(copy, body); return values === body.value ? own : Float32Array.from(values); });
      return {...shape(body.b, hidden), x: together(body.x, body.y, body.z), v};
    });
    now = {parts, copies, palette: scene.palettes[field.map], ends: ends(parts, field), lines: $("mesh").checked,
      cut: axis < 0 ? null : {axis, at: line ? placed(across(line), line.slice(0, 3).map(v => v * line[3]))[axis] : scene.middle[axis]}, caps: !line,
      tools: $("tools").checked ? tools.map(t => ({...(base > 1 && t.whole || t), place: place(t.moves[state.frame]),
        copies: base > 1 && t.whole ? copies.filter((_, k) => t.whole.copies.includes(k % base)) : copies})) : []};
    bar(field, now.ends);
    paint();
  }
  function paint() {  // once a picture of the screen
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      viewer.draw(now);
      window.prensaSpace.marks($("marks"), cam, scene.axes, U.length, text);
    });
  }
  function bar(field, [low, high]) {
    const colours = scene.palettes[field.map].filter((_, k) => k % 15 === 0);
    $("bar-colours").style.background = `linear-gradient(to right, ${colours.join(", ")})`;
    $("bar-label").textContent = `${field.label} (${field.unit})`;
    $("bar-ticks").replaceChildren(...[0, 1, 2, 3, 4].map(k => Object.assign(document.createElement("span"),
      {textContent: text(low + k * (high - low) / 4, 3)})));
  }
  function fit() {
    const box = scene.box.slice();
    for (const copy of turned()) for (let corner = 0; corner < 8; corner++)
      placed(copy, [0, 1, 2].map(k => scene.box[2 * k + (corner >> k & 1)])).forEach((v, k) => {
        box[2 * k] = Math.min(box[2 * k], v); box[2 * k + 1] = Math.max(box[2 * k + 1], v);
      });
    cam.fit(box, canvas.clientWidth / Math.max(canvas.clientHeight, 1));
  }
  window.prensaSpace.steer(canvas, cam, paint, (x, y) => {
    const found = window.prensaSpace.picked(canvas, cam, now, x, y);
    if (found) { probed = {number: found.number, node: found.point, name: bodiesNow()[found.number].b.name}; follow(); }
  });
  for (const name of Object.keys(window.prensaSpace.VIEWS)) {
    const button = Object.assign(document.createElement("button"), {textContent: name, id: `view-${name}`, type: "button"});
    button.addEventListener("click", () => { [cam.turn, cam.lift] = window.prensaSpace.VIEWS[name]; fit(); paint(); });
    $("views").append(button);
  }
  follows("space", prepare);
  for (const id of ["field", "range", "mesh", "tools", "scale", "cut"])
    $(id).addEventListener("input", () => { state.field = select.value; prepare(); if (probed) follow(); });
  select.addEventListener("input", () => {  // a pressure is seen from the side of the tool, through which it is looked
    const pressure = state.field === "contact_pressure";
    if (pressure === $("tools").checked && (pressure || covered)) { covered = pressure; $("tools").checked = !pressure; prepare(); }
  });
  for (const box of document.querySelectorAll("[id^=mirror]")) box.addEventListener("input", () => { fit(); prepare(); });
  let width = canvas.clientWidth;
  new ResizeObserver(() => { if (canvas.clientWidth !== width) { width = canvas.clientWidth; fit(); } paint(); }).observe(canvas);
  fit();
  prepare();
}

// ------------------------------------------------------------------------------------------------ probe of values
let probed = null;
function probe(x, y) {  // the node nearest to a place of the picture, followed through the run
  let best = Infinity;
  bodiesNow().forEach((body, number) => {
    for (const lines of images()) {
      const [qx] = flip([x], lines, 0), [qy] = flip([y], lines, 1);
      for (let i = 0; i < body.x.length; i++) {
        const d = (body.x[i] - qx) ** 2 + (body.y[i] - qy) ** 2;
        if (d < best) { best = d; probed = {number, node: i, name: body.b.name}; }
      }
    }
  });
  follow();
}
let probeSource = null;
async function follow() {
  const field = fieldOf(state.field), values = [], at = state.frame;
  for (const group of scene.groups) {
    const b = group.bodies[probed.number], same = group.first <= at && at < group.last;
    for (let k = group.first; k < group.last; k++) {
      if (!same) { values.push(NaN); continue; }  // nodes of another mesh are other points
      values.push(valuesOf(b, k - group.first)[probed.node]);
    }
  }
  const body = bodiesNow()[probed.number];
  $("probe-box").hidden = false;
  const places = [body.x, body.y, body.z].filter(Boolean).map((v, k) => `${scene.axes[k]} = ${text(v[probed.node])}`).join(", ");
  const node = body.b.nodes ? unpack(body.b.nodes)[0][probed.node] - 1 : probed.node;  // of a section, points between nodes
  $("probe-text").textContent = `${node < 0 ? "Point" : `Node ${node}`} of ${probed.name}, now at ${places} ${U.length}: ` +
    `${field.label} ${text(values[at])} ${field.unit}`;
  const data = {t: frames.map(r => history.time[r]), v: values};
  if (!probeSource) {
    probeSource = new Bokeh.ColumnDataSource({data});
    const figure = chart(220, {x_axis_label: "time"});
    figure.line({field: "t"}, {field: "v"}, {source: probeSource, line_width: 2, line_color: scene.colours[0]});
    figure.scatter({field: "t"}, {field: "v"}, {source: probeSource, size: 5, fill_color: scene.colours[0], line_color: null});
    const span = cursor(figure);
    const mark = () => { if (probed) { span.location = history.time[row()]; } };
    listeners.push(() => { mark(); if (probed) say(); });
    mark();
    probeSource.axis = figure.yaxes[0];
    await show(figure, "probe");
  }
  function say() { follow(); }
  probeSource.axis.axis_label = `${field.label} (${field.unit})`;
  probeSource.data = data;
}

// ------------------------------------------------------------------------------------------- forces against travel
const ways = scene.solid ? ["x", "y", "z"] : ["x", "y"];
function column(name) { return Float64Array.from(history[name]); }
function abscissa() {
  const t = scene.leading;
  if (t && $("along").value === "travel") {
    const names = ways.map(c => column(`${t}.u${c}`)), most = v => v.reduce((a, b) => Math.max(a, Math.abs(b)), 0);
    const k = ways.map((_, i) => i).reduce((a, i) => most(names[i]) > most(names[a]) ? i : a, 1), turn = column(`${t}.rz`);
    const positive = u => { const j = u.reduce((a, v, i) => Math.abs(v) > Math.abs(u[a]) ? i : a, 0); return u[j] < 0 ? u.map(v => -v) : u; };
    if (most(names[k]) > 0) return [positive(names[k]), `travel of ${t} along ${scene.axes[k]} (${U.length})`];
    if (most(turn) > 0) return [positive(turn), `rotation of ${t} (rad)`];
  }
  return [column("time"), "time"];
}
function unbroken(s, f) {  // points, and a gap where the abscissa stands still
  const span = Math.max(...s) - Math.min(...s), x = [], y = [];
  for (let k = 0; k < s.length; k++) {
    const before = k > 0 && Math.abs(s[k] - s[k - 1]) > 1e-9 * span, after = k + 1 < s.length && Math.abs(s[k + 1] - s[k]) > 1e-9 * span;
    if (before || after) { x.push(s[k]); y.push(f[k]); }
    if (!after) { x.push(NaN); y.push(NaN); }
  }
  return {x, y};
}
async function forces() {
  if (!scene.tools.length || !history.time.length) return;
  const kinds = [["force", "force", scene.axisymmetric ? ["fy"] : scene.solid ? ["fy", "fx", "fz"] : ["fy", "fx"]]];
  const turning = scene.tools.filter(t => !scene.axisymmetric && history[`${t.name}.rz`].some(v => v) && history[`${t.name}.mz`].some(v => v));
  if (turning.length) kinds.push(["moment", "moment", ["mz"]]);
  for (const [id, what, columns] of kinds) {
    const figure = chart(320, {y_axis_label: `${what} on the tool (${U[what]})`});
    const tools = what === "force" ? scene.tools : turning, curves = [], names = [];
    const all = tools.flatMap(t => columns.map(c => Math.max(0, ...history[`${t.name}.${c}`].map(Math.abs))));
    const largest = Math.max(...all);
    tools.forEach(tool => columns.forEach((c, j) => {
      const values = [0, ...column(`${tool.name}.${c}`)];
      if (Math.max(...values.map(Math.abs)) <= 1e-6 * largest) return;
      const colour = scene.colours[scene.tools.indexOf(tool) % scene.colours.length], source = new Bokeh.ColumnDataSource({data: {x: [], y: []}});
      const dot = new Bokeh.ColumnDataSource({data: {x: [], y: []}});
      figure.line({field: "x"}, {field: "y"}, {source, line_width: 2, line_color: colour, line_dash: [[], [6, 4], [2, 3]][j]});
      figure.scatter({field: "x"}, {field: "y"}, {source: dot, size: 9, fill_color: colour, line_color: "#ffffff"});
      curves.push({source, dot, values});
      names.push([`${tool.name}${c === "mz" ? "" : ", " + scene.axes["xyz".indexOf(c[1])]}`, colour, ["solid", "dashed", "dotted"][j]]);
    }));
    if (!curves.length) continue;
    const limits = [];
    for (const [name, values] of what === "force" ? Object.entries(scene.capacities) : []) {
      const source = new Bokeh.ColumnDataSource({data: {x: [], y: []}});
      figure.line({field: "x"}, {field: "y"}, {source, line_width: 1.5, line_color: "#b3400c", line_dash: [2, 3]});
      limits.push({source, values: values.map(v => v === null ? NaN : v)});
      names.push([`${name}, capacity of its press`, "#b3400c", "dotted"]);
    }
    $(`${id}-legend`).innerHTML = legend(figure, names);
    $(id).parentElement.hidden = false;
    const span = cursor(figure);
    let s = [];
    const draw = () => {
      const [values, label] = abscissa();
      s = [0, ...values];
      figure.xaxes[0].axis_label = label;
      for (const c of [...curves, ...limits]) c.source.data = unbroken(s, c.values);
      mark();
    };
    const mark = () => {
      span.location = s[row() + 1];
      for (const c of curves) c.dot.data = {x: [s[row() + 1]], y: [c.values[row() + 1]]};
    };
    const choose = e => {  // the frame whose points are nearest, measured in pixels of the plot
      const fx = figure.x_range.end - figure.x_range.start, fy = figure.y_range.end - figure.y_range.start;
      let best = Infinity, found = state.frame;
      frames.forEach((r, k) => curves.forEach(c => {
        const d = ((s[r + 1] - e.x) / fx) ** 2 + (0.3 * (c.values[r + 1] - e.y) / fy) ** 2;
        if (d < best) { best = d; found = k; }
      }));
      go(found);
    };
    figure.on_event("tap", choose);
    figure.on_event("pan", choose);
    $("along").addEventListener("input", draw);
    follows(id, mark);
    draw();
    await show(figure, id);
  }
}

// ------------------------------------------------------------------------------------------------------ contacts
async function contacts() {
  const select = $("contact");
  if (!scene.contacts.length || !frames.length) return;
  scene.contacts.forEach((c, k) => select.add(new Option(c.name, k)));
  select.parentElement.hidden = scene.contacts.length < 2;
  const empty = {s: [], p: [], q: [], low: [], high: [], shear: [], slip: []};
  const source = new Bokeh.ColumnDataSource({data: empty}), marks = new Bokeh.ColumnDataSource({data: {s: [], v: [], c: []}});
  const x_range = new Bokeh.Range1d({start: 0, end: 1}), x_below = new Bokeh.Range1d({start: 0, end: 1}), top = new Bokeh.Range1d({start: 0, end: 1}), low = new Bokeh.Range1d({start: 0, end: 1});
  const figure = chart(330, {x_range, y_range: top, y_axis_label: `traction (${U.pressure})`});
  const below = chart(230, {x_range: x_below, y_range: low, y_axis_label: `slip path (${U.length})`});
  const [blue, red, green] = scene.colours, orange = "#E69F00";
  const bars = new Bokeh.Whisker({source, base: {field: "s"}, lower: {field: "low"}, upper: {field: "high"}, line_color: blue, line_alpha: 0.55});
  bars.upper_head.size = 6; bars.lower_head.size = 6;
  for (const head of [bars.upper_head, bars.lower_head]) head.line_color = blue;
  figure.add_layout(bars);
  figure.line({field: "s"}, {field: "q"}, {source, line_width: 1.5, line_color: orange, line_dash: [6, 4]});
  figure.line({field: "s"}, {field: "shear"}, {source, line_width: 1.8, line_color: green});
  const line = figure.line({field: "s"}, {field: "p"}, {source, line_width: 2, line_color: blue});
  const dots = figure.scatter({field: "s"}, {field: "p"}, {source, size: 5, fill_color: blue, line_color: null});
  figure.add_tools(new Bokeh.HoverTool({renderers: [dots], mode: "vline", tooltips: [["pressure", `@p ${U.pressure}`],
    ["from stress", `@q ${U.pressure}`], ["shear", `@shear ${U.pressure}`], ["slip", `@slip ${U.length}`], ["", "@word"]]}));
  below.line({field: "s"}, {field: "v"}, {source: marks, line_width: 2, line_color: red});
  below.scatter({field: "s"}, {field: "v"}, {source: marks, size: 7, fill_color: {field: "c"}, line_color: null});
  const colours = ["#c6cbd2", blue, red];
  $("contact-legend").innerHTML = legend(figure, [["contact pressure (bar: deviation from the stress in the body)", blue],
    ["pressure from the stress in the body", orange, "dashed"], ["shear", green]]);
  $("slip-legend").innerHTML = legend(below, scene.status.map((w, k) => [w, colours[k], "dotted"]));
  let contact = scene.contacts[0], fixed = null;

  function profile(k) {
    const g = contact.groups.find(h => k >= h.first && k < h.last), j = k - g.first, get = name => unpack(g[name])[j];
    const x = get("x"), y = get("y"), n = x.length, s = new Float64Array(n);
    for (let i = 1; i < n; i++) s[i] = s[i - 1] + Math.hypot(x[i] - x[i - 1], y[i] - y[i - 1]);
    const along = $("place").value;
    const status = unpack(g.status)[j];
    return {s: along === "x" ? x : along === "y" ? y : s, p: get("pressure"), q: get("pressure_from_stress"), shear: get("shear"),
      slip: get("slip"), status};
  }
  function ranges() {  // the same at all times, so that play shows what changes
    let a = Infinity, b = -Infinity, most = 0, least = 0, far = 0;
    for (let k = 0; k < frames.length; k++) {
      const f = profile(k);
      for (let i = 0; i < f.s.length; i++) {
        far = Math.max(far, f.slip[i]);
        if (!f.status[i]) continue;
        a = Math.min(a, f.s[i]); b = Math.max(b, f.s[i]);
        most = Math.max(most, f.p[i], f.q[i], f.shear[i]); least = Math.min(least, f.q[i], f.shear[i]);
      }
    }
    const margin = 0.08 * (b - a) || 1;
    fixed = {start: a - margin, end: b + margin};
    for (const r of [x_range, x_below]) r.setv({...fixed, reset_start: fixed.start, reset_end: fixed.end});
    const head = 0.06 * (most - least) || 1, slack = 0.06 * far || 1;
    top.setv({start: least - (least < 0 ? head : 0), end: most + head, reset_start: least - (least < 0 ? head : 0), reset_end: most + head});
    low.setv({start: -slack, end: far + slack, reset_start: -slack, reset_end: far + slack});
    const label = $("place").value === "s" ? `length along ${contact.surface} (${U.length})` :
      `${scene.axes[$("place").value === "x" ? 0 : 1]} (${U.length})`;
    figure.xaxes[0].axis_label = label; below.xaxes[0].axis_label = label;
  }
  function draw() {
    const f = profile(state.frame), order = Array.from(f.s.keys()).sort((i, j) => f.s[i] - f.s[j]);
    const by = values => order.map(i => values[i]), closed = order.map(i => f.status[i] > 0);
    const p = by(f.p), q = by(f.q).map((v, i) => closed[i] ? v : NaN);
    source.data = {s: by(f.s), p, q, shear: by(f.shear), slip: by(f.slip), word: order.map(i => scene.status[f.status[i]]),
      low: p.map((v, i) => closed[i] ? v - Math.abs(v - q[i]) : NaN), high: p.map((v, i) => closed[i] ? v + Math.abs(v - q[i]) : NaN)};
    marks.data = {s: by(f.s), v: by(f.slip), c: order.map(i => colours[f.status[i]])};
    const n = closed.filter(Boolean).length;
    $("contact-note").textContent = n ? `${n} of ${closed.length} nodes touch.` :
      `At this time nothing touches here. It does at other times: move the slider.`;
  }
  const choose = () => { contact = scene.contacts[Number(select.value)]; line.visible = !contact.quadratic; $("place").value = contact.along; ranges(); draw(); };
  select.addEventListener("input", choose);
  $("place").addEventListener("input", () => { ranges(); draw(); });
  follows("contact-plots", draw);
  $("place").options[1].text = scene.axes[0]; $("place").options[2].text = scene.axes[1];
  choose();
  await show(figure, "tractions");
  await show(below, "slips");
}

// ------------------------------------------------------------------------------------------ energies and iterations
async function energies() {
  if (!history.time.length) return;
  const parts = [["elastic", "#56B4E9"], ["plastic", "#D55E00"], ["friction", "#009E73"], ["contact", "#CC79A7"], ["viscous", "#E69F00"]];
  const time = [0, ...history.time], figure = chart(300, {x_axis_label: "time", y_axis_label: `energy (${U.energy})`}), names = [];
  const scale = Math.max(...Object.keys(history).filter(c => c.startsWith("energy.")).map(c => Math.max(...history[c].map(Math.abs))));
  let base = time.map(() => 0);
  for (const [name, colour] of parts) {
    const values = history[`energy.${name}`] ? [0, ...history[`energy.${name}`]] : null;
    if (!values || Math.max(...values.map(Math.abs)) <= 1e-4 * scale) continue;
    const next = base.map((v, k) => v + values[k]);
    figure.varea(time, base, next, {fill_color: colour, fill_alpha: 0.75});
    names.push([name, colour]);
    base = next;
  }
  figure.line(time, [0, ...history["energy.external"]], {line_width: 2, line_color: "#1a1a1a"});
  $("energy-legend").innerHTML = legend(figure, [...names, ["external work", "#1a1a1a"]]);
  const span = cursor(figure), mark = () => { span.location = history.time[row()]; };
  follows("energies", mark);
  if (frames.length) mark();
  await show(figure, "energies");
  const cost = chart(240, {x_axis_label: "increment", y_axis_label: "Newton iterations"});
  cost.vbar(history.increment, 0.8, history.iterations, 0, {line_color: null,
    fill_color: history.cutbacks.map(c => c ? "#D55E00" : "#0072B2")});
  cost.y_range.start = 0;
  const cut = history.cutbacks.some(c => c);
  $("cost-legend").innerHTML = legend(cost, [["converged at once", "#0072B2"], ...(cut ? [["after the increment was cut", "#D55E00"]] : [])]);
  await show(cost, "cost");
}

// ----------------------------------------------------------------------------------------------------- the player
function go(k) {
  k = Math.max(0, Math.min(frames.length - 1, k));
  if (k === state.frame) return;
  state.frame = k;
  update();
}
let asked = false;
function update() {  // once a picture of the screen, whatever the slider says in between
  label();
  if (asked) return;
  asked = true;
  requestAnimationFrame(() => { asked = false; tell(); });
}
function label() {
  const r = row();
  $("slider").value = state.frame;
  $("now").textContent = `${history.step[r]} · increment ${history.increment[r]} of ${scene.drawn[1]} · time ${text(history.time[r])}`;
}
let clock = null;
function play(on) {
  state.playing = on;
  $("play").textContent = on ? "❚❚" : "▶";
  $("play").setAttribute("aria-label", on ? "pause" : "play");
  clearInterval(clock);
  if (on) {
    if (state.frame === frames.length - 1) go(0);
    clock = setInterval(() => { if (state.frame < frames.length - 1) go(state.frame + 1); else play(false); }, Math.max(60, 6000 / frames.length));
  }
}
function player() {
  if (!frames.length) return;
  $("slider").max = frames.length - 1;
  $("slider").addEventListener("input", () => { play(false); go(Number($("slider").value)); });
  $("play").addEventListener("click", () => play(!state.playing));
  $("first").addEventListener("click", () => go(0));
  $("back").addEventListener("click", () => go(state.frame - 1));
  $("on").addEventListener("click", () => go(state.frame + 1));
  $("last").addEventListener("click", () => go(frames.length - 1));
  $("peak").addEventListener("click", () => go(frames.indexOf(history.increment.indexOf(scene.largest))));
  $("peak").hidden = scene.largest === null;
  document.addEventListener("keydown", e => {
    if (/^(INPUT|SELECT|TEXTAREA)$/.test(e.target.tagName)) return;
    if (e.key === "ArrowRight") go(state.frame + 1);
    if (e.key === "ArrowLeft") go(state.frame - 1);
  });
  const cells = scene.groups[0].bodies.reduce((n, b) => n + b.elements, 0);
  $("mesh").checked = cells <= EDGES;
  $("mirror").checked = scene.mirror.length > 0 && cells * (scene.solid ? scene.images.length + 1 : 2 ** scene.mirror.length) <= 2 * SMOOTH;
  $("mirror").parentElement.hidden = !scene.mirror.length;
  $("offered").innerHTML = scene.offered.map(([, , side]) => `<label><input id="mirror-${side}" type="checkbox"> mirrored at the ${side}</label>`).join(" ");
  label();
}
player();
await (scene.solid ? space() : picture());
await forces();
await contacts();
await energies();
window.prensa = {ready: true, state, go, scene, tell, bodies: bodiesNow};  // for tests, and for whoever opens the console
})();
