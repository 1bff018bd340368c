// SPDX-License-Identifier: Apache-2.0
import { h, mark, say } from "./dom.js";
import type { Order, PressInfo, ServerMessage } from "./stream.js";
import type { Level } from "./words.js";

/** From the address that tendon-dash says when it starts: `#/operator/PASS`. Of this tab only, and of no history. */
const kPass = "operator-pass";
export function takePass(pass: string): void {
  sessionStorage.setItem(kPass, pass);
  location.replace("#/live");
}

/** Whether this tab may press: tendon-dash may, and the tab has the pass. */
export const mayPress = (server: ServerMessage | undefined): boolean => server?.arms === true && sessionStorage.getItem(kPass) !== null;

/** Begins an order; why it does not begin, or undefined when it does. */
export async function press(order: Order, device: number): Promise<string | undefined> {
  try {
    const answer = await fetch(`/api/${order}?device=${device}`, { method: "POST", headers: { authorization: `Bearer ${sessionStorage.getItem(kPass)}` } });
    return answer.ok ? undefined : (await answer.text()).trim();
  } catch {
    return "tendon-dash does not answer. The request was probably not carried out.";
  }
}

/** How long a success is shown: later the device's state may have changed. A failure stays. */
const kToldMs = 8000;

/**
 * The device's safety in words, and the two buttons. A press only starts an order; the server of this page tells its
 * result to every page that looks on.
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
  /** Why our own press was not taken; until the next one, or until the server of this page tells something newer. */
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
      // The result of an order given before this page opened is not shown.
      this.#toldAt = this.#told === undefined ? -Infinity : performance.now();
      this.#told = told;
    }
    // Nor is an arming shown when the device is no longer armed.
    const over = server?.press?.order === "arm" && state.level !== "good";
    const old = server?.press?.state === "done" && (over || performance.now() - this.#toldAt > kToldMs);
    const ours = server?.press?.order === "arm" || server?.press?.order === "disarm";
    const press = ours && server?.press?.device === device && !old ? server.press : undefined;
    const objection = server ? (server.devices.find((d) => d.number === device)?.arming_objection ?? "The server has not listed its devices yet.") : "tendon-dash does not answer.";
    const busy = server?.press?.state === "under_way" ? server.press : undefined;
    const withoutPass = server?.arms === true && !mayPress(server);
    this.#group.hidden = !mayPress(server);
    this.#buttons.arm.disabled = objection !== "" || busy !== undefined;
    // It goes before an arming.
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
