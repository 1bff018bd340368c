// SPDX-License-Identifier: Apache-2.0
//
// The choice of 2-D or 3-D for the entire page, stored in this browser.
import { h, mark, say } from "../dom.js";

const kKey = "view";
const listeners: (() => void)[] = [];
let chosen = localStorage.getItem(kKey) === "3d";

export const inSpace = (): boolean => chosen;

export function onChoice(changed: () => void): void {
  listeners.push(changed);
}

function choose(space: boolean): void {
  chosen = space;
  localStorage.setItem(kKey, space ? "3d" : "2d");
  tell();
  for (const changed of listeners) changed();
}

export const spaceButton = h("button", { type: "button", id: "space", title: "Switch between the plots and the 3-D view (key 3)", click: () => choose(!chosen) });
function tell(): void {
  mark(spaceButton, "aria-pressed", String(chosen));
  mark(spaceButton, "aria-label", "3-D view");
  say(spaceButton, "3-D");
}
tell();

document.addEventListener("keydown", (event) => {
  if (event.key !== "3" || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.target instanceof HTMLElement && event.target.closest("input, select, textarea")) return;
  choose(!chosen);
});
