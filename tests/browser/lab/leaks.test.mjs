// Views come and go: what one of them began ends with it.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { browser, open, serve } from "./harness.mjs";

let server, own;
before(async () => ([server, own] = [await serve(), await browser()]));
after(async () => {
  await own.close();
  server.close();
});

/** Each view, and what it shows once its library has answered. */
const VIEWS = [
  ["#learn", '[aria-label^="Energy along"][aria-label*="truth"]'],
  ["#data", "[aria-label=Results]"],
  ["#lesson?step=1", ".big:not(:empty)"],
  ["#lesson?step=4", '[aria-label^="Energy along"][aria-label*="truth"]'],
  ["#play?system=pendulum", ".figures dd:not(:empty)"],
];
const CHANGES = 200;

/** Goes through the views so many times; each is left once it shows something. */
async function change(page, times) {
  for (let k = 0; k < times; k++) {
    const [address, shown] = VIEWS[k % VIEWS.length];
    await page.evaluate((own) => (location.hash = own), address);
    await page.locator(shown).first().waitFor();
  }
}

/** What the page holds once all that is not used is given back. */
async function held(page, session) {
  await page.waitForFunction(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true)))));
  await session.send("HeapProfiler.collectGarbage");
  const { metrics } = await session.send("Performance.getMetrics");
  const of = (name) => metrics.find((metric) => metric.name === name).value;
  return { heap: of("JSHeapUsedSize"), nodes: of("Nodes"), listeners: of("JSEventListeners"), workers: page.workers().length };
}

test("two hundred changes of view leave nothing behind", { timeout: 300_000 }, async () => {
  const { page, wrong, close } = await open(own, `${server.url}#play?system=pendulum`, { serviceWorkers: "block" });
  const session = await page.context().newCDPSession(page);
  await session.send("Performance.enable");
  // At first the browser compiles what it runs often.
  await change(page, 10 * VIEWS.length);
  const start = await held(page, session);
  await change(page, CHANGES);
  const end = await held(page, session);
  for (const what of Object.keys(start)) {
    assert.ok(end[what] <= 1.1 * start[what], `${what}: ${start[what]} at the start, ${end[what]} after ${CHANGES} changes of view`);
  }
  assert.deepEqual(wrong, []);
  await close();
});

test("a fit that is left ends, and nothing that was asked before begins a worker", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#data`, { serviceWorkers: "block" });
  await page.getByRole("button", { name: /example/ }).click();
  await page.getByRole("button", { name: "Check the data" }).click();
  await page.getByRole("button", { name: "Fit", exact: true }).click();
  await page.getByText("Stop and keep the best").waitFor();
  // What is asked now waits for the fit.
  await page.getByRole("button", { name: /example/ }).click();
  await page.evaluate(() => (location.hash = "#lesson?step=5"));
  await page.getByText("5. When it fails").first().waitFor();
  // The worker of the fit may take a while to end; half a second after that none has begun.
  const until = Date.now() + 10_000;
  while (page.workers().length > 0 && Date.now() < until) await page.waitForTimeout(50);
  await page.waitForTimeout(500);
  assert.equal(page.workers().length, 0);
  assert.deepEqual(wrong, []);
  await close();
});
