// SPDX-License-Identifier: Apache-2.0
// Draws the stage and the charts.

/** Stores the last `size` rows of the simulation. */
export class Track {
  constructor(columns, size) {
    this.columns = columns;
    this.size = size;
    this.clear();
  }
  clear() {
    this.rows = [];
  }
  add(numbers) {
    for (let i = 0; i < numbers.length; i += this.columns.length) this.rows.push(numbers.subarray(i, i + this.columns.length));
    if (this.rows.length > 2 * this.size) this.rows = this.rows.slice(-this.size);
  }
  get last() {
    return this.rows.at(-1);
  }
  newest() {
    return this.rows.slice(-this.size);
  }
}

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`);

/** Clears the canvas, and returns its context and its size in CSS pixels. */
function prepared(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas;
  const ratio = devicePixelRatio;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "12px system-ui, sans-serif";
  return { pen, width, height };
}

function arrow(pen, x, y, dx, dy) {
  const length = Math.hypot(dx, dy);
  if (length < 3) return;
  const [ux, uy] = [dx / length, dy / length];
  pen.beginPath();
  pen.moveTo(x, y);
  pen.lineTo(x + dx, y + dy);
  for (const side of [1, -1]) {
    pen.moveTo(x + dx, y + dy);
    pen.lineTo(x + dx - 8 * ux + 5 * side * uy, y + dy - 8 * uy - 5 * side * ux);
  }
  pen.stroke();
}

/** Returns the scale in pixels per meter, and the origin. */
export const scaleOf = (canvas, reach) => ({
  scale: Math.min(canvas.clientWidth / (2 * reach), canvas.clientHeight / reach),
  x0: canvas.clientWidth / 2,
  y0: canvas.clientHeight / 2,
});

const kMetresPerNewton = 0.003;

export function drawStage(canvas, row, at, wish, reach) {
  const { pen, width, height } = prepared(canvas);
  const { scale, x0, y0 } = scaleOf(canvas, reach);
  pen.fillStyle = colour("wall");
  pen.fillRect(x0, 0, width - x0, height);
  pen.fillStyle = colour("quiet");
  pen.textAlign = "right";
  pen.fillText("wall", width - 10, 18);
  const place = (x, y) => [x0 + x * scale, y0 - y * scale];
  const [hx, hy] = place(row[at.x_m], row[at.y_m]);
  const [wx, wy] = place(wish.x, wish.y);
  pen.lineWidth = 2;
  pen.strokeStyle = colour("wish");
  pen.beginPath();
  pen.moveTo(wx, wy);
  pen.lineTo(hx, hy);
  pen.stroke();
  pen.beginPath();
  pen.arc(wx, wy, 8, 0, 7);
  pen.stroke();
  pen.fillStyle = colour("hand");
  pen.beginPath();
  pen.arc(hx, hy, 11, 0, 7);
  pen.fill();
  pen.strokeStyle = colour("force");
  pen.lineWidth = 3;
  arrow(pen, hx, hy, row[at.force_x_n] * kMetresPerNewton * scale, -row[at.force_y_n] * kMetresPerNewton * scale);
}

/** Returns the next larger number that is 1, 2, 5 or 10 times a power of ten. */
function nice(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * [1, 2, 5, 10].find((step) => step * power >= value * 0.999);
}

const kGutter = 60; // for the labels

/**
 * Draws lines {column, name, thick} over time. The axis contains `least`, `most` and the last line, in `factor` per unit
 * of the column. If `below` is set, the area between the last line and 0 is filled where the line is negative.
 */
export function drawChart(canvas, track, lines, { least, most, factor, unit, below, wall }) {
  const { pen, width, height } = prepared(canvas);
  const rows = track.newest();
  for (const row of rows) {
    const value = row[lines.at(-1).column] * factor;
    least = Math.min(least, value);
    most = Math.max(most, value);
  }
  most = nice(most);
  least = -nice(-least);
  const y = (value) => 6 + ((most - value) / (most - least)) * (height - 12);
  const x = (i) => kGutter + (i / track.size) * (width - kGutter);
  if (wall) {
    pen.fillStyle = colour("wall");
    pen.fillRect(kGutter, 0, width - kGutter, y(0));
  }
  pen.fillStyle = colour("rule");
  pen.fillRect(kGutter, y(0), width - kGutter, 1);
  pen.fillStyle = colour("quiet");
  pen.textAlign = "right";
  for (const value of [0, most, least]) {
    if (value !== 0 && Math.abs(y(value) - y(0)) < 14) continue;
    pen.fillText(`${value} ${unit}`.replace("-", "−"), kGutter - 6, Math.min(height - 3, Math.max(11, y(value) + 4)));
  }
  const stride = Math.max(1, Math.floor(rows.length / (2 * width)));
  for (const { column, name, thick } of lines) {
    pen.beginPath();
    for (let i = 0; i < rows.length; i += stride) pen.lineTo(x(i), y(rows[i][column] * factor));
    pen.strokeStyle = colour(name);
    pen.lineWidth = thick;
    pen.stroke();
  }
  if (!below) return;
  pen.lineTo(x(rows.length), y(0));
  pen.lineTo(kGutter, y(0));
  const area = new Path2D();
  area.rect(0, y(0), width, height);
  pen.save();
  pen.clip(area);
  pen.fillStyle = colour("bad");
  pen.globalAlpha = 0.35;
  pen.fill();
  pen.restore();
}
