// SPDX-License-Identifier: Apache-2.0
// Runs the simulation. Messages in: {settings, x, y} starts a run, {count, x, y} continues it.
// Messages out: {description}, {command}, {rows}.
importScripts("playground.js");

const ready = simulation().then((module) => {
  postMessage({ description: JSON.parse(module.UTF8ToString(module._playground_description())) });
  return module;
});
let run = 0;
onunhandledrejection = ({ reason }) => {
  throw reason; // This calls the error handler of the page.
};

onmessage = async ({ data }) => {
  const module = await ready;
  if (data.settings) {
    module._playground_destroy(run);
    run = module._playground_create(...data.settings, data.x, data.y);
    postMessage({ command: module.UTF8ToString(module._playground_command(...data.settings)) });
  } else {
    const start = module._playground_step(run, data.count, data.x, data.y) / 8;
    const rows = module.HEAPF64.slice(start, start + data.count * data.columns);
    postMessage({ rows, run: data.run }, [rows.buffer]);
  }
};
