// SPDX-License-Identifier: Apache-2.0
// Tests the 3-D view: first the shapes that it computes for a state, and then the page in a browser.
import assert from "node:assert/strict";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { it } from "node:test";
import { says, visit } from "./browser.mjs";
import { fakeFeed, kDevices, kTouching, kTurnedFrame } from "./fake_feed.mjs";
import { kRoot, packageOf, Program, scratch, startDash, startServer, until } from "./support.mjs";

/** Imports modules of the page that do not need a browser, transpiled to JavaScript. */
async function modules(test, ...names) {
  const ts = packageOf("clients/dashboard/page", "typescript");
  const folder = scratch(test);
  mkdirSync(join(folder, "space"));
  writeFileSync(join(folder, "package.json"), '{"type":"module"}');
  const compilerOptions = { target: ts.ScriptTarget.ES2022, module: ts.ModuleKind.ESNext, verbatimModuleSyntax: true };
  for (const name of names) {
    const text = readFileSync(join(kRoot, "clients/dashboard/page/src", `${name}.ts`), "utf8");
    writeFileSync(join(folder, `${name}.js`), ts.transpileModule(text, { compilerOptions }).outputText);
  }
  return Object.assign({}, ...(await Promise.all(names.map((name) => import(join(folder, `${name}.js`))))));
}

const near = (actual, wanted, what) => {
  assert.equal(actual.length, wanted.length, what);
  actual.forEach((v, i) => assert.ok(Math.abs(v - wanted[i]) < 1e-6, `${what}: ${actual} is not ${wanted}`));
};
const kHandle = { operator_from_device: null, buttons: [], orientation_measured: true, max_torque_nm: 0.2, gripper_open_rad: null, max_gripper_force_n: 0, group: "", hand: "any" };
const kSample = { t: 0, x: 0.1, y: 0.2, z: 0.3, wx: NaN, wy: NaN, wz: NaN, ax: 1, ay: 2, az: 3, permitted: 1, energy: 0, reasons: 0, mode: 2, age: 0, late: 0 };

it("turns everything of a device into the frame of who looks at it", async (test) => {
  const { figureOf, product, rotated } = await modules(test, "space/figure");
  // x points to the user, y to the right, and z up
  const handle = { ...kHandle, operator_from_device: kTurnedFrame };
  const half = Math.SQRT1_2;
  const pose = { position: [1, 2, 3], orientation: [half, 0, 0, half], force: [1, 0, 0], wanted: [0, 1, 0], torque: [0, 0, 1], hand: [0, 0, -1], buttons: 0, contact: { normal: [0, 0, 1], gap: -0.5 } };
  const figure = figureOf(pose, handle);
  near(figure.position, [2, 3, 1], "position");
  near(figure.force, [0, 0, 1], "force");
  near(figure.wanted, [1, 0, 0], "wanted");
  near(figure.torque, [0, 1, 0], "torque");
  near(figure.hand, [0, -1, 0], "hand");
  near(figure.plane.normal, [0, 1, 0], "normal");
  near(figure.plane.at, [2, 3.5, 1], "the surface is half a metre above a tool pressed in as deep");
  // The handle is rotated by 90° about the z axis of the base, which points up. The −z axis of the handle then points
  // down, and its x axis points along the y axis of the base.
  const [x, y, z, w] = figure.quaternion;
  near(rotated([w, x, y, z], [0, 0, -1]), [0, -1, 0], "where it points");
  near(rotated([w, x, y, z], [1, 0, 0]), [1, 0, 0], "its x");
  near(product([half, half, 0, 0], [half, 0, half, 0]), [0.5, 0.5, 0.5, 0.5], "i j is k");
  assert.deepEqual(figureOf(pose, null).position, [1, 2, 3], "without a frame as if it were the operator's");
});

it("draws what a state holds and nothing else", async (test) => {
  const { figureOf, poseAt, wordsOf, Track, noHandle } = await modules(test, "track", "space/figure");
  const track = new Track();
  track.push({ ...kSample });
  const plain = figureOf(poseAt(track, 0), null);
  assert.deepEqual([plain.kind, plain.torque, plain.opening, plain.wanted, plain.plane, plain.buttons], ["point", undefined, undefined, undefined, undefined, []]);
  assert.equal(wordsOf(plain), "a point, a force");
  track.push({ ...kSample, t: 0.001, handle: { ...noHandle(), qw: 1, qx: 0, qy: 0, qz: 0, tx: 0.1, ty: 0, tz: 0, grip: 0.25, buttons: 5, nx: 0, ny: 1, nz: 0, gap: -0.001 } });
  const full = figureOf(poseAt(track, 1), { ...kHandle, buttons: ["front", "rear"] });
  assert.equal(full.kind, "stylus");
  assert.equal(full.opening, 0.25);
  assert.deepEqual(full.buttons, [{ name: "front", held: true }, { name: "rear", held: false }, { name: "button 2", held: true }]);
  assert.equal(wordsOf(full), "a stylus, a force, a torque, two fingers, a surface, front held, button 2 held");
  // There is no state of the handle in these steps, and there are so many steps that the columns must grow.
  for (let i = 2; i < 5000; ++i) track.push({ ...kSample, t: i / 1000 });
  assert.equal(poseAt(track, 0).orientation, undefined);
  assert.deepEqual(poseAt(track, 1).orientation, [1, 0, 0, 0]);
  assert.equal(poseAt(track, 4999).orientation, undefined);
  assert.equal(poseAt(track, 5000), undefined, "there is no such step");
  track.clear();
  assert.equal(track.column("qw").length, 0);
});

it("finds the surface that an engine's stiffness and force speak of", async (test) => {
  const { contactOf } = await modules(test, "space/figure");
  const wall = [800, 0, 0, 0, 0, 0, 0, 0, 0];
  const pressed = contactOf(wall, [-4, 0, 0]);
  near(pressed.normal, [-1, 0, 0], "out of the wall");
  near([pressed.gap], [-0.005], "4 N of 800 N/m");
  const [a, b] = [0.6, 0.8];
  const slope = contactOf([a * a, a * b, 0, a * b, b * b, 0, 0, 0, 0].map((v) => 500 * v), [3, 4, 0]);
  near(slope.normal, [0.6, 0.8, 0], "a slope's");
  near([slope.gap], [-0.01], "a slope's");
  assert.equal(contactOf([800, 0, 0, 0, 800, 0, 0, 0, 800], [-4, 0, 0]), undefined, "a magnet is no surface");
  assert.equal(contactOf([800, 0, 0, 0, 200, 0, 0, 0, 0], [-4, 0, 0]), undefined, "nor is a groove");
  assert.equal(contactOf(wall, [0, 0, 0]), undefined, "nothing presses: nobody says on which side it is");
  assert.equal(contactOf(wall.map(() => 0), [-4, 0, 0]), undefined);
  assert.equal(contactOf([], [-4, 0, 0]), undefined);
});

it("reads how a device lies from the scene of a recording", async (test) => {
  const { frameOfScene, rotated } = await modules(test, "space/figure");
  const axes = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
  for (const [right, up, user] of [["x", "y", "z"], ["y", "z", "x"], ["-y", "z", "-x"], ["x", "-z", "y"], ["-x", "-y", "z"], ["-x", "y", "-z"], ["x", "-y", "-z"]]) {
    const frame = frameOfScene(`[device]\nkind = "simulated"\naxes = "up=${up} right=${right} user=${user}"\n`);
    const of = (word) => axes[word.at(-1)].map((v) => (word.startsWith("-") ? -v : v));
    near(rotated(frame, of(right)), [1, 0, 0], `right=${right}`);
    near(rotated(frame, of(up)), [0, 1, 0], `up=${up}`);
    near(rotated(frame, of(user)), [0, 0, 1], `user=${user}`);
  }
  for (const none of ["", 'axes = "right=x up=y"', 'axes = "right=x up=y user=-z"', 'axes = "right=x up=x user=z"', '# axes = "right=x up=y user=z"']) {
    assert.equal(frameOfScene(none), undefined, none);
  }
});

it("fills the picture with a grid, and keeps the view within bounds", async (test) => {
  const { gridOf, kFirstView, turnedBy, zoomedBy } = await modules(test, "space/orbit");
  assert.deepEqual(gridOf(4, 1.2, 3), { columns: 4, rows: 1 });
  assert.deepEqual(gridOf(4, 1.2, 0.9), { columns: 2, rows: 2 });
  assert.deepEqual(gridOf(3, 1.2, 0.3), { columns: 1, rows: 3 });
  assert.deepEqual(gridOf(1, 1.2, 9), { columns: 1, rows: 1 });
  assert.ok(turnedBy(kFirstView, 0, 9).rise < Math.PI / 2, "never over the top");
  assert.ok(zoomedBy(kFirstView, 1e9).zoom < 100);
  assert.ok(zoomedBy(kFirstView, 0).zoom > 0);
});

const kCanvas = ".spatial canvas";
const words = (page) => page.locator(kCanvas).getAttribute("aria-label");
/** Counts the pixels of the 3-D view whose color is close to that of each CSS variable. */
async function coloured(page, ...names) {
  const png = (await page.locator(kCanvas).screenshot()).toString("base64");
  return page.evaluate(async ([data, variables]) => {
    const image = new Image();
    image.src = `data:image/png;base64,${data}`;
    await image.decode();
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [image.width, image.height];
    const paint = canvas.getContext("2d", { willReadFrequently: true });
    paint.drawImage(image, 0, 0);
    const seen = paint.getImageData(0, 0, canvas.width, canvas.height).data;
    return variables.map((variable) => {
      paint.fillStyle = getComputedStyle(document.documentElement).getPropertyValue(variable);
      paint.fillRect(0, 0, 1, 1);
      const wanted = paint.getImageData(0, 0, 1, 1).data;
      const long = Math.hypot(wanted[0], wanted[1], wanted[2]);
      let count = 0;
      for (let i = 0; i < seen.length; i += 4) {
        const size = Math.hypot(seen[i], seen[i + 1], seen[i + 2]) || 1;
        const off = [0, 1, 2].map((k) => seen[i + k] / size - wanted[k] / long);
        if (Math.hypot(...off) < 0.12) ++count;
      }
      return count;
    });
  }, [png, names.map((name) => `--${name}`)]);
}

it("shows four devices in 3-D, and goes back to the plots", async (test) => {
  const { url } = await startDash(test, "127.0.0.1:9");
  let heard;
  const page = await visit(test, url, { viewport: { width: 800, height: 600 }, before: async (made) => (heard = await fakeFeed(made, { until: 4200 })) });
  const scripts = [];
  page.on("request", (request) => scripts.push(request.url()));
  assert.ok((await page.locator("[data-chart=position]").isVisible()) && !(await page.locator(kCanvas).isVisible()));
  assert.equal(scripts.filter((address) => address.includes("stage")).length, 0, "three.js is loaded when it is asked for");
  await page.click("#space");
  await until("all four are drawn", async () => /^3-D view\. stylus: a stylus, a force, a wanted force, a torque, (front|rear) held; gripper: a stylus, .*two fingers.*; falcon: a point, .*a surface, right held; old: a point$/.test(await words(page)), () => words(page));
  assert.equal(scripts.filter((address) => address.includes("stage")).length, 1);
  assert.deepEqual(heard.slice(-1), ["watch 0 beside"]);
  await until("its numbers are told", async () => /^\d\.\d\d N · \d+ mN·m$/.test(await page.locator(".handle .values").first().textContent()));
  await says(page, ".handle .button[data-held=true]", "right");
  assert.match(await page.locator(".handle", { hasText: "falcon" }).locator(".values").textContent(), / 2(\.0+)? mm in the surface/);
  assert.ok(await page.locator(".handle", { hasText: "old" }).locator(".note").isVisible(), "whose frame nobody tells");
  const pixels = await coloured(page, "applied", "wanted", "torque");
  assert.ok(pixels.every((n) => n > 15), `of the applied force, the wanted one and the torque: ${pixels}`);
  assert.equal(await page.locator("[data-chart=position]").isVisible(), false);

  await page.keyboard.press("3");
  await page.locator("[data-chart=position]").waitFor();
  assert.equal(await page.locator(kCanvas).isVisible(), false);
  assert.deepEqual(heard.slice(-1), ["watch 0"]);
  await page.keyboard.press("3");
  await page.locator(kCanvas).waitFor();
  await page.reload();
  await page.locator(kCanvas).waitFor();
  assert.equal(await page.locator("#space").getAttribute("aria-pressed"), "true", "the choice is kept");
});

it("collects the surface where the tool touched it", async (test) => {
  const { TouchedSurface, Track, noHandle, kMostPatches, kPatchCell } = await modules(test, "words", "track", "space/figure", "space/surface");
  const step = (t, field, depth, [px, py, pz], [x, y, z]) => ({ ...kSample, t, x, y, z, handle: { ...noHandle(), field, depth, px, py, pz } });
  const surface = new TouchedSurface();
  const track = new Track();
  track.push(step(0, 1, 1e-3, [0.01, 0, 0], [0.009, 0, 0]));
  track.push(step(1, 1, 1e-3, [0.01 + 0.2 * kPatchCell, 0, 0], [0.009, 0, 0]));
  track.push(step(2, 1, 1e-4, [0.05, 0, 0], [0.0499, 0, 0]));
  track.push(step(3, 1, 0, [0.07, 0, 0], [0.07, 0, 0]));
  track.push(step(4, 2, 2e-3, [0, 0.02, 0], [0, 0.022, 0]));
  surface.follow(track);
  const [first, ...more] = surface.patches(1, [1, 0, 0, 0]);
  assert.deepEqual(more, [], "one patch per cell, none without depth");
  near(first.at, [0.01, 0, 0], "place");
  near(first.normal, [1, 0, 0], "normal");
  // x points to the user, y to the right, and z up
  near(surface.patches(2, kTurnedFrame)[0].normal, [-1, 0, 0], "normal in the frame of the viewer");
  const { version } = surface;
  surface.follow(track);
  assert.equal(surface.version, version, "no step is new");
  for (let i = 0; i <= kMostPatches; ++i) track.push(step(5 + i, 2, 1e-3, [i * kPatchCell, 0.1, 0], [i * kPatchCell, 0.099, 0]));
  surface.follow(track);
  assert.deepEqual([1, 2].map((generation) => surface.patches(generation, [1, 0, 0, 0]).length), [0, kMostPatches], "the oldest ones are removed");
  surface.follow(new Track());
  assert.equal(surface.patches(2, [1, 0, 0, 0]).length, 0, "another device");
});

it("shows the field that a device renders: proxy, depth, generation", async (test) => {
  const { url } = await startDash(test, "127.0.0.1:9");
  const page = await visit(test, url, { before: (made) => fakeFeed(made, { devices: [...kDevices, kTouching], begin: 5000, until: 5600 }) });
  const cells = page.locator(".field-panel td");
  const depth = "[data-chart=depth]";
  await says(page, ".tile[data-tile=mode]", "Active");
  assert.ok(!(await cells.first().isVisible()) && !(await page.locator(depth).isVisible()), "a device without a field");
  await page.selectOption("#device", "4");
  await until("the deepest place is told", async () => (await cells.allTextContents()).join("; ") === "4; 3.96 mm; −14.6, 6.2, 0.0 mm", () => cells.allTextContents());
  assert.equal(await page.locator(".field-panel svg").getAttribute("aria-label"), "the hand is 3.96 mm below the proxy");
  const [proxy, hand] = await Promise.all(["proxy", "hand"].map((name) => page.locator(`.field-panel circle.${name}`).boundingBox()));
  assert.ok(hand.y > proxy.y + proxy.height && Math.abs(hand.x + hand.width / 2 - proxy.x - proxy.width / 2) < 1, "the hand is below the proxy");
  assert.equal(await page.locator(`${depth} .value`).textContent(), "3.96");
  await page.click("#pause");
  await page.locator(`${depth} .u-over`).hover({ position: { x: 200, y: 50 } });
  await until("another instant has its generation and no contact", async () => (await cells.allTextContents()).slice(0, 2).join("; ") === "3; no contact", () => cells.allTextContents());
  await page.click("#space");
  await until("the proxy and the surface of its generation are drawn", async () => /touching: a point, .*a proxy, the touched surface$/.test(await words(page)), () => words(page));
  assert.ok((await coloured(page, "second"))[0] > 15);
  assert.match(await page.locator(".handle", { hasText: "touching" }).locator(".values").textContent(), /at the proxy|mm below the proxy/);
  assert.equal(await page.locator(depth).isVisible(), false, "beside the 3-D view only the force is plotted");
});

it("is turned by a mouse and keys, and on a phone leaves scrolling alone", async (test) => {
  const { url } = await startDash(test, "127.0.0.1:9");
  const page = await visit(test, url, {
    viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true,
    before: async (made) => {
      await made.addInitScript(() => localStorage.setItem("view", "3d"));
      await fakeFeed(made, { devices: kDevices.slice(0, 1), begin: 2000, until: 2001 });
    },
  });
  await until("it is drawn", async () => /torque/.test((await words(page)) ?? ""));
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), true, "a phone scrolls down, not sideways");
  assert.equal(await page.locator(kCanvas).evaluate((canvas) => getComputedStyle(canvas).touchAction), "pan-y");
  const shot = async () => (await page.locator(kCanvas).screenshot()).toString("base64");
  await page.locator(kCanvas).focus();
  await page.keyboard.press("Home");
  const first = await shot();
  await page.keyboard.press("ArrowLeft");
  await until("a key turns it", async () => (await shot()) !== first);
  await page.keyboard.press("Home");
  await until("and back", async () => (await shot()) === first);
  const box = await page.locator(kCanvas).boundingBox();
  await page.mouse.move(box.x + 100, box.y + 100);
  await page.mouse.down();
  await page.mouse.move(box.x + 180, box.y + 130, { steps: 3 });
  await page.mouse.up();
  await until("the mouse turns it", async () => (await shot()) !== first);
  await page.dblclick(kCanvas);
  await until("a double click sets it back", async () => (await shot()) === first);
});

it("shows a recording in 3-D: the surface, and another instant", async (test) => {
  const folder = scratch(test);
  const server = await startServer(test, folder, ["demo"], "--record", "run.mcap", "--duration-s", "2");
  const wall = new Program(test, "virtual_wall", ["--server", server.address, "--rate-hz", "200", "--local-model"]);
  await server.program.ended;
  await wall.stop();
  const { url } = await startDash(test, "127.0.0.1:9", "--recordings", folder);
  const page = await visit(test, url, { at: `${url}/#/recordings/run.mcap`, before: (made) => made.addInitScript(() => localStorage.setItem("view", "3d")) });
  await page.locator(".seek input").waitFor();
  await until("it is drawn", async () => /a point/.test((await words(page)) ?? ""));
  await until("somewhere the hand is in the wall", async () => {
    for (let share = 0; share <= 1000; share += 50) {
      await page.locator(".seek input").fill(String(share));
      await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
      if (/a surface/.test(await words(page))) return true;
    }
    return false;
  });
  await says(page, ".handle .values", "mm in the surface");
  assert.ok((await coloured(page, "energy"))[0] > 60);
  await page.locator(".seek input").fill("0");
  const before = await page.locator(".seek .when").textContent();
  await page.click(".seek .play");
  await until("time passes", async () => (await page.locator(".seek .when").textContent()) !== before);
});

it("stays 2-D without WebGL, and says so", async (test) => {
  const { url } = await startDash(test, "127.0.0.1:9");
  const page = await visit(test, url, {
    before: async (made) => {
      await made.addInitScript(() => {
        const real = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
          return kind === "webgl2" ? null : real.call(this, kind, ...more);
        };
      });
      await fakeFeed(made, { devices: kDevices.slice(0, 1) });
    },
  });
  await page.click("#space");
  await says(page, ".spatial [role=status]", "This browser has no WebGL, so the view stays 2-D.");
  await page.locator("[data-chart=position]").waitFor();
  assert.equal(await page.locator(kCanvas).isVisible(), false);
});
