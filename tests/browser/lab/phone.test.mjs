// The laboratory on a phone: fingers drag and read, and nothing needs a drag.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { fingers } from "../browser.js";
import { browser, open, serve } from "./harness.mjs";

let server, own;
before(async () => ([server, own] = [await serve(), await browser()]));
after(async () => {
  await own.close();
  server.close();
});

const PHONE = { viewport: { width: 390, height: 800 }, hasTouch: true, isMobile: true };

test("a finger on the bob drags it, and one beside it scrolls the page", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#play?system=pendulum`, PHONE);
  await page.locator(".figures dd").first().waitFor();
  const touch = await fingers(page);
  const box = await page.locator("canvas.stage").boundingBox();
  const metre = Math.min(box.width, box.height) / 2 / 1.35;
  const at = (angle) => [box.x + box.width / 2 + metre * Math.sin(angle), box.y + box.height / 2 + metre * Math.cos(angle)];
  await touch("touchStart", at(1.8));
  // Down at first, as a finger that scrolls goes.
  for (const angle of [1.6, 1.3, 1, 0.7, 0.5]) await touch("touchMove", at(angle));
  await touch("touchEnd");
  await page.waitForFunction(() => /[?&]q=0\.5/.test(location.hash));
  assert.equal(await page.evaluate(() => scrollY), 0);
  const [x, y] = [box.x + 12, box.y + box.height - 20];
  await touch("touchStart", [x, y]);
  for (const up of [20, 60, 120, 180]) await touch("touchMove", [x, y - up]);
  await touch("touchEnd");
  await page.waitForFunction(() => scrollY > 60);
  assert.match(page.url(), /[?&]q=0\.5/);
  assert.deepEqual(wrong, []);
  await close();
});

test("a tap on a plot reads its values, beneath it and until the next one", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#play?system=pendulum`, PHONE);
  await page.locator(".figures dd").first().waitFor();
  const figure = page.locator("figure.plot", { hasText: "Energy" });
  await figure.scrollIntoViewIfNeeded();
  const [canvas, height] = [await figure.locator("canvas").boundingBox(), (await figure.boundingBox()).height];
  await page.touchscreen.tap(canvas.x + 0.5 * canvas.width, canvas.y + 0.5 * canvas.height);
  const reading = figure.locator(".reading");
  await page.waitForFunction((text) => text.textContent.startsWith("time"), await reading.elementHandle());
  assert.match(await reading.textContent(), /^time \d.*: energy 2\.227 J/);
  assert.ok((await reading.boundingBox()).y >= canvas.y + canvas.height);
  assert.equal((await figure.boundingBox()).height, height, "the plot moves under the finger");
  assert.deepEqual(wrong, []);
  await close();
});

test("Learn begins with its button and its stage, and says that it learns", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#learn?system=pendulum&seconds=60`, PHONE);
  const learning = page.getByRole("region", { name: "Learning" });
  const stage = await learning.locator("canvas.stage").boundingBox();
  assert.ok(stage.y + stage.height < PHONE.viewport.height, `the stage ends at ${stage.y + stage.height} px`);
  const said = learning.getByRole("status").filter({ visible: true });
  assert.match(await said.textContent(), /^Nothing is learned yet/);
  await learning.getByRole("button", { name: "Learn", exact: true }).click();
  await learning.getByText("Both learn").waitFor();
  await learning.getByRole("button", { name: "Stop" }).click();
  assert.match(await said.textContent(), /stopped/);
  // Without a model the truth alone moves on.
  await learning.getByText("Set the start with sliders").click();
  await put(learning, "q at the start", 0);
  await page.waitForFunction(() => /truth: −9\.8/.test(document.querySelector('[aria-label^="Energy along"]').getAttribute("aria-label")));
  assert.equal(await page.locator(".message.bad:visible").count(), 0);
  assert.deepEqual(wrong, []);
  await close();
});

/** Sets a slider to a value, as a finger on it does. */
const put = (group, name, value) => group.getByLabel(name).fill(String(value));

test("the start of the race and of recorded motions is set with sliders", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#learn?system=pendulum`, PHONE);
  const race = page.getByRole("region", { name: "Learning" });
  await race.getByText("Set the start with sliders").click();
  await put(race, "q at the start", 0);
  const energy = page.locator('[aria-label^="Energy along"]');
  await page.waitForFunction((plot) => /truth: −9\.8/.test(plot.getAttribute("aria-label")), await energy.elementHandle());
  const data = page.getByRole("region", { name: "Data and networks" });
  await data.getByText("Record motions by hand").click();
  for (const angle of [0.5, 1, 1.5]) {
    await put(data, "q at the start", angle);
    await data.getByRole("button", { name: "Record this start" }).click();
  }
  await page.getByText("3 motions begun by hand").waitFor();
  assert.deepEqual(wrong, []);
  await close();
});
