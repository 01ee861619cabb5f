// Values that have no place on a plot and names that are no names: nothing breaks, nothing hangs, nothing is run.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { frame, launched, opened } from "../browser.js";

let browser;
before(async () => { browser = await launched(); });
after(() => browser.close());

test("every figure with a value can be pointed at, zoomed, rescaled and reset", async () => {
  const { page, faults, close } = await opened(browser, "hostile.html");
  page.on("dialog", (dialog) => faults.push(dialog.message()));
  const figures = page.locator("[data-plot]"), count = await figures.count();
  assert.ok(count >= 12, `${count} figures`);
  assert.equal(await page.locator("[data-plot].live").count(), count);
  for (let k = 0; k < count; k++) {
    const box = figures.nth(k).locator(".plot");
    await box.scrollIntoViewIfNeeded();
    await frame(page);
    const edge = await box.boundingBox();
    for (const u of [0.2, 0.5, 0.9]) await page.mouse.move(edge.x + u * edge.width, edge.y + 0.5 * edge.height);
    await box.focus();
    for (const key of ["Home", "ArrowRight", "ArrowUp", "+", "+", "l", "ArrowLeft", "-", "l", "End", "0", "Escape"]) await page.keyboard.press(key);
    await frame(page);
  }
  assert.equal(await page.locator("main img").count(), 0);
  assert.deepEqual(faults, []);
  await close();
});
