// SPDX-License-Identifier: Apache-2.0
// A page that renders a wall at x = 0, using the WebSocket bridge. Use `npm run page` to see it.
import { connect, parseKeyFile, webSocket, type DeviceState, type Guest } from "tendon-client";
import { draw } from "./picture.js";

let guest: Guest | undefined;
let hand: DeviceState | undefined;

document.querySelector("form")!.addEventListener("submit", (event) => {
  event.preventDefault();
  const form = new FormData(event.target as HTMLFormElement);
  const line = String(form.get("key"));
  guest?.stop();
  guest = connect(webSocket(String(form.get("bridge"))), { name: "page", key: line ? parseKeyFile(line).key : undefined }, {
    physics: (state) => ({ x: -2000 * Math.max((hand = state).position.x, 0), y: 0, z: 0 }),
  });
});

requestAnimationFrame(function show() {
  if (guest) draw(guest.stats(), hand);
  requestAnimationFrame(show);
});
