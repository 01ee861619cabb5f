// Every page at three widths in both themes: nothing overflows, nothing is asked of a network, nothing shuts anyone out.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { folder, launched, opened, scrolledThrough, violations } from "../browser.js";

let browser;
before(async () => { browser = await launched(); });
after(() => browser.close());

for (const name of ["known.html", "large.html", "hostile.html"]) {
  for (const width of [390, 768, 1280]) {
    for (const theme of ["light", "dark"]) {
      test(`${name} at ${width} px, ${theme}`, async () => {
        const { page, faults, close } = await opened(browser, name, { width, theme, touch: width === 390 });
        await scrolledThrough(page);
        assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= width, "the page is wider than the screen");
        assert.deepEqual(await violations(page), []);
        assert.deepEqual(faults, []);
        await close();
      });
    }
  }
}

test("a caption uses the width of its figure", async () => {
  const { page, close } = await opened(browser, "known.html");
  const limits = await page.locator(".caption").evaluateAll((all) => all.map((one) => getComputedStyle(one).maxWidth));
  assert.deepEqual([...new Set(limits)], ["none"]);
  await close();
});

test("without scripts verdicts, tables and words about each figure stand, and a sentence says where the numbers are", async () => {
  const context = await browser.newContext({ javaScriptEnabled: false });
  const page = await context.newPage();
  await page.goto(`file://${folder}/known.html`);
  assert.ok(await page.locator(".answer").isVisible());
  assert.ok(await page.getByRole("cell", { name: "9", exact: true }).last().isVisible());
  assert.match(await page.locator("#figure-loss .unseen").innerText(), /loss over step\. Lagrangian, training: from .* to 1\.00/);
  assert.ok(await page.locator("#figure-loss .unseen").isVisible());
  assert.match(await page.locator("#figure-loss").innerText(), /Scripts are off: .* numbers as CSV/);
  await context.close();
});
