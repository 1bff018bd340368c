// SPDX-License-Identifier: Apache-2.0
import "uplot/dist/uPlot.min.css";
import "./style.css";
import { takePass } from "./arming.js";
import { h, mark, s, say } from "./dom.js";
import { Live } from "./live.js";
import { Runs } from "./runs.js";
import { onChoice, spaceButton } from "./space/choice.js";
import type { ServerMessage } from "./stream.js";

const contact = h("span", { class: "contact", role: "status", "data-level": "off" });
const place = h("div", { class: "place" });
const tabs = { live: h("a", { href: "#/live" }, "Live"), recordings: h("a", { href: "#/recordings" }, "Recordings") };

/** "auto" follows the system. The choice is stored in this browser. */
const kThemes = ["auto", "light", "dark"] as const;
const themeButton = h("button", { type: "button", id: "theme", class: "quiet" });
function setTheme(name: string): void {
  if (name === "auto") document.documentElement.removeAttribute("data-theme");
  else document.documentElement.setAttribute("data-theme", name);
  say(themeButton, name === "auto" ? "◐" : name === "light" ? "○" : "●");
  mark(themeButton, "title", `Colours: ${name === "auto" ? "as the system's" : name}`);
  mark(themeButton, "aria-label", `Colours: ${name}`);
  live.repaint();
  runs.repaint();
}
themeButton.addEventListener("click", () => {
  const next = kThemes[(kThemes.indexOf((localStorage.getItem("theme") ?? "auto") as (typeof kThemes)[number]) + 1) % kThemes.length]!;
  localStorage.setItem("theme", next);
  setTheme(next);
});

function told(server: ServerMessage | undefined, words: string): void {
  const level = !server ? "bad" : server.contact === "open" ? "good" : server.contact === "greeting" ? "off" : "bad";
  mark(contact, "data-level", level);
  say(contact, words);
  tabs.recordings.hidden = server ? !server.recordings : false;
}

const live = new Live(told);
const runs = new Runs();

const mark_ = s("svg", { viewBox: "0 0 32 32", class: "logo", "aria-hidden": "true" },
  s("rect", { width: 32, height: 32, rx: 7 }), s("path", { d: "M4 20h5c3 0 3-10 6-10s3 14 6 14 3-8 7-8" }));
document.body.append(
  h("header", {}, h("a", { href: "#/live", class: "brand" }, mark_ as unknown as HTMLElement, "Tendon"), contact, h("nav", {}, tabs.live, tabs.recordings), spaceButton, themeButton),
  place);

/** Returns the parts of a path after its "#/", or undefined if the percent-encoding is invalid. */
function partsOf(path: string): string[] | undefined {
  try {
    return path.replace(/^#?\/?/, "").split("/").map(decodeURIComponent);
  } catch {
    return undefined;
  }
}

function route(): void {
  const [path = "", query] = location.hash.split("?");
  const [where = "", ...names] = partsOf(path) ?? ["?"];
  if (where === "operator" && names[0]) return takePass(names[0]);
  const here = where === "" ? "live" : where;
  tabs.live.classList.toggle("here", here === "live");
  tabs.recordings.classList.toggle("here", here === "recordings");
  if (here === "live") return place.replaceChildren(live.element);
  if (here !== "recordings") return place.replaceChildren(unknown(location.hash));
  place.replaceChildren(runs.element);
  const from = Number(new URLSearchParams(query).get("from"));
  void runs.show(names, from > 0 && Number.isFinite(from) ? from : 0);
}

const unknown = (address: string): HTMLElement =>
  h("main", { class: "recordings" },
    h("p", { class: "error", role: "alert", text: `There is no page at ${address}. There are two: Live and Recordings.` }),
    h("a", { href: "#/live" }, "Live"), " ", h("a", { href: "#/recordings" }, "Recordings"));
onChoice(() => (live.chosen(), runs.repaint()));
window.addEventListener("hashchange", route);
window.addEventListener("resize", () => (live.repaint(), runs.repaint()));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => (live.repaint(), runs.repaint()));
setTheme(localStorage.getItem("theme") ?? "auto");
route();
