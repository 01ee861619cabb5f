// Learn: both networks learn while the page is used, and only one keeps the energy.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { browser, open, serve } from "./harness.mjs";

let server, own;
before(async () => ([server, own] = [await serve(), await browser()]));
after(async () => {
  await own.close();
  server.close();
});

const TIME = { timeout: 90_000 };

async function percent(page, side) {
  const figure = page.locator(`[data-side="${side}"]`);
  await figure.waitFor(TIME);
  return Number(await figure.getAttribute("data-percent"));
}

test("a fit in the page has the energy error that the same seed has natively", async () => {
  const native = JSON.parse(await readFile(new URL("./native.json", import.meta.url), "utf8"));
  const { page, wrong, close } = await open(own, `${server.url}#${native.address}`);
  await page.getByRole("button", { name: "Learn", exact: true }).click();
  const ratio = (await percent(page, "lagrangian")) / native.percent;
  assert.ok(ratio > 0.8 && ratio < 1.25, `${ratio} of the native error`);
  const curves = await page.locator(".plot .chart").nth(1).getAttribute("aria-label");
  assert.match(curves, /Lagrangian: .*e−/);
  const [saved] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save the Lagrangian" }).click()]);
  assert.equal(saved.suggestedFilename(), "pendulum.safetensors");
  assert.deepEqual(wrong, []);
  await close();
});

// With what the view proposes.
test("of a double pendulum the Lagrangian keeps the energy, and a plain network of the same size does not", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#learn?system=double-pendulum&steps=150`);
  await page.getByRole("button", { name: "Learn", exact: true }).click();
  const [lagrangian, plain] = [await percent(page, "lagrangian"), await percent(page, "plain")];
  assert.ok(lagrangian < 0.5 * plain, `the Lagrangian is ${lagrangian} % off after 100 s, the plain network ${plain} %`);
  assert.deepEqual(wrong, []);
  await close();
});

test("learning stops at once, and the page answers while it learns", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#learn?system=double-pendulum&seconds=60`);
  await page.getByRole("button", { name: "Learn", exact: true }).click();
  await page.locator("progress").evaluate((bar) => new Promise((done) => {
    const look = () => (bar.value > 0 ? done() : requestAnimationFrame(look));
    look();
  }));
  // The page draws and answers while both learn.
  await page.evaluate(() => new Promise((done) => {
    let frames = 0;
    const look = () => (++frames < 30 ? requestAnimationFrame(look) : done());
    requestAnimationFrame(look);
  }));
  assert.ok((await page.locator("progress").evaluate((bar) => bar.value)) < 1);
  await page.getByRole("button", { name: "Stop" }).click();
  await page.getByRole("button", { name: "Learn", exact: true }).waitFor();
  assert.equal(await page.locator(".message:visible").count(), 0);
  assert.deepEqual(wrong, []);
  await close();
});

test("friction is learned beside the Lagrangian, and positions alone are enough", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#learn?system=pendulum&steps=150&width=32&motions=20`);
  await page.getByLabel("What if there is friction?").check();
  await page.getByLabel("What if we only have positions?").check();
  await page.waitForFunction(() => location.hash.includes("friction=0.1") && location.hash.includes("positions=1"));
  await page.getByRole("button", { name: "Learn", exact: true }).click();
  const off = await percent(page, "lagrangian");
  assert.ok(off < 5, `${off} % off the true energy after 30 s`);
  assert.deepEqual(wrong, []);
  await close();
});

test("motions that a hand begins become the data", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#learn?system=pendulum&steps=20&width=8`);
  await page.getByText("Record motions by hand").click();
  const stage = page.locator("details canvas.stage");
  await stage.scrollIntoViewIfNeeded();
  const box = await stage.boundingBox();
  const [x, y, metre] = [box.x + box.width / 2, box.y + box.height / 2, Math.min(box.width, box.height) / 2 / 1.35];
  let angle = 1.8;
  for (const next of [0.6, 1.2, -0.8, 2.2]) {
    await page.mouse.move(x + metre * Math.sin(angle), y + metre * Math.cos(angle));
    await page.mouse.down();
    await page.mouse.move(x + metre * Math.sin(next), y + metre * Math.cos(next), { steps: 4 });
    await page.mouse.up();
    angle = next;
  }
  await page.getByText("4 motions begun by hand").waitFor();
  await page.getByRole("button", { name: "Learn", exact: true }).click();
  assert.ok((await percent(page, "lagrangian")) < 100);
  assert.deepEqual(wrong, []);
  await close();
});
