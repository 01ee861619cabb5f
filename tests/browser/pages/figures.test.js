// What a reader does with a figure: point, zoom, pan, hide, change the scale, with a mouse, a finger and keys.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { after, afterEach, before, beforeEach, test } from "node:test";

import { PNG } from "pngjs";

import { frame, launched, opened, plotOf } from "../browser.js";

let browser, page, faults, close;
before(async () => { browser = await launched(); });
after(() => browser.close());
beforeEach(async () => { ({ page, faults, close } = await opened(browser, "known.html")); });
afterEach(async () => {
  await close();
  assert.deepEqual(faults, []);
});

// The number of a row such as "Truth −0.525 rad".
const number = (row) => Number(row.match(/([−-]?\d+(\.\d+)?)(?=[^\d]*$)/)[1].replace("−", "-"));
const inside = (edge, u, v) => [edge.x + u * edge.width, edge.y + v * edge.height];

test("the values under the pointer are those of the data, on all plots of the abscissa", async () => {
  const [position, velocity] = [plotOf(page, "position"), plotOf(page, "velocity")];
  const edge = await position.seen();
  for (const u of [0.3, 0.55, 0.8]) {
    await page.mouse.move(...inside(edge, u, 0.5));
    const [time, truth, lnn, plain] = await position.values();
    const t = Number(time.match(/time (\S+) s/)[1]);
    for (const [row, wanted] of [[truth, Math.sin(t)], [lnn, Math.sin(t) + 0.01 * t], [plain, Math.sin(t) + 0.05 * t]]) {
      assert.ok(Math.abs(number(row.replace(" rad", "")) - wanted) < 0.001, `${row}, but ${wanted} at ${t} s`);
    }
    assert.match(truth, /^Truth −?0\.\d{3,5} rad$/);
    const linked = await velocity.values();
    assert.equal(linked[0], time);
    // A curve of every second sample is read on the line between two.
    if (t < 6) {
      const band = (await plotOf(page, "band").values())[1].match(/predicted (\S+) N \((\S+) … (\S+)\)/).slice(1).map((text) => Number(text.replace("−", "-")));
      assert.ok(band.every((value, k) => Math.abs(value - [1, 0.9, 1.1][k] * Math.cos(t)) < 0.003 || Math.abs(value - [1, 1.1, 0.9][k] * Math.cos(t)) < 0.003), `${band} at ${t} s`);
    }
    assert.ok(Math.abs(number(linked[1].replace(" rad", "")) - 2 * Math.sin(t)) < 0.001, linked[1]);
  }
  await page.mouse.move(5, 5);
  await frame(page);
  assert.ok(await position.readout.isHidden());
  assert.ok(await velocity.readout.isHidden());
});

test("a box zooms, a double click resets, and the view is the same in all plots of the same times", async () => {
  const [position, velocity] = [plotOf(page, "position"), plotOf(page, "velocity")];
  const edge = await position.seen(), [whole, other] = [await position.picture(), await velocity.picture()];
  const reset = position.figure.locator(".reset");
  assert.ok(await reset.isHidden());
  await page.mouse.move(...inside(edge, 0.4, 0.5));
  await page.mouse.down();
  await page.mouse.move(...inside(edge, 0.6, 0.52), { steps: 5 });
  await page.mouse.up();
  assert.notEqual(await position.picture(), whole);
  assert.notEqual(await velocity.picture(), other);
  assert.ok(await reset.isVisible());
  // A fifth of the width is a fifth of the times: the ends are about 2 s apart.
  await page.mouse.move(...inside(edge, 0.2, 0.5));
  const from = Number((await position.values())[0].match(/time (\S+) s/)[1]);
  await page.mouse.move(...inside(edge, 0.9, 0.5));
  const to = Number((await position.values())[0].match(/time (\S+) s/)[1]);
  assert.ok(to - from > 0.8 && to - from < 2.2, `${from} to ${to}`);
  await page.mouse.dblclick(...inside(edge, 0.5, 0.5));
  await page.mouse.move(5, 5);
  assert.equal(await position.picture(), whole);
  assert.equal(await velocity.picture(), other);
});

test("Shift and a drag pan a zoomed view, and the button goes back", async () => {
  const position = plotOf(page, "position"), edge = await position.seen(), whole = await position.picture();
  await position.box.focus();
  for (const _ of [1, 2, 3]) await page.keyboard.press("+");
  const zoomed = await position.picture();
  await page.keyboard.down("Shift");
  await page.mouse.move(...inside(edge, 0.7, 0.5));
  await page.mouse.down();
  await page.mouse.move(...inside(edge, 0.5, 0.5), { steps: 4 });
  await page.mouse.up();
  await page.keyboard.up("Shift");
  await page.mouse.move(5, 5);
  const panned = await position.picture();
  assert.ok(panned !== zoomed && panned !== whole);
  await position.figure.locator(".reset").click();
  assert.equal(await position.picture(), whole);
});

test("the wheel scrolls the page, and zooms with Ctrl or after a click", async () => {
  const position = plotOf(page, "position"), edge = await position.seen(), whole = await position.picture();
  await page.mouse.move(...inside(edge, 0.5, 0.5));
  await page.mouse.wheel(0, 120);
  await page.waitForFunction(() => scrollY > 0);
  assert.equal(await position.picture(), whole);
  const there = await position.seen();
  await page.mouse.move(...inside(there, 0.5, 0.5));
  await page.keyboard.down("Control");
  await page.mouse.wheel(0, -240);
  await page.keyboard.up("Control");
  const zoomed = await position.picture();
  assert.notEqual(zoomed, whole);
  const scrolled = await page.evaluate(() => scrollY);
  await page.mouse.click(...inside(there, 0.5, 0.5));
  await page.mouse.wheel(0, -120);
  assert.notEqual(await position.picture(), zoomed);
  assert.equal(await page.evaluate(() => scrollY), scrolled);
});

test("one legend serves plots that share their series: a click hides a curve in all, two leave it alone", async () => {
  const group = page.locator(".group.shared").first(), names = group.locator(".legend .curve");
  assert.deepEqual(await names.allInnerTexts(), ["Truth", "Lagrangian network", "Plain network"]);
  assert.equal(await page.locator("#figure-torque-1, #figure-torque-6").locator(".legend").count(), 0);
  const [position, velocity] = [plotOf(page, "position"), plotOf(page, "velocity")], edge = await position.seen();
  const [whole, other] = [await position.picture(), await velocity.picture()];
  const plain = names.filter({ hasText: "Plain" });
  await plain.click();
  assert.equal(await plain.getAttribute("aria-pressed"), "false");
  assert.notEqual(await position.picture(), whole);
  assert.notEqual(await velocity.picture(), other);
  await page.mouse.move(...inside(edge, 0.5, 0.5));
  assert.equal((await position.values()).length, 3);
  await plain.click();
  await page.mouse.move(5, 5);
  assert.equal(await position.picture(), whole);
  await plain.dblclick();
  assert.deepEqual(await names.evaluateAll((all) => all.map((one) => one.getAttribute("aria-pressed"))), ["false", "false", "true"]);
  await plain.dblclick();
  assert.deepEqual(await names.evaluateAll((all) => all.map((one) => one.getAttribute("aria-pressed"))), ["true", "true", "true"]);
});

test("the scale of positive values can be changed, and that of others cannot", async () => {
  const loss = plotOf(page, "loss");
  await loss.seen();
  const button = loss.figure.locator(".scale"), logarithmic = await loss.picture();
  assert.equal(await button.getAttribute("aria-pressed"), "true");
  await button.click();
  assert.equal(await button.getAttribute("aria-pressed"), "false");
  const linear = await loss.picture();
  assert.notEqual(linear, logarithmic);
  await loss.box.focus();
  await page.keyboard.press("l");
  assert.equal(await loss.picture(), logarithmic);
  assert.ok(await plotOf(page, "position").figure.locator(".scale").isHidden());
});

test("a scale is offered where all values are positive, without those of a shade", async () => {
  const offered = async (id) => plotOf(page, id).figure.locator(".scale").isVisible();
  for (const id of ["loss", "energy-error", "shaded"]) assert.ok(await offered(id), id);
  // A sine is negative, and a line through 0 has no place on a logarithmic axis.
  for (const id of ["velocity", "band", "parity-torque", "phase"]) assert.ok(!(await offered(id)), id);
});

test("a shade reaches over the whole height of its plot, and has no line in the legend and no value", async () => {
  const shaded = plotOf(page, "shaded"), edge = await shaded.seen();
  // 0.9 of the width lies outside of the data; just within the frame at its upper and at its lower end.
  const frame = await shaded.figure.locator(".u-over").boundingBox();
  const places = [frame.y + 3, frame.y + frame.height - 3].map((y) => (y - edge.y) / edge.height);
  const inks = await shaded.figure.locator(".mount canvas").evaluate((canvas, places) => {
    const { data } = canvas.getContext("2d").getImageData(0.9 * canvas.width, 0, 1, canvas.height);
    return places.map((v) => data[4 * Math.floor(v * canvas.height) + 3]);
  }, places);
  assert.ok(inks.every((alpha) => alpha > 0), `${inks}`);
  const swatch = shaded.figure.locator(".swatch.shade");
  assert.equal(await swatch.evaluate((own) => getComputedStyle(own, "::after").display), "none");
  await page.mouse.move(...inside(edge, 0.5, 0.5));
  assert.equal((await shaded.values()).length, 2);
});

const saved = async (plot, kind, act) => {
  await plot.figure.locator(".save summary").click();
  const [download] = await Promise.all([page.waitForEvent("download"), act(plot.figure.getByRole("button", { name: `Save as ${kind}` }))]);
  return { name: download.suggestedFilename(), bytes: readFileSync(await download.path()) };
};

test("a figure is saved as numbers: a column a curve, with their units", async () => {
  const { name, bytes } = await saved(plotOf(page, "position"), "CSV", (button) => button.click());
  assert.equal(name, "known-values-position.csv");
  const rows = bytes.toString().trimEnd().split("\r\n").map((line) => line.split(","));
  assert.deepEqual(rows[0], ["time (s)", "Truth", "Lagrangian network", "Plain network"]);
  assert.equal(rows.length, 1002);
  for (const [t, truth] of rows.slice(1).map((row) => row.map(Number))) assert.ok(Math.abs(truth - Math.sin(t)) < 1e-6, `${truth} at ${t} s`);
  const map = (await saved(plotOf(page, "field"), "CSV", (button) => button.click())).bytes.toString().split("\r\n");
  assert.deepEqual([map[0], map.length], ["place (m),time (s),value", 202]);
  const [place, time, value] = map[23].split(",").map(Number);
  assert.ok(Math.abs(value - (2 / 10 - 1 / 5)) < 1e-3 && Math.abs(place - 0.25) < 1e-6 && Math.abs(time - 0.15) < 1e-6, map[23]);
});

test("a figure is saved as a picture that needs no page, on white in the dark too, by the keyboard", async () => {
  await page.emulateMedia({ colorScheme: "dark" });
  const png = await saved(plotOf(page, "loss"), "PNG", (button) => button.press("Enter"));
  assert.equal(png.name, "known-values-loss.png");
  const { data, width, height } = PNG.sync.read(png.bytes);
  assert.ok(width > 1500 && height > 900, `${width} × ${height}`);
  // White around, ink within, and the blue of the learned curve.
  const at = (k) => [...data.subarray(4 * k, 4 * k + 3)];
  const pixels = Array.from({ length: width * height }, (_, k) => at(k));
  assert.deepEqual(pixels[0], [255, 255, 255]);
  assert.ok(pixels.filter(([r, g, b]) => r + g + b < 600).length > 10_000);
  assert.ok(pixels.filter((pixel) => pixel.join() === "29,99,209").length > 1000);
  const map = await saved(plotOf(page, "field"), "PNG", (button) => button.click());
  assert.equal(map.name, "known-values-field.png");
});

test("arrow keys read values, and they are announced", async () => {
  const position = plotOf(page, "position");
  await position.seen();
  await position.box.focus();
  const spoken = () => page.locator("[aria-live=polite]").innerText();
  await page.keyboard.press("Home");
  assert.match(await spoken(), /^time 0 s, Truth 0 rad, Lagrangian network 0 rad/);
  await page.keyboard.press("End");
  assert.match(await spoken(), /^time 10\.00 s, Truth −0\.544 rad, Lagrangian network −0\.444 rad, Plain network −0\.0440 rad/);
  const before = await spoken();
  await page.keyboard.press("ArrowLeft");
  assert.notEqual(await spoken(), before);
  await page.keyboard.press("+");
  assert.match(await spoken(), /^time from .* to .* s, position from/);
  assert.ok(await position.figure.locator(".reset").isVisible());
  await page.keyboard.press("0");
  assert.ok(await position.figure.locator(".reset").isHidden());
  await page.keyboard.press("Escape");
  assert.ok(await position.readout.isHidden());
});

test("each figure is told in words", async () => {
  const words = await page.locator("#figure-loss .plot").evaluate((box) => box.getAttribute("aria-describedby").split(" ").map((id) => document.getElementById(id).textContent).join(" "));
  assert.match(words, /loss over step\. Lagrangian, training: from .* to 1\.00, step from 0\.00 to 1990/);
  assert.match(words, /Arrow keys read values/);
});

test("the point under the pointer is read in clouds and portraits", async () => {
  for (const [id, name] of [["phase", "angle"], ["parity-torque", "true torque"], ["categories", "system"]]) {
    const plot = plotOf(page, id);
    await plot.seen();
    await plot.box.focus();
    await page.keyboard.press("ArrowRight");
    await page.keyboard.press("ArrowRight");
    const rows = await plot.values();
    assert.ok(rows.some((row) => row.startsWith(name)), rows.join("; "));
    await page.keyboard.press("Escape");
  }
  const phase = plotOf(page, "phase"), edge = await phase.seen();
  await page.mouse.move(...inside(edge, 0.5, 0.1));
  const rows = await phase.values(), [x, y] = [number(rows.at(-2).replace(" rad", "")), number(rows.at(-1).replace(" rad/s", ""))];
  assert.ok(Math.abs((x / 2) ** 2 + y ** 2 - 1) < 0.01, rows.join("; "));
  await page.mouse.move(...inside(edge, 0.5, 0.5));
  await frame(page);
  assert.ok(await phase.readout.isHidden(), "nothing is read far from all points");
});

test("the cell of a map under the pointer is read", async () => {
  const map = plotOf(page, "field"), edge = await map.seen();
  await page.mouse.move(...inside(edge, 0.6, 0.4));
  const [place, time, value] = (await map.values()).map((row) => number(row.replace(/ (m|s)$/, "")));
  const [column, row] = [Math.round(place / 0.1 - 0.5), Math.round(time / 0.1 - 0.5)];
  assert.ok(Math.abs(value - (column / 10 - row / 5)) < 1e-3, `${value} in column ${column} of row ${row}`);
  await map.box.focus();
  await page.keyboard.press("ArrowRight");
  const [next] = (await map.values()).map((row) => number(row.replace(/ (m|s)$/, "")));
  assert.ok(Math.abs(next - place - 0.1) < 1e-3);
});

test("a figure without values says so, and no other is lost", async () => {
  assert.match(await page.locator("#figure-nothing .empty").innerText(), /nothing to draw/);
  assert.equal(await page.locator("figure.figure.live").count(), (await page.locator("figure.figure").count()) - 1);
});

test("the page prints a picture of every plot, of those that were never in sight too, always on white", async () => {
  await page.emulateMedia({ colorScheme: "dark" });
  await page.evaluate(() => dispatchEvent(new Event("beforeprint")));
  await page.emulateMedia({ media: "print", colorScheme: "dark" });
  assert.equal(await page.evaluate(() => getComputedStyle(document.documentElement).getPropertyValue("--surface").trim()), "#ffffff");
  assert.equal(await page.locator(".printed").count(), await page.locator("[data-plot]").count());
  const printed = page.locator("#figure-loss .printed");
  assert.ok(await printed.isVisible());
  assert.ok(await page.locator("#figure-loss .mount").isHidden());
  const blue = await printed.evaluate((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let k = 0; k < data.length; k += 4) if (data[k] === 29 && data[k + 1] === 99 && data[k + 2] === 209 && data[k + 3] === 255) count++;
    return count;
  });
  assert.ok(blue > 1000, `${blue} pixels of the learned curve`);
  await page.evaluate(() => dispatchEvent(new Event("afterprint")));
  assert.equal(await page.locator(".printed").count(), 0);
});
