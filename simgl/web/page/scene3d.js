// The 3-D scene: spacecraft, camera fields, orbits, Sun direction and the Earth with its terminator.
//
// Positions arrive in ICRF as doubles. The point that the eye circles is subtracted before anything
// is rounded to float32, so that nothing trembles 7,000 km from the Earth's centre.

const VERTEX = `
attribute vec3 position; attribute vec3 normal; attribute vec4 colour;
uniform mat4 clip_from_world, world_from_model; uniform mat3 world_from_normal;
varying vec3 n, place; varying vec4 tint;
void main() {
  n = world_from_normal * normal; place = position; tint = colour;
  gl_Position = clip_from_world * (world_from_model * vec4(position, 1.0));
}`;
const SURFACE = `
precision mediump float;
varying vec3 n; varying vec4 tint; uniform vec3 sun; uniform float sunlight;
void main() {
  float lit = 0.22 + 0.78 * sunlight * max(dot(normalize(n), sun), 0.0);
  gl_FragColor = vec4(pow(tint.rgb, vec3(2.2)) * lit * 1.6 + 0.01, 1.0);
  gl_FragColor.rgb = pow(min(gl_FragColor.rgb, 1.0), vec3(1.0 / 2.2));
}`;
// The terminator is a line of its own besides the change of brightness.
const EARTH = `
#extension GL_OES_standard_derivatives : enable
precision highp float;
varying vec3 n, place; uniform vec3 sun;
float line(float value, float step_) {
  float x = value / step_; float d = abs(fract(x - 0.5) - 0.5) / max(fwidth(x), 1e-6);
  return 1.0 - clamp(d - 0.3, 0.0, 1.0);
}
void main() {
  float c = dot(normalize(n), sun);
  vec3 day = vec3(0.16, 0.36, 0.62), night = vec3(0.025, 0.04, 0.09);
  vec3 colour = mix(night, day * (0.35 + 0.65 * max(c, 0.0)), smoothstep(-0.1, 0.1, c));
  vec3 p = normalize(place);
  float latitude = degrees(asin(p.z)), longitude = degrees(atan(p.y, p.x));
  float grid = line(latitude, 15.0);
  if (abs(latitude) < 84.0 && abs(longitude) < 179.0) grid = max(grid, line(longitude, 15.0));
  colour += 0.13 * grid;
  float edge = 1.0 - clamp(abs(c) / max(fwidth(c), 1e-6) - 0.8, 0.0, 1.0);
  gl_FragColor = vec4(mix(colour, vec3(1.0, 0.62, 0.25), 0.85 * edge), 1.0);
}`;
const LINE = `
precision mediump float;
varying vec4 tint;
void main() { gl_FragColor = tint; }`;

const ORBIT = [0.45, 0.85, 1, 1];
// From nearer than this the orbit's near part is drawn with the spacecraft [m].
const CLOSE = 1e5;

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.sqrt(dot(a, a));
const unit = (a) => { const l = length(a) || 1; return [a[0] / l, a[1] / l, a[2] / l]; };

// Column-major matrices, as WebGL takes them. R: rows of a rotation, t: where its origin goes.
const rigid = (R, t) => [R[0][0], R[1][0], R[2][0], 0, R[0][1], R[1][1], R[2][1], 0,
  R[0][2], R[1][2], R[2][2], 0, t[0], t[1], t[2], 1];
const columnMajor = (M) => [0, 1, 2, 3].flatMap((c) => [0, 1, 2, 3].map((r) => M[r][c]));
function product(a, b) {
  const m = new Array(16).fill(0);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++)
    for (let k = 0; k < 4; k++) m[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return m;
}
const rotationOf = (m) => [m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]];

export class Scene3d {
  constructor(canvas, labels) {
    this.canvas = canvas; this.labels = labels;
    this.gl = canvas.getContext("webgl", { antialias: true });
    this.scenario = null; this.scene = null; this.models = new Map();
    this.azimuth = 0.7; this.elevation = 0.35; this.distance = 50; this.focus = "";
    this.asked = false;
    if (this.gl) this.prepare();
    this.listen();
    new ResizeObserver(() => this.redraw()).observe(canvas);
  }

  prepare() {
    const gl = this.gl;
    gl.getExtension("OES_standard_derivatives"); gl.getExtension("OES_element_index_uint");
    const program = (fragment) => {
      const p = gl.createProgram();
      for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, fragment]]) {
        const s = gl.createShader(kind);
        gl.shaderSource(s, text.trim()); gl.compileShader(s);
        if (!gl.getShaderParameter(s, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(s));
        gl.attachShader(p, s);
      }
      ["position", "normal", "colour"].forEach((name, i) => gl.bindAttribLocation(p, i, name));
      gl.linkProgram(p);
      const at = (name) => gl.getUniformLocation(p, name);
      return { p, clip: at("clip_from_world"), world: at("world_from_model"), turn: at("world_from_normal"),
        sun: at("sun"), sunlight: at("sunlight") };
    };
    this.surface = program(SURFACE); this.earthProgram = program(EARTH); this.line = program(LINE);
    this.sphere = this.uploaded(...sphere(120, 240));
    this.lineBuffer = gl.createBuffer();
  }

  uploaded(positions, normals, colours, triangles, groups) {
    const gl = this.gl;
    const buffer = (kind, data) => {
      const b = gl.createBuffer();
      gl.bindBuffer(kind, b); gl.bufferData(kind, data, gl.STATIC_DRAW);
      return b;
    };
    return { positions: buffer(gl.ARRAY_BUFFER, positions), normals: buffer(gl.ARRAY_BUFFER, normals),
      colours: colours && buffer(gl.ARRAY_BUFFER, colours),
      triangles: buffer(gl.ELEMENT_ARRAY_BUFFER, triangles), groups: groups || [triangles.length / 3] };
  }

  async setScenario(scenario) {
    this.scenario = scenario; this.scene = null; this.models.clear();
    const names = Object.keys(scenario.spacecraft);
    this.focus = this.lastCraft = names[0] || "Earth";
    this.nearView();
    if (!this.gl) return;
    for (const name of names) {
      const reply = await fetch("model/" + encodeURIComponent(name));
      if (reply.ok && this.scenario === scenario) this.models.set(name, this.readModel(await reply.arrayBuffer()));
      this.redraw();
    }
  }

  // Reads what simgl/web/scene_description.py model_bytes writes.
  readModel(data) {
    const size = new DataView(data).getUint32(0, true);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, size)));
    const n = head.vertices;
    let at = 4 + size;
    const take = (Type, count) => { const a = new Type(data, at, count); at += a.byteLength; return a; };
    return this.uploaded(take(Float32Array, 3 * n), take(Float32Array, 3 * n), take(Uint8Array, 4 * n),
      take(Uint32Array, 3 * head.triangles), head.groups);
  }

  show(scene) {
    const isFirst = !this.scene;
    this.scene = scene;
    if (isFirst) this.facesSunlitSide();
    this.redraw();
  }

  facesSunlitSide() {
    const sunlit = (azimuth) => { this.azimuth = azimuth; this.middle = this.centre(); return dot(this.axes().out, this.sun()); };
    const turns = [...Array(8).keys()].map((i) => 0.7 + i * Math.PI / 4).sort((a, b) => sunlit(b) - sunlit(a));
    this.azimuth = turns[0];
  }


  nearView() {
    if (!this.scenario.spacecraft[this.focus]) this.focus = this.lastCraft;
    const craft = this.scenario.spacecraft[this.focus];
    this.distance = craft ? 4 * craft.radius_m : 2.5e7;
    this.redraw();
  }

  farView() {
    const radii = this.scenario.earth_radii_m;
    if (radii && this.focus !== "Earth") {
      this.lastCraft = this.focus; this.focus = "Earth";
      // The terminator is in sight.
      const sun = this.scene ? this.sun() : [1, 0, 0];
      this.azimuth = Math.atan2(sun[1], sun[0]) + 0.5 * Math.PI + 1.0;
    }
    const places = Object.values(this.scene ? this.scene.spacecraft : {}).map((s) => s.position_m);
    const spread = Math.max(1, ...places.map((p) => length(sub(p, this.centre()))));
    this.distance = radii ? 3.2 * radii[0] : 3 * spread;
    this.redraw();
  }

  centre() {
    if (!this.scene) return [0, 0, 0];
    const craft = this.scene.spacecraft[this.focus];
    if (craft) return craft.position_m;
    return this.scene.earth ? this.scene.earth.position_m : [0, 0, 0];
  }

  // The eye's axes: up is the zenith of what it circles, or the north of ICRF.
  axes() {
    const centre = this.centre();
    const circles = this.scene.earth && this.scene.spacecraft[this.focus];
    const top = circles ? unit(sub(centre, this.scene.earth.position_m)) : [0, 0, 1];
    const start = Math.abs(top[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0];
    const east = unit(cross(start, top)), north = cross(top, east);
    const [a, e] = [this.azimuth, this.elevation];
    const level = add(east.map((v) => v * Math.cos(a)), north, Math.sin(a));
    const out = add(level.map((v) => v * Math.cos(e)), top, Math.sin(e));
    const right = unit(cross(top, out));
    return { out, right, up: cross(out, right) };
  }

  redraw() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => { this.asked = false; this.draw(); });
  }

  draw() {
    const { canvas, gl, scene } = this;
    this.labels.replaceChildren();
    if (!scene) return;
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    const [w, h] = [canvas.clientWidth, canvas.clientHeight];
    canvas.width = Math.max(1, Math.round(w * scale)); canvas.height = Math.max(1, Math.round(h * scale));
    this.size = [w, h];
    this.middle = this.centre();
    const { out, right, up } = this.axes();
    this.eye = out.map((v) => v * this.distance);
    this.view = rigid([right, up, out], [0, 0, -this.distance]);
    if (gl) {
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clearColor(0.02, 0.024, 0.04, 1); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST); gl.disable(gl.CULL_FACE);
      this.drawFar();
      gl.clear(gl.DEPTH_BUFFER_BIT);
      this.drawNear();
    } else this.label(this.middle, "WebGL is not available in this browser", "#ffb4a2");
    this.drawLabels();
  }

  projection(near, far) {
    const f = 1 / Math.tan(0.35), aspect = this.size[0] / this.size[1];
    const [a, b] = [(far + near) / (near - far), (2 * far * near) / (near - far)];
    return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, a, -1, 0, 0, b, 0];
  }

  drawFar() {
    const { scene } = this, earth = scene.earth;
    if (!earth) return;
    const to_earth = sub(earth.position_m, this.middle);
    const height = Math.max(length(sub(to_earth, this.eye)) - earth.radii_m[0], 1e4);
    this.clip = product(this.projection(0.02 * height, 1e9), this.view);
    const R = earth.R_icrf_from_itrf;
    const scaled = R.map((row) => row.map((v, i) => v * earth.radii_m[i]));
    this.mesh(this.earthProgram, this.sphere, [rigid(scaled, to_earth)], earth.sun_direction, 1, [rigid(R, [0, 0, 0])]);
    for (const points of Object.values(scene.orbits)) this.lines(points, ORBIT);
  }

  drawNear() {
    const { scene } = this, d = this.distance;
    this.clip = product(this.projection(d * 1e-3, d * 1e3), this.view);
    for (const [name, craft] of Object.entries(scene.spacecraft)) {
      const model = this.models.get(name);
      if (!model) continue;
      const body = rigid(craft.R_icrf_from_body, sub(craft.position_m, this.middle));
      const worlds = model.groups.map((_, i) => craft.joints[i] ? product(body, columnMajor(craft.joints[i])) : body);
      this.mesh(this.surface, model, worlds, craft.sun_direction, craft.sunlit_share, worlds);
    }
    for (const camera of Object.values(scene.cameras)) this.field(camera);
    // Again: the far view's near plane cuts off what is close to the eye.
    if (d < CLOSE) for (const points of Object.values(scene.orbits)) this.lines(points, ORBIT);
    const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    const colours = [[1, 0.35, 0.35, 1], [0.4, 0.9, 0.4, 1], [0.5, 0.65, 1, 1]];
    axes.forEach((axis, i) => this.lines([this.middle, add(this.middle, axis, 0.22 * d)], colours[i]));
    this.lines([this.middle, add(this.middle, this.sun(), 0.36 * d)], [1, 0.85, 0.3, 1]);
  }

  sun() {
    const craft = this.scene.spacecraft[this.focus] || Object.values(this.scene.spacecraft)[0];
    return craft ? craft.sun_direction : this.scene.earth ? this.scene.earth.sun_direction : [1, 0, 0];
  }

  // A camera's field: as far as the nearest spacecraft that it does not sit on.
  reach(camera) {
    const ranges = Object.values(camera.sees).map((s) => s.range_m).filter((r) => r > 0);
    return ranges.length ? Math.max(...ranges) : 0.3 * this.distance;
  }

  field(camera) {
    const at = camera.position_m, reach = this.reach(camera);
    const ends = camera.field_edge.map((ray) => add(at, ray, reach));
    if (!ends.length) return;
    const n = ends.length;
    this.lines([...ends, ends[0]], [1, 0.6, 0.9, 1]);
    for (let i = 0; i < 4; i++) this.lines([at, ends[Math.round(i * n / 4) % n]], [1, 0.6, 0.9, 1]);
  }

  mesh(program, mesh, worlds, sun, sunlight, turns) {
    const gl = this.gl;
    gl.useProgram(program.p);
    gl.uniformMatrix4fv(program.clip, false, this.clip);
    gl.uniform3fv(program.sun, sun);
    if (program.sunlight) gl.uniform1f(program.sunlight, sunlight);
    for (const [i, name] of ["positions", "normals"].entries()) {
      gl.bindBuffer(gl.ARRAY_BUFFER, mesh[name]);
      gl.enableVertexAttribArray(i); gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 0, 0);
    }
    if (mesh.colours) {
      gl.bindBuffer(gl.ARRAY_BUFFER, mesh.colours);
      gl.enableVertexAttribArray(2); gl.vertexAttribPointer(2, 4, gl.UNSIGNED_BYTE, true, 0, 0);
    } else gl.disableVertexAttribArray(2);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles);
    let first = 0;
    mesh.groups.forEach((count, i) => {
      gl.uniformMatrix4fv(program.world, false, worlds[i]);
      gl.uniformMatrix3fv(program.turn, false, rotationOf(turns[i]));
      gl.drawElements(gl.TRIANGLES, 3 * count, gl.UNSIGNED_INT, 12 * first);
      first += count;
    });
  }

  lines(points, colour) {
    const gl = this.gl;
    gl.useProgram(this.line.p);
    gl.uniformMatrix4fv(this.line.clip, false, this.clip);
    gl.uniformMatrix4fv(this.line.world, false, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lineBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(points.flatMap((p) => sub(p, this.middle))), gl.STREAM_DRAW);
    gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    gl.disableVertexAttribArray(1); gl.disableVertexAttribArray(2);
    gl.vertexAttrib4fv(2, colour);
    gl.drawArrays(gl.LINE_STRIP, 0, points.length);
  }

  drawLabels() {
    const { scene } = this, d = this.distance, taken = [];
    const put = (place, text, colour) => this.label(place, text, colour, taken);
    for (const [name, craft] of Object.entries(scene.spacecraft)) put(craft.position_m, "• " + name, "#fff");
    for (const [name, camera] of Object.entries(scene.cameras)) put(camera.position_m, "▸ " + name, "#ff9ee6");
    put(add(this.middle, this.sun(), 0.36 * d), "Sun", "#ffd94d");
    [["x", [1, 0, 0], "#ff7a7a"], ["y", [0, 1, 0], "#7be07b"], ["z", [0, 0, 1], "#8fb0ff"]].forEach(
      ([text, axis, colour]) => put(add(this.middle, axis, 0.22 * d), text, colour));
  }

  // Labels that would cover one another are moved down.
  label(place, text, colour, taken = []) {
    const at = this.onScreen(place);
    if (!at) return;
    let [x, y] = at;
    y -= 8;
    while (taken.some(([tx, ty]) => Math.abs(tx - x) < 90 && Math.abs(ty - y) < 15)) y += 15;
    taken.push([x, y]);
    const span = document.createElement("span");
    span.textContent = text; span.style.color = colour;
    span.style.transform = `translate(${x - 3}px, ${y}px)`;
    this.labels.append(span);
  }

  // Pixels of a place; null behind the eye, outside the view or behind the Earth.
  onScreen(place) {
    const { out, right, up } = this.axes();
    const p = sub(sub(place, this.middle), this.eye);
    const depth = -dot(p, out);
    if (depth <= 0 || this.isBehindEarth(p)) return null;
    const f = 0.5 * this.size[1] / Math.tan(0.35);
    const x = 0.5 * this.size[0] + f * dot(p, right) / depth, y = 0.5 * this.size[1] - f * dot(p, up) / depth;
    return x < 0 || y < 0 || x > this.size[0] || y > this.size[1] ? null : [x, y];
  }

  isBehindEarth(p) {
    const earth = this.scene.earth;
    if (!earth) return false;
    const c = sub(sub(earth.position_m, this.middle), this.eye), l = length(p), ray = unit(p);
    const along = dot(c, ray), r = earth.radii_m[2], miss = dot(c, c) - along * along;
    return along > 0 && miss < r * r && along - Math.sqrt(r * r - miss) < l * 0.999;
  }

  turn(right, down) {
    this.azimuth -= right;
    this.elevation = Math.min(1.55, Math.max(-1.55, this.elevation + down));
    this.redraw();
  }

  zoom(factor) {
    this.distance = Math.min(2e8, Math.max(0.05, this.distance * factor));
    this.redraw();
  }

  listen() {
    const { canvas } = this, held = new Map();
    canvas.addEventListener("pointerdown", (e) => {
      canvas.setPointerCapture(e.pointerId); held.set(e.pointerId, [e.clientX, e.clientY]);
    });
    canvas.addEventListener("pointermove", (e) => {
      const last = held.get(e.pointerId);
      if (!last) return;
      const others = [...held].filter(([id]) => id !== e.pointerId).map(([, place]) => place);
      if (others.length) {
        const gap = ([x, y]) => Math.hypot(x - others[0][0], y - others[0][1]) || 1;
        this.zoom(gap(last) / gap([e.clientX, e.clientY]));
      } else this.turn((e.clientX - last[0]) * 0.008, (e.clientY - last[1]) * 0.008);
      held.set(e.pointerId, [e.clientX, e.clientY]);
    });
    for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (e) => held.delete(e.pointerId));
    canvas.addEventListener("wheel", (e) => { e.preventDefault(); this.zoom(Math.exp(0.0015 * e.deltaY)); }, { passive: false });
    const keys = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
    canvas.addEventListener("keydown", (e) => {
      if (keys[e.key]) this.turn(...keys[e.key]);
      else if (e.key === "+" || e.key === "=") this.zoom(0.87);
      else if (e.key === "-") this.zoom(1.15);
      else return;
      e.preventDefault();
    });
  }
}

function sphere(rows, columns) {
  const p = [], t = [];
  for (let i = 0; i <= rows; i++) for (let j = 0; j <= columns; j++) {
    const [a, b] = [Math.PI * (i / rows - 0.5), 2 * Math.PI * j / columns];
    p.push(Math.cos(a) * Math.cos(b), Math.cos(a) * Math.sin(b), Math.sin(a));
    if (i < rows && j < columns) {
      const k = i * (columns + 1) + j, n = k + columns + 1;
      t.push(k, k + 1, n, k + 1, n + 1, n);
    }
  }
  const positions = new Float32Array(p);
  return [positions, positions, null, new Uint32Array(t)];
}
