// A server for the built page, and a browser that notes what must not happen.

import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

export { launched as browser } from "../browser.js";

const ROOT = fileURLToPath(new URL("../../../web/dist/", import.meta.url));
const TYPES = {
  ".html": "text/html; charset=utf-8",
  ".js": "text/javascript",
  ".css": "text/css",
  ".svg": "image/svg+xml",
  ".wasm": "application/wasm",
  ".webmanifest": "application/manifest+json",
};

/** Serves the page, or another folder, on a free port of this machine, compressed as web servers do. */
export async function serve(root = ROOT) {
  const packed = new Map();
  const server = createServer(async (request, response) => {
    const name = new URL(request.url, "http://localhost").pathname;
    const file = path.join(root, path.normalize(name === "/" ? "/index.html" : name));
    try {
      if (!packed.has(file)) packed.set(file, gzipSync(await readFile(file)));
      response.writeHead(200, { "content-type": TYPES[path.extname(file)] ?? "application/octet-stream", "content-encoding": "gzip" });
      response.end(packed.get(file));
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((ready) => server.listen(0, "127.0.0.1", ready));
  return { url: `http://127.0.0.1:${server.address().port}/`, close: () => server.close() };
}

/** A page that keeps errors of the console and requests to other origins. */
export async function open(own, url, options = {}) {
  const context = await own.newContext({ viewport: { width: 1280, height: 900 }, reducedMotion: "reduce", ...options });
  const page = await context.newPage();
  const wrong = [];
  page.on("console", (message) => message.type() === "error" && wrong.push(message.text()));
  page.on("pageerror", (error) => wrong.push(String(error)));
  page.on("request", (request) => {
    const to = new URL(request.url());
    if (!["blob:", "data:"].includes(to.protocol) && to.origin !== new URL(url).origin) wrong.push(`a request to ${to.origin}`);
  });
  await page.goto(url);
  return { page, wrong, close: () => context.close() };
}
