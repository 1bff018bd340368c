// SPDX-License-Identifier: Apache-2.0
//
// Chromium, and what a person sees in it. TENDON_BROWSER names the program.
import assert from "node:assert/strict";
import { after, before } from "node:test";
import { packageOf, until } from "./support.mjs";

const { chromium } = packageOf("clients/dashboard/page", "playwright-core");
/** No GPU: WebGL is computed too, for the 3-D view. */
const kArgs = ["--no-sandbox", "--disable-gpu-compositing", "--use-angle=swiftshader-webgl", "--enable-unsafe-swiftshader"];
let browser;
before(async () => {
  browser = await chromium.launch({ executablePath: process.env.TENDON_BROWSER, args: kArgs });
});
after(() => browser?.close());

/** `at`: where in it; `before`: what is done to the page before it is opened. A page that has looked nowhere but at tendon-dash, and against whose policy nothing was done. */
export async function visit(test, url, { at = url, before = () => {}, ...options } = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(60_000);
  const wrong = [];
  page.on("pageerror", (error) => wrong.push(String(error)));
  page.on("console", (message) => message.type() === "error" && !/WebSocket|status of 40[34]/.test(message.text()) && wrong.push(message.text()));
  page.on("request", (request) => !request.url().startsWith(url) && !request.url().startsWith("data:") && wrong.push(request.url()));
  test.after(async () => {
    await context.close();
    assert.deepEqual(wrong, []);
  });
  await before(page);
  await page.goto(at);
  return page;
}

export const shown = (page) => page.locator("main.live").getAttribute("data-states").then(Number);
/** Engages a coupling while the hand is far from the wall behind the follower: then the follower will run into it. */
export async function engage(page) {
  const x = page.locator("[data-chart=position] .key .value").first();
  await until("the hand is far back", async () => Number((await x.textContent()).replace("−", "-")) < -12);
  await page.locator("#engage:not(:disabled)").click();
}
export const says = (page, selector, text) => page.locator(selector, { hasText: text }).first().waitFor();
/** Pixels of a plot that are not empty. */
export const painted = (page, selector) =>
  page.locator(selector).first().evaluate((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let i = 3; i < data.length; i += 4) count += data[i] > 0;
    return count;
  });
/** What the plots look like: a text that is another one when a pixel is. */
export const picture = (page, selector) => page.locator(selector).first().evaluate((canvas) => canvas.toDataURL());
