// SPDX-License-Identifier: Apache-2.0
import { drawChart, drawStage, scaleOf, Track } from "./view.js";

const $ = (id) => document.getElementById(id);
const kSeconds = 4; // shown by the charts
const kLongestFrame = 50; // ms of simulation; limits the work if the machine is too slow
const kKeySpeed = 0.06; // m/s
const kAlone = { amplitude: 0.015, frequency: 0.5 }; // m, Hz: the motion of deploy/scenes/demo.toml

const worker = new Worker("worker.js");
let about; // the description of the simulation
let at; // columns by name
let track;
let wish = { x: -kAlone.amplitude, y: 0 };
let run = 0; // the number of the current run, because rows of the last one may still arrive
let waiting = false;
let least = 0; // J, of the current run
let before = performance.now();
let alone = 0; // s
const pressed = new Set();

const controls = () => [...about.sliders.map(({ key }) => $(key)), $("law")];

/** In the order of the arguments of the simulation. */
const settings = () => [...about.sliders.map(({ key }) => Number($(key).value)), $("law").selectedIndex];

function make() {
  for (const { key, label, unit, least, most, step, usual } of about.sliders) {
    const row = document.createElement("label");
    row.append(label, Object.assign(document.createElement("output"), { id: `${key}-value` }));
    const input = Object.assign(document.createElement("input"), { type: "range", id: key, min: least, max: most, step, value: usual });
    input.dataset.unit = unit;
    input.setAttribute("aria-label", label);
    row.append(input);
    $("sliders").append(row);
  }
  for (const { name, what } of about.laws) $("law").append(new Option(name, name, false, name === about.usual_law));
  for (const control of controls()) control.addEventListener("input", restart);
}

function reset() {
  for (const { key, usual } of about.sliders) $(key).value = usual;
  $("law").value = about.usual_law;
}

/** Reads the settings from the address, and returns the errors. */
function readAddress() {
  const wrong = [];
  for (const [key, text] of new URLSearchParams(location.hash.slice(1))) {
    const slider = about.sliders.find((one) => one.key === key);
    if (key === "law" && about.laws.some(({ name }) => name === text)) $("law").value = text;
    else if (key === "law") wrong.push(`law: expected one of the list, found "${text}".`);
    else if (!slider) wrong.push(`"${key}" is not a setting.`);
    else {
      $(key).value = text;
      if (text.trim() === "" || Number($(key).value) !== Number(text)) {
        wrong.push(`${key}: expected ${slider.least} to ${slider.most} in steps of ${slider.step}, found "${text}".`);
        $(key).value = slider.usual;
      }
    }
  }
  return wrong;
}

/** Starts a new run with the current settings. */
function restart() {
  for (const { key, unit } of about.sliders) {
    const text = `${$(key).value} ${unit}`.trim();
    $(`${key}-value`).textContent = text;
    $(key).setAttribute("aria-valuetext", text);
  }
  $("what").textContent = about.laws[$("law").selectedIndex].what;
  run += 1;
  least = 0;
  waiting = false;
  track.clear();
  worker.postMessage({ settings: settings(), ...wish });
}

function move(x, y) {
  const within = (value) => Math.max(-about.reach_m, Math.min(about.reach_m, value));
  wish = { x: within(x), y: within(y) };
}

function guide(seconds) {
  if ($("alone").checked) {
    alone += seconds;
    move(-kAlone.amplitude * Math.cos(2 * Math.PI * kAlone.frequency * alone), 0);
  }
  const way = (plus, minus) => (pressed.has(plus) - pressed.has(minus)) * kKeySpeed * seconds;
  move(wish.x + way("ArrowRight", "ArrowLeft"), wish.y + way("ArrowUp", "ArrowDown"));
}

function frame(now) {
  requestAnimationFrame(frame);
  if (!waiting) {
    const count = Math.min(kLongestFrame, Math.round((now - before) / 1000 / about.period_s));
    before = now;
    if (count > 0) {
      guide(count * about.period_s);
      waiting = true;
      worker.postMessage({ count, ...wish, run, columns: about.columns.length });
    }
  }
  if (track.last) draw();
}

const shown = (value, digits) => (Math.abs(value) < 0.5 * 10 ** -digits ? 0 : value).toFixed(digits).replace("-", "−");

function draw() {
  const row = track.last;
  drawStage($("stage"), row, at, wish, about.reach_m);
  const millimetres = { least: -20, most: 20, factor: 1000, unit: "mm", wall: true };
  drawChart($("positions"), track, [{ column: at.wish_x_m, name: "wish", thick: 1.5 }, { column: at.x_m, name: "hand", thick: 2 }], millimetres);
  const newtons = { least: -10, most: 5, factor: 1, unit: "N" };
  drawChart($("forces"), track, [{ column: at.true_force_n, name: "quiet", thick: 1.5 }, { column: at.force_x_n, name: "force", thick: 2 }], newtons);
  drawChart($("energies"), track, [{ column: at.energy_j, name: "energy", thick: 2 }], { least: -0.01, most: 0.05, factor: 1, unit: "J", below: true });
  $("position").textContent = `${shown(row[at.x_m] * 1000, 1)} mm`;
  $("force").textContent = `${shown(row[at.force_x_n], 1)} N`;
  $("energy").textContent = `${shown(row[at.energy_j], 3)} J`;
  $("stage").dataset.wish = `${wish.x} ${wish.y}`;
  $("stage").dataset.t = row[at.t_s];
}

/** Only changes the text if it is different, because screen readers read it. */
function judge() {
  const bad = least < -1e-9;
  const text = bad ? `The wall has generated ${least < -1 ? "more than 1\u00a0J" : least < -0.01 ? "energy" : "a little energy"}: the hand can shake.` : "No energy generated: the contact is passive.";
  if ($("verdict").textContent === text) return;
  $("verdict").textContent = text;
  $("verdict").className = bad ? "bad" : "good";
}

worker.onmessage = ({ data }) => {
  if (data.description) begin(data.description);
  if (data.command) $("command").textContent = data.command;
  if (!data.rows || data.run !== run) return;
  waiting = false;
  track.add(data.rows);
  for (let i = at.energy_j; i < data.rows.length; i += about.columns.length) least = Math.min(least, data.rows[i]);
  judge();
};
worker.onerror = ({ message }) => {
  $("verdict").className = "bad";
  $("verdict").textContent = `The simulation has stopped: ${message}. Does the server send all files of this folder?`;
};

async function copied(text, what) {
  try {
    await navigator.clipboard.writeText(text);
    $("said").textContent = `${what} copied.`;
  } catch {
    $("said").textContent = `${what}: this browser does not let the page copy. Select it and copy it.`;
  }
}

function begin(description) {
  about = description;
  at = Object.fromEntries(about.columns.map((name, i) => [name, i]));
  track = new Track(about.columns, kSeconds / about.period_s);
  make();
  $("said").textContent = readAddress().join(" ");
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) $("alone").checked = false;
  restart();
  requestAnimationFrame(frame);
}

addEventListener("hashchange", () => {
  reset();
  $("said").textContent = readAddress().join(" ");
  restart();
});
$("share").addEventListener("click", () => {
  const words = new URLSearchParams([...controls()].map(({ id, value }) => [id, value]));
  history.replaceState(null, "", `#${words}`);
  copied(location.href, "Address");
});
$("copy").addEventListener("click", () => copied($("command").textContent, "Command"));
$("reset").addEventListener("click", () => {
  reset();
  restart();
});

const stage = $("stage");
function point(event) {
  const { scale, x0, y0 } = scaleOf(stage, about.reach_m);
  $("alone").checked = false;
  move((event.offsetX - x0) / scale, (y0 - event.offsetY) / scale);
}
stage.addEventListener("pointerdown", (event) => {
  stage.setPointerCapture(event.pointerId);
  point(event);
});
stage.addEventListener("pointermove", (event) => (event.pointerType === "mouse" || event.buttons) && point(event));
stage.addEventListener("keydown", (event) => {
  if (!event.key.startsWith("Arrow")) return;
  event.preventDefault();
  $("alone").checked = false;
  pressed.add(event.key);
});
stage.addEventListener("keyup", ({ key }) => pressed.delete(key));
stage.addEventListener("blur", () => pressed.clear());
