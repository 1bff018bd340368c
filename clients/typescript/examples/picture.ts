// SPDX-License-Identifier: Apache-2.0
// Draws the picture in browser.html: the hand, the force on it, and the last seconds of both.
import { reasonNames, type ClientStats, type DeviceState } from "tendon-client";

const kFrames = 300;
const history: { readonly x: number; readonly f: number }[] = [];

function set(id: string, attributes: Record<string, number | string>): void {
  for (const [name, value] of Object.entries(attributes)) document.getElementById(id)!.setAttribute(name, String(value));
}

export function draw({ phase, reason, states, forces, link }: ClientStats, hand: DeviceState | undefined): void {
  const lines = [`${phase} ${reason}`];
  if (hand && link) {
    const [x, f] = [1000 * hand.position.x, hand.forceApplied.x];
    if (history.push({ x, f }) > kFrames) history.shift();
    const points = (name: "x" | "f"): string =>
      history.map((one, i) => `${(60 * i) / kFrames - 30},${17 - 0.75 * one[name]}`).join(" ");
    set("hand", { cx: x });
    set("force", { x1: x, x2: x + 3 * f });
    set("positions", { points: points("x") });
    set("forces", { points: points("f") });
    lines.push(
      `hand at ${x.toFixed(2)} mm, force ${f.toFixed(2)} N ${reasonNames(hand.reasons).join(", ")}`,
      `round trip ${link.smoothedRoundTripMs.toFixed(2)} ms, ${states} states, ${forces} forces, ${link.lost} lost`);
  }
  document.querySelector("output")!.textContent = lines.join("\n");
}
