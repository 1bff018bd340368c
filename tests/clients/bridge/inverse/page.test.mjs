// SPDX-License-Identifier: Apache-2.0
// A web page reads the hand and sends forces through the browser's WebSocket. A page from another host is refused.
import assert from "node:assert/strict";
import { createServer } from "node:http";
import { test } from "node:test";
import { visit } from "../../dashboard/browser.mjs";
import { Program, scratch, startServer } from "../../dashboard/support.mjs";

const kPage = (url) => `<!doctype html><title>hand</title><p id=said>nothing</p><script>
  const said = document.getElementById("said");
  const socket = new WebSocket(${JSON.stringify(url)});
  socket.onclose = () => (said.textContent = "closed");
  socket.onmessage = ({ data }) => {
    const [arm] = JSON.parse(data).inverse3;
    if (arm.state.current_cursor_force.z > 0.2) said.textContent = "pushed up";
    const commands = { set_cursor_force: { vector: { x: 0, y: 0, z: 0.5 } } };
    socket.send(JSON.stringify({ inverse3: [{ device_id: arm.device_id, commands }] }));
  };
</script>`;

test("a page of this machine pushes the hand, one from elsewhere may not", async (t) => {
  const server = await startServer(t, scratch(t), ["demo"], "--record", "/dev/null");
  const listen = ["--listen", "127.0.0.1:0", "--duration-s", "120", "--json"];
  const bridge = new Program(t, "tendon-bridge", ["inverse", "--server", server.address, ...listen]);
  const { address } = JSON.parse(await bridge.line('"listening"'));
  await bridge.line("connected to");
  const body = kPage(`ws://${address}`);
  const pages = createServer((request, response) => response.setHeader("Content-Type", "text/html").end(body));
  await new Promise((resolve) => pages.listen(0, "127.0.0.1", resolve));
  t.after(() => pages.close());
  const port = pages.address().port;

  const near = await visit(t, `http://127.0.0.1:${port}/`);
  await near.locator("#said", { hasText: "pushed up" }).waitFor();
  assert.ok(bridge.lines.some((line) => line.includes("client 1 controls the force")));

  // This is the same page under the name of a different host.
  const url = "http://evil.example/";
  const before = (page) => page.route(url, (route) => route.fulfill({ contentType: "text/html", body }));
  const far = await visit(t, url, { before });
  await far.locator("#said", { hasText: "closed" }).waitFor();
  assert.ok(!bridge.lines.some((line) => line.includes("client 2 came")));
});
