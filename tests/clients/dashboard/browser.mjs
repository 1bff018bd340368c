// SPDX-License-Identifier: Apache-2.0
// Starts Chromium and reads what the page shows. TENDON_BROWSER is the path of the browser.
import assert from "node:assert/strict";
import { after, before } from "node:test";
import { packageOf, until } from "./support.mjs";

const { chromium } = packageOf("clients/dashboard/page", "playwright-core");
/** Renders without a GPU; SwiftShader computes WebGL for the 3-D view. */
const kArgs = ["--no-sandbox", "--disable-gpu-compositing", "--use-angle=swiftshader-webgl", "--enable-unsafe-swiftshader"];
let browser;
before(async () => {
  browser = await chromium.launch({ executablePath: process.env.TENDON_BROWSER, args: kArgs });
});
after(() => browser?.close());

/**
 * Opens `at`, which is by default the page's address `url`. `before` prepares the page before it is loaded. The test
 * fails if the page logs an error or sends a request to another host.
 */
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
/** Engages a coupling while the hand is far from the wall at the follower, which the follower will later touch. */
export async function engage(page) {
  const x = page.locator("[data-chart=position] .key .value").first();
  await until("the hand is far back", async () => Number((await x.textContent()).replace("−", "-")) < -12);
  await page.locator("#engage:not(:disabled)").click();
}
export const says = (page, selector, text) => page.locator(selector, { hasText: text }).first().waitFor();
export const painted = (page, selector) =>
  page.locator(selector).first().evaluate((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let i = 3; i < data.length; i += 4) count += data[i] > 0;
    return count;
  });
/** Returns a data URL of the first plot, which changes if a pixel changes. */
export const picture = (page, selector) => page.locator(selector).first().evaluate((canvas) => canvas.toDataURL());
