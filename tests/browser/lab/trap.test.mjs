// A library that ends itself takes nothing with it but its worker.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { browser, open, serve } from "./harness.mjs";

let server, own;
before(async () => ([server, own] = [await serve(), await browser()]));
after(async () => {
  await own.close();
  server.close();
});

/** A section of up to 16 383 bytes, whose length is a number in groups of seven bits. */
const section = (id, ...bytes) => [id, (bytes.length & 127) | 128, bytes.length >> 7, ...bytes];
const name = (text) => [text.length, ...Buffer.from(text)];

/** A module with the exports of the library, whose every answer is a trap. */
function trapping() {
  const functions = ["begin", "input", "answer", "output", "failure", "failure_length"];
  const types = section(1, 3, 0x60, 0, 0, 0x60, 1, 0x7f, 1, 0x7f, 0x60, 0, 1, 0x7f);
  const declared = section(3, 6, 0, 1, 2, 2, 2, 2);
  const memory = section(5, 1, 0, 16);
  const exported = functions.flatMap((own, k) => [...name(`lagrangian_${own}`), 0, k]);
  const exports = section(7, 7, ...name("memory"), 2, 0, ...exported);
  const zero = [4, 0, 0x41, 0, 0x0b];
  const code = section(10, 6, 2, 0, 0x0b, ...zero, 3, 0, 0, 0x0b, ...zero, ...zero, ...zero);
  return Buffer.from([0, 0x61, 0x73, 0x6d, 1, 0, 0, 0, ...types, ...declared, ...memory, ...exports, ...code]);
}

test("a trap is told, and the page goes on", async () => {
  const context = await own.newContext({ serviceWorkers: "block" });
  const page = await context.newPage();
  await page.route("**/*.wasm", (route) => route.fulfill({ contentType: "application/wasm", body: trapping() }));
  await page.goto(`${server.url}#play?system=pendulum`);
  const message = page.locator(".message.bad");
  await message.waitFor();
  assert.match(await message.textContent(), /ended itself .* started again/);
  await page.getByLabel("System").selectOption("kepler");
  await page.getByText("Drag the planet").waitFor();
  await context.close();
});

test("a library that does not come is told too", async () => {
  const context = await own.newContext({ serviceWorkers: "block" });
  const page = await context.newPage();
  await page.route("**/*.wasm", (route) => route.fulfill({ status: 404, body: "" }));
  await page.goto(server.url);
  await page.getByText(/library could not be loaded \(/).first().waitFor();
  await context.close();
});

test("requests wait for a library that is slow to begin", async () => {
  const context = await own.newContext({ serviceWorkers: "block" });
  const page = await context.newPage();
  const slow = "{ const own = WebAssembly.instantiate; WebAssembly.instantiate = async (...all) => { await new Promise((done) => setTimeout(done, 400)); return own(...all); }; }";
  await page.route("**/worker-*.js", async (route) => {
    const response = await route.fetch();
    await route.fulfill({ response, body: slow + (await response.text()) });
  });
  await page.goto(`${server.url}#play?system=pendulum`);
  await page.locator(".figures dd, .message.bad").first().waitFor();
  assert.equal(await page.locator(".message.bad").count(), 0);
  await context.close();
});
