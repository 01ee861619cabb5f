// Figures under fingers, on a phone.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { fingers, launched, opened, plotOf } from "../browser.js";

let browser;
before(async () => { browser = await launched(); });
after(() => browser.close());

test("a finger reads values, two zoom, and two taps reset", async () => {
  const { page, faults, close } = await opened(browser, "known.html", { width: 390, touch: true });
  const position = plotOf(page, "position"), edge = await position.seen(), touch = await fingers(page);
  const at = (u) => [edge.x + u * edge.width, edge.y + 0.5 * edge.height];
  const whole = await position.picture();
  await touch("touchStart", at(0.4));
  const first = (await position.values())[0];
  for (const u of [0.45, 0.5, 0.6]) await touch("touchMove", at(u));
  assert.notEqual((await position.values())[0], first);
  await touch("touchEnd");
  await touch("touchStart", at(0.4), at(0.6));
  for (const spread of [0.02, 0.06, 0.1]) await touch("touchMove", at(0.4 - spread), at(0.6 + spread));
  await touch("touchEnd");
  assert.notEqual(await position.picture(), whole);
  for (const _ of [1, 2]) {
    await touch("touchStart", at(0.5));
    await touch("touchEnd");
  }
  assert.equal(await position.picture(), whole);
  assert.deepEqual(faults, []);
  await close();
});

test("eight names take one line of a phone and follow the plots that they belong to", async () => {
  const { page, faults, close } = await opened(browser, "known.html", { width: 390, touch: true });
  const legend = page.locator(".group.shared", { has: page.locator("#figure-torque-1") }).locator(".legend");
  assert.equal(await legend.locator(".curve").count(), 8);
  await plotOf(page, "torque-3").seen();
  const box = await legend.boundingBox();
  // Beneath the contents, which stay in view above it.
  const contents = await page.locator(".contents").boundingBox();
  const beneath = box.y - contents.y - contents.height;
  assert.ok(box.height < 60 && beneath > -3 && beneath < 10, JSON.stringify({ box, contents }));
  assert.deepEqual(faults, []);
  await close();
});

test("eight values stand beneath the plot of a phone and hide none of it", async () => {
  const { page, faults, close } = await opened(browser, "known.html", { width: 390, touch: true });
  const torque = plotOf(page, "torque-1"), edge = await torque.seen(), touch = await fingers(page);
  const tall = () => page.evaluate(() => document.documentElement.scrollHeight);
  const before = await tall();
  await touch("touchStart", [edge.x + 0.5 * edge.width, edge.y + 100]);
  assert.equal((await torque.values()).length, 9);
  const [canvas, values] = [await torque.figure.locator(".mount").boundingBox(), await torque.readout.boundingBox()];
  assert.ok(values.y >= canvas.y + canvas.height, JSON.stringify({ canvas, values }));
  assert.ok(values.y + values.height <= edge.y + edge.height && values.x + values.width <= 390, "the values leave their place");
  assert.equal(await tall(), before, "the page moves under the finger");
  await touch("touchEnd");
  assert.deepEqual(faults, []);
  await close();
});
