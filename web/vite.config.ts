import { type Plugin, defineConfig } from "vite";
import { theory } from "./vite.theory";

/** Lists the files that the page needs without a network, for its service worker. */
function offline(): Plugin {
  return {
    name: "offline",
    apply: "build",
    generateBundle: {
      order: "post",
      handler(_, bundle) {
        const files = Object.keys(bundle).map((name) => `./${name}`);
        this.emitFile({ type: "asset", fileName: "files.json", source: JSON.stringify(["./", "./favicon.svg", "./report.html", ...files]) });
      },
    },
  };
}

// Relative paths, so that the page works in any folder of any server.
export default defineConfig({
  base: "./",
  build: { target: "es2022", assetsInlineLimit: 0, modulePreload: { polyfill: false }, rolldownOptions: { input: ["index.html", "theory.html"] } },
  worker: { format: "es" },
  plugins: [theory(), offline()],
});
