// SPDX-License-Identifier: Apache-2.0
// Compares the module of the page with the program of this machine, and measures its speed and size.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readdirSync, readFileSync, statSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { test } from "node:test";

const kFolder = process.env.TENDON_PLAYGROUND;
const kSituations = 100;
const kSeed = 20261130;

const module = await createRequire(import.meta.url)(join(kFolder, "playground.js"))({ wasmBinary: readFileSync(join(kFolder, "playground.wasm")) });
const text = (pointer) => Buffer.from(module.UTF8ToString(pointer));
const about = JSON.parse(text(module._playground_description()));

/** Returns random numbers from 0 to 1 (Marsaglia's xorshift32). */
function drawing(state) {
  return () => {
    state ^= state << 13;
    state ^= state >>> 17;
    state ^= state << 5;
    return (state >>> 0) / 2 ** 32;
  };
}

/** Draws random settings, a law, and a random motion of about 2 s. */
function situation(draw) {
  const settings = about.sliders.map(({ least, most, step }) => least + step * Math.floor(draw() * ((most - least) / step + 1)));
  const place = () => (2 * draw() - 1) * about.reach_m;
  const frames = Array.from({ length: 60 }, () => [10 + Math.floor(draw() * 50), place(), place()]);
  return { settings: [...settings, Math.floor(draw() * about.laws.length)], start: [place(), place()], frames };
}

function* pieces({ settings, start, frames }) {
  yield text(module._playground_command(...settings));
  const run = module._playground_create(...settings, ...start);
  for (const [count, x, y] of frames) {
    const rows = module._playground_step(run, count, x, y);
    yield Buffer.from(module.HEAPU8.slice(rows, rows + 8 * count * about.columns.length));
  }
  module._playground_destroy(run);
}

test(`${kSituations} drawn situations have the same bytes as on this machine`, (t) => {
  const draw = drawing(kSeed);
  const drawn = Array.from({ length: kSituations }, () => situation(draw));
  const input = drawn.map(({ settings, start, frames }) => [settings, start, frames.length, frames].flat(2).join(" ")).join("\n");
  const native = spawnSync(process.env.TENDON_ROWS, { input, maxBuffer: 2 ** 30 });
  assert.equal(native.status, 0, String(native.stderr));
  let offset = 0;
  const compare = (piece, what) => {
    assert.ok(piece.equals(native.stdout.subarray(offset, offset + piece.length)), `seed ${kSeed}, ${what}, byte ${offset}`);
    offset += piece.length;
  };
  compare(text(module._playground_description()), "description");
  for (const [i, one] of drawn.entries()) for (const piece of pieces(one)) compare(piece, `situation ${i}: ${one.settings}`);
  assert.equal(offset, native.stdout.length);
  t.diagnostic(`${offset} bytes`);
});

/** This uses the processor time, because other programs may be running. */
test("the simulation is at least 100 times as fast as real time", (t) => {
  const run = module._playground_create(20, 5, 2, 2000, 7, 0, 0, 0);
  const speeds = [1, 2, 3].map(() => {
    const before = process.cpuUsage().user;
    for (let i = 0; i < 200; ++i) module._playground_step(run, 50, i % 2 ? 0.015 : -0.015, 0);
    return 1e7 / (process.cpuUsage().user - before);
  });
  t.diagnostic(`${speeds.map(Math.round)} times real time`);
  assert.ok(Math.max(...speeds) >= 100, speeds.join());
});

test("the folder has at most 1 MB", (t) => {
  const sizes = readdirSync(kFolder).map((name) => statSync(join(kFolder, name)).size);
  const bytes = sizes.reduce((a, b) => a + b);
  t.diagnostic(`${bytes} bytes`);
  assert.ok(bytes <= 1_000_000);
});
