// The contents of a long page: links that stay in view, sections and tables that fold, and what print and a page without scripts make of them.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { folder, launched, opened } from "../browser.js";

let browser;
before(async () => { browser = await launched(); });
after(() => browser.close());

for (const width of [390, 1280]) {
  test(`the contents stay in view and lead to each section at ${width} px`, async () => {
    const { page, faults, close } = await opened(browser, "known.html", { width, touch: width === 390 });
    const links = page.locator(".contents a");
    assert.deepEqual(await links.allInnerTexts(), ["In motion", "Motion", "Kinds of figures", "Forces", "Training", "Maps", "Tables", "Settings", "Make this again"]);
    const section = page.locator("#section-training");
    await section.locator("summary").first().click();
    assert.ok(!(await section.evaluate((own) => own.open)));
    await links.filter({ hasText: "Training" }).click();
    assert.ok(await section.evaluate((own) => own.open), "a section that is asked for is unfolded");
    const bar = await page.locator(".contents").boundingBox(), heading = await section.locator("h2").boundingBox();
    assert.ok(bar.y >= 0 && bar.y < 2, `the contents are at ${bar.y} px`);
    assert.ok(heading.y >= bar.y + bar.height && heading.y < 450, `the heading is at ${heading.y} px`);
    // A legend that several plots share stays in view beneath the contents.
    await page.locator("#figure-torque-5 .plot").scrollIntoViewIfNeeded();
    const legend = await page.locator("#section-forces .group.shared > .legend").boundingBox();
    assert.ok(legend.y >= bar.height - 2, `the legend is at ${legend.y} px`);
    assert.deepEqual(faults, []);
    await close();
  });
}

test("a figure of a section that was folded is drawn when it is unfolded", async () => {
  const { page, close } = await opened(browser, "known.html");
  const section = page.locator("#section-forces");
  await section.evaluate((own) => { own.open = false; });
  await page.reload();
  await section.evaluate((own) => { own.open = false; });
  await page.locator(".contents a", { hasText: "Forces" }).click();
  await page.waitForFunction(() => document.querySelector("#figure-torque-1 .mount canvas"));
  await close();
});

test("a long table is folded, and printed all the same, without the contents", async () => {
  const { page, close } = await opened(browser, "known.html");
  const [long, short] = [page.getByRole("cell", { name: "196" }), page.getByRole("cell", { name: "9", exact: true }).last()];
  assert.ok(!(await long.isVisible()) && (await short.isVisible()));
  await page.getByText("14 rows").click();
  assert.ok(await long.isVisible());
  await page.getByText("14 rows").click();
  await page.emulateMedia({ media: "print" });
  assert.ok(await long.isVisible());
  assert.ok(!(await page.locator(".contents").isVisible()));
  assert.ok(!(await page.locator(".save").first().isVisible()));
  await close();
});

test("without scripts the page says what it says, and shows no control that does nothing", async () => {
  const context = await browser.newContext({ javaScriptEnabled: false });
  const page = await context.newPage();
  await page.goto(`file://${folder}/known.html`);
  assert.ok(await page.locator(".answer").isVisible());
  for (const dead of [".theme", ".controls", ".line button"]) assert.ok(!(await page.locator(dead).first().isVisible()), dead);
  assert.match(await page.locator(".player").first().innerText(), /Scripts are off/);
  await page.locator(".contents a", { hasText: "Tables" }).click();
  assert.ok(await page.locator("#section-tables h2").isVisible());
  await context.close();
});
