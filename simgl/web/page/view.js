// The page: gets the newest snapshot whenever it has shown the last one, and says what to change.
import { Scene3d } from "./scene3d.js";

const $ = (id) => document.getElementById(id);
const scene3d = new Scene3d($("scene3d"), $("labels"));
let scenario = null, socket = null, update = null, picture = null, retry = 500;
// Controls that a person holds are not moved by updates for this long [ms].
const HELD = 700;
const touched = new Map();
const isHeld = (id) => performance.now() - (touched.get(id) || -1e9) < HELD;

const SHOWN = [["dn", "DN"], ["radiance", "radiance, false colours"], ["electrons", "mean electrons"], ["depth", "depth"],
  ["light: sun", "light of the Sun"], ["light: earth", "light of the Earth"], ["light: lamp", "light of lamps"],
  ["light: inter_reflected", "interreflected light"], ["light: emitted", "emitted light"], ["light: background", "background"]];

function number(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-3) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    return `${Number(mantissa)} × 10${[..."" + Number(exponent)].map((c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]).join("")}`;
  }
  return String(Number(value.toPrecision(digits)));
}
const seconds = (s) => s >= 1 ? `${number(s)} s` : s >= 1e-3 ? `${number(s * 1e3)} ms` : `${number(s * 1e6)} µs`;
const metres = (m) => m >= 1e4 ? `${number(m / 1e3, 5)} km` : `${number(m, 5)} m`;

function facts(list, rows) {
  const names = [...list.querySelectorAll("dt")].map((e) => e.textContent).join("\n");
  if (names !== rows.map((r) => r[0]).join("\n")) list.replaceChildren(...rows.flatMap(([name]) => {
    const term = document.createElement("dt"), value = document.createElement("dd");
    term.textContent = name;
    return [term, value];
  }));
  list.querySelectorAll("dd").forEach((e, i) => { if (e.textContent !== rows[i][1]) e.textContent = rows[i][1]; });
}

function options(select, rows) {
  const chosen = select.value;
  select.replaceChildren(...rows.map(([value, text]) => new Option(text, value)));
  if (rows.some(([value]) => value === chosen)) select.value = chosen;
}

function say(message) { if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message)); }

function watch() {
  say({ type: "watch", camera: $("camera").value, show: $("show").value });
  $("stream").href = `stream/${encodeURIComponent($("camera").value)}.mjpg?show=${encodeURIComponent($("show").value)}`;
}

async function loadScenario() {
  scenario = await (await fetch("scenario.json")).json();
  document.title = `${scenario.name} – simgl`;
  $("title").textContent = scenario.name;
  const cameras = Object.keys(scenario.cameras);
  options($("camera"), cameras.map((name) => [name, name]));
  if (!$("show").options.length) options($("show"), SHOWN);
  const centres = Object.keys(scenario.spacecraft);
  if (scenario.earth_radii_m) centres.push("Earth");
  options($("focus"), centres.map((name) => [name, name]));
  $("far").hidden = !scenario.earth_radii_m && centres.length < 2;
  $("far").textContent = scenario.earth_radii_m ? "Orbit and Earth" : "All";
  $("time").max = Math.round(scenario.span_s);
  $("follows").hidden = !scenario.follows;
  $("control-form").hidden = Boolean(scenario.follows);
  $("follows").textContent = scenario.follows ? `This page follows ${scenario.follows}. Time, exposure and light are the client's.` : "";
  if (!cameras.length) note("The scenario has no camera.");
  await scene3d.setScenario(scenario);
  watch();
}

function connect() {
  const place = location.origin.replace(/^http/, "ws") + location.pathname.replace(/[^/]*$/, "view");
  socket = new WebSocket(place);
  socket.binaryType = "blob";
  socket.onopen = async () => { retry = 500; state(""); await loadScenario(); };
  socket.onclose = () => {
    state("The connection is lost; trying again.");
    setTimeout(connect, retry);
    retry = Math.min(2 * retry, 5000);
  };
  let waiting = null;
  socket.onmessage = async (event) => {
    if (typeof event.data === "string") {
      waiting = JSON.parse(event.data);
      if (waiting.has_pixels) return;
      await show(waiting, null);
    } else await show(waiting, event.data);
    ready();
  };
}

function ready() {
  if (document.hidden) document.addEventListener("visibilitychange", ready, { once: true });
  else say({ type: "ready" });
}

function state(text) { if ($("state").textContent !== text) $("state").textContent = text; }
function note(text) { $("note").textContent = text; $("note").hidden = !text; }

async function show(next, pixels) {
  if (!scenario) await loadScenario();
  update = next;
  if (pixels) {
    const url = URL.createObjectURL(pixels), image = $("pixels");
    image.src = url;
    try { await image.decode(); } catch { state("An image could not be decoded."); }
    if (picture) URL.revokeObjectURL(picture);
    picture = url;
  }
  showImage(Boolean(pixels));
  scene3d.show(update.scene);
  showScene(); showControls(); showTimes(); readPixel();
  state(update.message || "");
}

function showImage(hasPixels) {
  const image = update.image, shown = $("show").selectedOptions[0];
  const isWatched = update.camera === $("camera").value && update.show === $("show").value;
  if (!update.camera) return;
  if (hasPixels) {
    $("frame").style.setProperty("--ratio", image.width_px / image.height_px);
    if (!pixelChosen) {
      pixelChosen = true;
      $("pixel-x").value = Math.floor(image.width_px / 2); $("pixel-y").value = Math.floor(image.height_px / 2);
    }
    $("pixels").alt = `${update.camera}: ${shown.text}`;
    $("pixels").style.imageRendering = image.width_px < 400 ? "pixelated" : "auto";
    note("");
  } else if (scenario.follows) note(image ? "The loop does not ask for this; see Show." : "Waiting for an image of this camera.");
  else note(update.message ? "There is no image." : "Drawing.");
  if (!isWatched) note("Drawing.");
  $("pixels").style.visibility = picture && (hasPixels || !image) ? "visible" : "hidden";
  if (scenario.follows && image) for (const option of $("show").options) option.disabled = !image.planes.includes(option.value);
  showScale(image && image.scale);
  if (!image) { facts($("image-facts"), []); return; }
  const saturated = image.saturated_share === null ? "–" : `${number(100 * image.saturated_share, 3)} %`;
  facts($("image-facts"), [["Exposure time", seconds(image.exposure_time_s)], ["Saturated pixels", saturated],
    ["Gain", `${number(image.gain_dn_per_e)} DN/e-`], ["Frame time", `${number(image.frame_ms, 3)} ms`]]);
  for (const [id, size] of [["pixel-x", image.width_px], ["pixel-y", image.height_px]]) $(id).max = size - 1;
}

function showScale(scale) {
  $("scale").hidden = !scale;
  if (!scale) return;
  $("scale-name").textContent = `${scale.quantity} [${scale.unit}]`;
  $("bar").style.background = `linear-gradient(to right, ${scale.colours.join(", ")})`;
  const count = 4, ticks = [...Array(count + 1).keys()].map((i) => {
    const t = i / count;
    return scale.logarithmic ? scale.low * (scale.high / scale.low) ** t : scale.low + t * (scale.high - scale.low);
  });
  // As many digits as tell them apart: depths of a far target differ little.
  let digits = 3, texts;
  do texts = ticks.map((v) => number(v, digits)); while (new Set(texts).size <= count && digits++ < 9);
  $("ticks").replaceChildren(...texts.map((text) => { const s = document.createElement("span"); s.textContent = text; return s; }));
  $("bar").setAttribute("aria-label", `Colour scale from ${texts[0]} to ${texts[count]} ${scale.unit}`);
}

function showScene() {
  $("epoch").textContent = update.scene.epoch_utc.replace("T", " ").replace(/(\.\d{3})\d*/, "$1") + " UTC";
  const camera = update.scene.cameras[$("camera").value], rows = [];
  for (const [name, sight] of Object.entries(camera ? camera.sees : {})) {
    rows.push([`Range to ${name}`, metres(sight.range_m)], [`Phase angle at ${name}`, `${sight.phase_angle_deg.toFixed(2)}°`]);
  }
  for (const [name, craft] of Object.entries(update.scene.spacecraft))
    rows.push([`Sunlight on ${name}`, `${number(100 * craft.sunlit_share, 3)} %`]);
  facts($("scene-facts"), rows);
}

function directionAngles(d) {
  const ra = Math.atan2(d[1], d[0]) * 180 / Math.PI;
  return [(ra + 360) % 360, Math.asin(Math.max(-1, Math.min(1, d[2]))) * 180 / Math.PI];
}

function slide(id, value, text) {
  if (!isHeld(id)) $(id).value = value;
  $(id + "-value").textContent = text; $(id).setAttribute("aria-valuetext", text);
}

function showControls() {
  const settings = update.settings;
  if (!settings) return;
  const t = settings.time_s, sign = t < 0 ? "−" : "";
  const whole = Math.floor(Math.abs(t)), pad = (v) => String(v).padStart(2, "0");
  slide("time", t, `${sign}${Math.floor(whole / 3600)}:${pad(Math.floor(whole / 60) % 60)}:${pad(whole % 60)}`);
  $("play").textContent = settings.playing ? "Pause" : "Play";
  $("play").setAttribute("aria-pressed", settings.playing);
  if (!isHeld("speed")) $("speed").value = String(settings.speed);
  const base = scenario.cameras[$("camera").value];
  if (base && update.image) {
    const chosen = update.image.exposure_time_s;
    slide("exposure", Math.log10(chosen / base.exposure_time_s), seconds(chosen));
  }
  const [ra, dec] = settings.sun_deg || directionAngles(scene3d.scene ? scene3d.sun() : [1, 0, 0]);
  if (!isHeld("sun-given")) $("sun-given").checked = !settings.sun_deg;
  $("sun-ra").disabled = $("sun-dec").disabled = $("sun-given").checked;
  slide("sun-ra", ra, `${ra.toFixed(1)}°`); slide("sun-dec", dec, `${dec.toFixed(1).replace("-", "−")}°`);
}

function showTimes() {
  const rows = Object.entries(update.passes_ms || {}).filter(([, ms]) => ms >= 0.05).sort((a, b) => b[1] - a[1]);
  $("passes").replaceChildren(...rows.map(([name, ms]) => {
    const row = document.createElement("tr");
    for (const text of [name.replaceAll("_", " "), ms.toFixed(1)]) row.append(Object.assign(document.createElement("td"), { textContent: text }));
    return row;
  }));
  $("passes-note").hidden = rows.length > 0;
  $("passes-note").textContent = "Passes are not timed in a served loop, which that would slow.";
  facts($("statistics"), [...(update.statistics || []), ["Viewers", String(update.viewers)],
    ["Images sent to viewers", String(update.sent)], ["Dropped for slow viewers", String(update.dropped)]]);
}

let pixelChosen = false, pixelBusy = false, pixelAgain = false, pixelAt = -1e9;
async function readPixel(now = false) {
  if (!pixelChosen || !update || !update.image || (!now && performance.now() - pixelAt < 250)) return;
  // Another pixel that is chosen while one is being read; the scene may stand still afterwards.
  if (pixelBusy) { pixelAgain ||= now; return; }
  pixelBusy = true; pixelAgain = false; pixelAt = performance.now();
  const [x, y] = [$("pixel-x").value, $("pixel-y").value];
  try {
    const reply = await fetch(`pixel.json?camera=${encodeURIComponent($("camera").value)}&x=${x}&y=${y}`);
    showPixel(reply.ok ? await reply.json() : null);
  } catch { showPixel(null); } finally { pixelBusy = false; }
  if (pixelAgain) await readPixel(true);
}

function showPixel(values) {
  const { width_px: w, height_px: h } = update.image;
  $("cross").hidden = !values;
  if (!values) { facts($("pixel-facts"), [["", `no pixel there: ${w} × ${h}`]]); return; }
  $("cross").style.left = `${(values.column + 0.5) / w * 100}%`;
  $("cross").style.top = `${(values.row + 0.5) / h * 100}%`;
  const radiance = values.radiance_w_m2_sr, none = scenario.follows ? "not asked for" : "–";
  const bands = radiance ? radiance.map((v) => number(v)) : null;
  facts($("pixel-facts"), [
    ["Radiance", radiance ? `${number(radiance.reduce((a, b) => a + b))} W m-2 sr-1` : none],
    ["R, G, B, N", bands ? bands.join(", ") : none],
    ["Mean signal", values.electrons === null ? none : `${number(values.electrons, 5)} e-`],
    ["Digital number", values.dn === null ? none : `${values.dn} DN`],
    ["Depth", values.depth_m === null ? none : values.depth_m === 0 ? "no spacecraft" : metres(values.depth_m)]]);
}

$("pixels").addEventListener("click", (e) => {
  if (!update || !update.image) return;
  const box = $("pixels").getBoundingClientRect();
  $("pixel-x").value = Math.floor((e.clientX - box.left) / box.width * update.image.width_px);
  $("pixel-y").value = Math.floor((e.clientY - box.top) / box.height * update.image.height_px);
  pixelChosen = true; readPixel(true);
});
for (const id of ["pixel-x", "pixel-y"]) $(id).addEventListener("input", () => { pixelChosen = true; readPixel(true); });
$("camera").addEventListener("change", () => { watch(); if (update) showScene(); });
$("show").addEventListener("change", watch);
$("focus").addEventListener("change", () => {
  if ($("focus").value === "Earth") scene3d.farView();
  else { scene3d.focus = $("focus").value; scene3d.nearView(); }
});
$("near").addEventListener("click", () => { scene3d.nearView(); $("focus").value = scene3d.focus; });
$("far").addEventListener("click", () => { scene3d.farView(); $("focus").value = scene3d.focus; });

function control(id, message) {
  $(id).addEventListener("input", () => { touched.set(id, performance.now()); say(message()); });
}
control("time", () => ({ type: "time", time_s: Number($("time").value) }));
control("speed", () => ({ type: "speed", speed: Number($("speed").value) }));
control("exposure", () => {
  const camera = $("camera").value, base = scenario.cameras[camera];
  return { type: "exposure", camera, exposure_time_s: (base ? base.exposure_time_s : 1) * 10 ** Number($("exposure").value) };
});
const sun = () => ({ type: "sun", as_scenario: $("sun-given").checked,
  right_ascension_deg: Number($("sun-ra").value), declination_deg: Number($("sun-dec").value) });
for (const id of ["sun-given", "sun-ra", "sun-dec"]) control(id, sun);
const play = () => say({ type: "play", playing: !(update && update.settings && update.settings.playing) });
$("play").addEventListener("click", play);
document.addEventListener("keydown", (e) => {
  if (e.key === " " && (e.target === document.body || e.target === $("scene3d"))) { e.preventDefault(); play(); }
});
connect();
