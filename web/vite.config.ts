import { defineConfig } from "vite";

// Relative paths, so that the page works in any folder of any server.
export default defineConfig({
  base: "./",
  build: { target: "es2022", assetsInlineLimit: 0, modulePreload: { polyfill: false } },
  worker: { format: "es" },
});
