// SPDX-License-Identifier: Apache-2.0
import { h, mark, say } from "./dom.js";
import type { Order, PressInfo, ServerMessage } from "./stream.js";
import type { Level } from "./words.js";

/** Password from the URL that tendon-dash prints at its start: `#/operator/PASS`. Stored only for this tab. */
const kPass = "operator-pass";
export function takePass(pass: string): void {
  sessionStorage.setItem(kPass, pass);
  location.replace("#/live");
}

/** Whether tendon-dash may arm and this tab has the password. */
export const mayPress = (server: ServerMessage | undefined): boolean => server?.arms === true && sessionStorage.getItem(kPass) !== null;

/** Starts an order. Returns the reason if it cannot be started. */
export async function press(order: Order, device: number): Promise<string | undefined> {
  try {
    const answer = await fetch(`/api/${order}?device=${device}`, { method: "POST", headers: { authorization: `Bearer ${sessionStorage.getItem(kPass)}` } });
    return answer.ok ? undefined : (await answer.text()).trim();
  } catch {
    return "tendon-dash does not answer. The request was probably not carried out.";
  }
}

/** How long a success is shown. After that, the state of the device may have changed. Failures stay. */
const kToldMs = 8000;

/**
 * The safety state of the device and the two buttons. A press only starts an order; the server sends the result to
 * all pages.
 */
export class Arming {
  readonly element: HTMLElement;
  readonly #state = h("b", {});
  readonly #meaning = h("span", { class: "quiet" });
  readonly #result = h("p", { class: "result", role: "status", hidden: true });
  readonly #needs = h("p", { class: "quiet needs", hidden: true });
  readonly #buttons: Readonly<Record<"arm" | "disarm", HTMLButtonElement>>;
  readonly #group: HTMLElement;
  #device = 0;
  /** Why our own press was refused; until the next press or a newer result. */
  #refused: string | undefined;
  #told: string | undefined;
  #toldAt = -Infinity;

  constructor() {
    const button = (order: "arm" | "disarm", text: string): HTMLButtonElement =>
      h("button", { type: "button", id: order, disabled: true, click: () => void this.#press(order) }, text);
    this.#buttons = { disarm: button("disarm", "Disarm"), arm: button("arm", "Arm") };
    this.#group = h("span", { class: "orders" }, this.#buttons.disarm, this.#buttons.arm);
    this.element = h("section", { class: "panel arming", "aria-label": "Arming" },
      h("div", { class: "head" }, h("span", { class: "words" }, this.#state, " ", this.#meaning), this.#group), this.#needs, this.#result);
  }

  draw(server: ServerMessage | undefined, device: number, state: { readonly level: Level; readonly name: string; readonly meaning: string }): void {
    this.#device = device;
    mark(this.element, "data-level", state.level);
    say(this.#state, `${state.name}:`);
    say(this.#meaning, `${state.meaning}.`);
    const told = server ? JSON.stringify(server.press) : this.#told;
    if (told !== this.#told) {
      this.#refused = undefined;
      // Results of orders given before this page was opened are not shown.
      this.#toldAt = this.#told === undefined ? -Infinity : performance.now();
      this.#told = told;
    }
    // A success is hidden when the device is no longer armed.
    const over = server?.press?.order === "arm" && state.level !== "good";
    const old = server?.press?.state === "done" && (over || performance.now() - this.#toldAt > kToldMs);
    const ours = server?.press?.order === "arm" || server?.press?.order === "disarm";
    const press = ours && server?.press?.device === device && !old ? server.press : undefined;
    const objection = server ? (server.devices.find((d) => d.number === device)?.arming_objection ?? "The server has not listed its devices yet.") : "tendon-dash does not answer.";
    const busy = server?.press?.state === "under_way" ? server.press : undefined;
    const withoutPass = server?.arms === true && !mayPress(server);
    this.#group.hidden = !mayPress(server);
    this.#buttons.arm.disabled = objection !== "" || busy !== undefined;
    // Disarming has priority over arming.
    this.#buttons.disarm.disabled = objection !== "" || busy?.order === "disarm";
    say(this.#needs, withoutPass ? "To arm and disarm here, open the address that tendon-dash printed when it started." : objection);
    this.#needs.hidden = !withoutPass && objection === "";
    const words = this.#refused ?? press?.words ?? "";
    say(this.#result, words);
    this.#result.hidden = words === "";
    mark(this.#result, "data-level", this.#refused !== undefined ? "bad" : levelOf(press));
  }

  async #press(order: Order): Promise<void> {
    this.#refused = undefined;
    this.#refused = await press(order, this.#device);
  }
}

export const levelOf = (press: PressInfo | undefined): Level =>
  press === undefined ? "off" : press.state === "done" ? "good" : press.state === "failed" ? "bad" : "notice";
