// Play: systems follow the hand, and their figures are those of mechanics.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { browser, open, serve } from "./harness.mjs";

let server, own;
before(async () => ([server, own] = [await serve(), await browser()]));
after(async () => {
  await own.close();
  server.close();
});

/** A figure of the view, by its name. */
async function figure(page, name) {
  const text = await page.locator(".figures div", { hasText: name }).locator("dd").textContent();
  return text.replaceAll("−", "-").split(/[ ,]+/).map(Number);
}

test("a pendulum that is dragged to the side has the energy of its height", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#play?system=pendulum`);
  const stage = page.locator("canvas.stage");
  await page.locator(".figures dd").first().waitFor();
  const box = await stage.boundingBox();
  const metre = Math.min(box.width, box.height) / 2 / 1.35;
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x + metre * Math.sin(1.8), y + metre * Math.cos(1.8));
  await page.mouse.down();
  await page.mouse.move(x + metre, y, { steps: 5 });
  await page.mouse.up();
  await page.waitForFunction(() => location.hash.includes("q=1.57"));
  await page.waitForFunction(() => document.querySelector(".figures")?.textContent?.includes("1.57"));
  const [energy] = await figure(page, "energy H");
  assert.ok(Math.abs(energy) < 0.05, `H = −m g l cos 90° is 0, not ${energy}`);
  assert.deepEqual(wrong, []);
  await close();
});

test("every system moves, keeps its energy, and comes back from its address", async () => {
  const { page, wrong, close } = await open(own, server.url);
  const names = await page.locator("select option").evaluateAll((all) => all.map((o) => o.value));
  assert.equal(names.length, 7);
  for (const name of names) {
    await page.getByLabel("System").selectOption(name);
    await page.waitForFunction((own) => location.hash.includes(`system=${own}`), name);
    await page.waitForFunction(() => Number(document.querySelector(".figures dd")?.textContent?.split(" ")[0]) > 0.2);
    const [early] = await figure(page, "energy H");
    await page.waitForTimeout(400);
    const [late] = await figure(page, "energy H");
    assert.ok(Math.abs(late - early) <= 0.01 * Math.max(1, Math.abs(early)), `${name}: ${early} J, then ${late} J`);
    const address = page.url();
    const again = await open(own, address);
    await again.page.locator(".figures dd").first().waitFor();
    assert.equal(await again.page.getByLabel("System").inputValue(), name);
    await again.close();
  }
  assert.deepEqual(wrong, []);
  await close();
});

test("the keyboard sets the state, and friction takes energy", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#play?system=pendulum&q=1.500&qd=0.000`);
  await page.locator(".figures dd").first().waitFor();
  await page.getByLabel("q at the start").focus();
  await page.keyboard.press("ArrowRight");
  await page.waitForFunction(() => location.hash.includes("q=1.51"));
  const friction = page.getByLabel("Friction");
  await friction.focus();
  for (let k = 0; k < 30; k++) await page.keyboard.press("ArrowRight");
  await page.waitForFunction(() => location.hash.includes("friction=0.30"));
  await page.getByRole("button", { name: "Begin again" }).click();
  await page.waitForFunction(() => Number(document.querySelector(".figures dd")?.textContent?.split(" ")[0]) > 2, undefined, { timeout: 15_000 });
  const [energy] = await figure(page, "energy H");
  assert.ok(energy < -2, `after 2 s of friction ${energy} J are left of -0.6 J`);
  assert.deepEqual(wrong, []);
  await close();
});
