// Motions that are played: what stands where at which time, and the controls.

import assert from "node:assert/strict";
import { after, afterEach, before, beforeEach, test } from "node:test";

import { frame, launched, opened } from "../browser.js";

/** The part of a canvas's size that the radius of a stage is, as the page draws it. */
const RADIUS = 0.455;

let browser, page, faults, close;
before(async () => { browser = await launched(); });
after(() => browser.close());
beforeEach(async () => { ({ page, faults, close } = await opened(browser, "known.html")); });
afterEach(async () => {
  await close();
  assert.deepEqual(faults, []);
});

const player = (title) => page.locator(".player", { has: page.locator("h3", { hasText: title }) });

/** Goes to a time, without the trails that would cover what is looked for. */
async function shown(title, t) {
  await player(title).scrollIntoViewIfNeeded();
  await player(title).locator(".trails").uncheck();
  await player(title).locator(".slider").evaluate((slider, t) => {
    slider.value = t;
    slider.dispatchEvent(new Event("input"));
  }, t);
  await frame(page);
}

/** Whether a panel has its own ink at these places, which are in parts of the radius from the middle of the stage. */
const inked = (title, panel, ink, places) => player(title).locator("canvas[role=img]").nth(panel).evaluate((canvas, [ink, places, share]) => {
  const copy = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
  const context = copy.getContext("2d", { willReadFrequently: true }), radius = share * Math.min(canvas.width, canvas.height);
  context.fillStyle = getComputedStyle(document.documentElement).getPropertyValue(ink).trim();
  context.fillRect(0, 0, 1, 1);
  const own = context.getImageData(0, 0, 1, 1).data;
  context.clearRect(0, 0, 1, 1);
  context.drawImage(canvas, 0, 0);
  return places.map(([x, y]) => {
    const found = context.getImageData(Math.round(canvas.width / 2 + x * radius), Math.round(canvas.height / 2 - y * radius), 1, 1).data;
    return [0, 1, 2].every((k) => Math.abs(found[k] - own[k]) < 8) && found[3] > 200;
  });
}, [ink, places, RADIUS]);

test("the joints and tips of a robot stand where the data say, lines between them, and nothing elsewhere", async () => {
  for (const t of [0, 1, 2.5]) {
    await shown("A robot", t);
    for (const [panel, ink, late] of [[0, "--truth", 0], [1, "--baseline", 0.5]]) {
      const angle = t - late, joint = [Math.cos(angle) / 2.5, Math.sin(angle) / 2.5];
      const tips = [-0.5, 0.5].map((turn) => [joint[0] + Math.cos(angle + turn) / 2.5, joint[1] + Math.sin(angle + turn) / 2.5]);
      const half = joint.map((own) => own / 2), between = [0, 1].map((k) => (tips[0][k] + tips[1][k]) / 2);
      const places = [[0, 0], joint, ...tips, half, between, joint.map((own) => -own)];
      assert.deepEqual(await inked("A robot", panel, ink, places), [true, true, true, true, true, false, false], `panel ${panel} at ${t} s`);
    }
  }
});

test("a pendulum hangs at its angle, and its energy error is told", async () => {
  for (const t of [0, 1.3]) {
    await shown("A pendulum", t);
    const angle = Math.cos(3 * t) + 0.01 * t;
    const at = (part) => [part * Math.sin(angle), -part * Math.cos(angle)];
    assert.deepEqual(await inked("A pendulum", 1, "--lnn", [at(1), at(0.5), at(-0.5)]), [true, true, false], `at ${t} s`);
  }
  assert.equal(await player("A pendulum").locator("output").nth(1).innerText(), "energy error 1.30 %");
});

test("a motion waits where motion is unwelcome, plays when asked to, and pauses", async () => {
  const slider = player("A robot").locator(".slider"), play = player("A robot").locator(".play");
  const time = () => slider.inputValue().then(Number);
  await play.scrollIntoViewIfNeeded();
  assert.equal(await time(), 0);
  assert.equal(await play.innerText(), "Play");
  await play.click();
  await page.waitForFunction((own) => Number(own.value) > 0.2, await slider.elementHandle());
  await play.click();
  assert.equal(await play.innerText(), "Play");
  const stopped = await time();
  await page.waitForTimeout(200);
  assert.equal(await time(), stopped);
});
