// What holds for the whole page: access for all, its size, no network, nothing beside it.

import assert from "node:assert/strict";
import { readFile, readdir } from "node:fs/promises";
import path from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { brotliCompressSync, constants } from "node:zlib";
import { frame, violations } from "../browser.js";
import { browser, open, serve } from "./harness.mjs";

const VIEWS = ["#play?system=double-pendulum", "#learn", "#data", "#lesson?step=1", "#lesson?step=3", "#lesson?step=5", "theory.html"];

let server, own;
before(async () => ([server, own] = [await serve(), await browser()]));
after(async () => {
  await own.close();
  server.close();
});

for (const view of VIEWS) {
  test(`${view} has no barrier that axe finds and fits its screen, at both widths in both themes`, async () => {
    // The policy of the page would refuse a script that it does not hold.
    const { page, wrong, close } = await open(own, `${server.url}${view}`, { bypassCSP: true });
    await page.getByText("The library is ready.").or(page.locator(".theory")).first().waitFor();
    if (view === "#data") {
      await page.getByRole("button", { name: /example/ }).click();
      await page.getByRole("button", { name: "Check the data" }).click();
      await page.getByText("The data are").waitFor();
    }
    for (const width of [1280, 390]) {
      for (const colorScheme of ["light", "dark"]) {
        await page.setViewportSize({ width, height: 800 });
        await page.emulateMedia({ colorScheme });
        await frame(page);
        assert.deepEqual(await violations(page), [], `${width} px, ${colorScheme}`);
      }
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(wide <= width, `${wide} px on a screen of ${width}`);
    }
    assert.deepEqual(wrong, []);
    await close();
  });
}

test("opened from a disk, the page says which server it needs", async () => {
  const page = await own.newPage();
  await page.goto(pathToFileURL(new URL("../../../web/dist/index.html", import.meta.url).pathname).href);
  await page.getByText("python3 -m http.server --directory web/dist").waitFor();
  await page.goto(server.url);
  await page.locator(".figures dd").first().waitFor();
  assert.equal(await page.getByText("http.server").count(), 0);
  await page.close();
});

test("the first load is at most 1.4 MB", async () => {
  const folder = new URL("../../../web/dist/", import.meta.url);
  const names = await readdir(folder, { recursive: true, withFileTypes: true });
  // A browser loads one build of the library, of which that with relaxed SIMD is the one that most load.
  const loaded = names.filter((entry) => entry.isFile() && !/^plain-.*wasm$/.test(entry.name));
  const files = loaded.map((entry) => `${entry.parentPath ?? entry.path}/${entry.name}`);
  // As a server that keeps compressed files sends them, and as docs/performance.md quotes it.
  const settings = { params: { [constants.BROTLI_PARAM_QUALITY]: 11 } };
  const sizes = await Promise.all(files.map(async (file) => brotliCompressSync(await readFile(file), settings).length));
  const sum = sizes.reduce((a, b) => a + b, 0);
  console.log(`first load: ${sum} bytes with brotli`);
  assert.ok(sum <= 1.4e6, `${sum} bytes`);
});

test("a browser without relaxed SIMD runs the other build, and keeps that one alone", async () => {
  const context = await own.newContext();
  const page = await context.newPage();
  await page.addInitScript(() => (WebAssembly.validate = () => false));
  await page.goto(`${server.url}#play?system=pendulum`);
  await page.locator(".figures dd").first().waitFor();
  // The worker may still clear and fill its cache: what it ends with counts.
  await page.waitForFunction(async () => {
    const kept = (await (await caches.open("lagrangian-laboratory")).keys()).map((key) => key.url).filter((url) => url.endsWith(".wasm"));
    return kept.length === 1 && kept[0].split("/").pop().startsWith("plain-");
  });
  const loaded = await page.evaluate(() => performance.getEntriesByType("resource").map((entry) => entry.name).filter((url) => url.endsWith(".wasm")));
  assert.deepEqual(loaded.map((url) => path.basename(url).split("-")[0]), ["plain"]);
  await context.close();
});

test("once loaded, the laboratory works without a network", async () => {
  const { page, close } = await open(own, `${server.url}#play?system=pendulum`);
  await page.locator(".figures dd").first().waitFor();
  await page.evaluate(() => navigator.serviceWorker.ready);
  await page.waitForFunction(async () => (await (await caches.open("lagrangian-laboratory")).keys()).some((key) => key.url.endsWith(".wasm")));
  await page.context().setOffline(true);
  await page.reload();
  await page.locator(".figures dd").first().waitFor();
  assert.match(await page.locator("#engine").textContent(), /ready/);
  await close();
});
