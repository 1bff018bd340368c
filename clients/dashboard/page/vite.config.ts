// SPDX-License-Identifier: Apache-2.0
import { defineConfig } from "vite";

// three.js alone, which only the 3-D view loads, is 565 kB.
// What leaves here is put into a program and served under a strict Content-Security-Policy: no inline script, no data: file.
export default defineConfig({
  build: { target: "es2022", assetsInlineLimit: 0, modulePreload: { polyfill: false }, outDir: "dist", chunkSizeWarningLimit: 700 },
});
