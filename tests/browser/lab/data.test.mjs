// Your data: good files become models, bad ones a message with a remedy.

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

const give = (page, name, content) => page.getByLabel("Choose a file").setInputFiles({ name, mimeType: "text/csv", buffer: Buffer.from(content) });

/** A swinging pendulum, as phyphox writes it where decimal commas are usual. */
function phyphox() {
  const rows = Array.from({ length: 400 }, (_, k) => {
    const t = k * 0.02;
    return [t, 30 * Math.cos(3.1 * t) + 5 * Math.sin(1.1 * t)].map((x) => x.toFixed(5).replace(".", ",")).join(";");
  });
  return `"Time (s)";"Angle (deg)"\n${rows.join("\n")}\n`;
}

test("a recording is checked, fitted, saved, and its model dropped again", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#data`);
  await page.getByRole("button", { name: /example/ }).click();
  await page.getByRole("button", { name: "Check the data" }).click();
  await page.getByText("The data are").waitFor();
  await page.getByLabel("Time to learn").focus();
  await page.keyboard.press("Home");
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("ArrowRight");
  await page.getByRole("button", { name: "Fit", exact: true }).click();
  await page.getByText("on motions that were held back").waitFor({ timeout: 60_000 });
  const grade = await page.locator("[data-grade]").getAttribute("data-grade");
  assert.ok(["good", "fair", "poor"].includes(grade));
  const [saved] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save the model" }).click()]);
  const bytes = await readFile(await saved.path());
  assert.match(bytes.subarray(8, 400).toString(), /lagrangian-model/);
  await page.getByLabel("Choose a file").setInputFiles({ name: "kept.safetensors", mimeType: "application/octet-stream", buffer: bytes });
  await page.getByText("The model 'kept.safetensors'").waitFor();
  await page.getByText(/Its energy, /).waitFor();
  const damaged = Buffer.from(bytes);
  damaged[damaged.length - 100] ^= 1;
  await page.getByLabel("Choose a file").setInputFiles({ name: "damaged.safetensors", mimeType: "application/octet-stream", buffer: damaged });
  await page.getByText(/checksum/).waitFor();
  assert.deepEqual(wrong, []);
  await close();
});

test("several files are several motions, and a model is read alone", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#data`);
  const file = (name, buffer) => ({ name, mimeType: "text/csv", buffer: Buffer.from(buffer) });
  await page.getByLabel("Choose a file").setInputFiles([file("first.csv", phyphox()), file("second.csv", phyphox()), file("third.csv", phyphox())]);
  await page.getByRole("button", { name: "Check the data" }).click();
  await page.getByText("1200 samples of 3 motions").waitFor();
  await page.getByLabel("Choose a file").setInputFiles([file("first.csv", phyphox()), file("a.safetensors", "")]);
  await page.getByText("A model is read alone: choose it without other files.").waitFor();
  assert.deepEqual(wrong, []);
  await close();
});

test("decimal commas are understood and degrees are declared by a person", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#data`);
  await give(page, "phone.csv", phyphox());
  await page.getByText("decimal commas").waitFor();
  assert.equal(await page.getByLabel("Time, in seconds").inputValue(), "Time (s)");
  assert.ok(await page.getByLabel("Angle (deg) is an angle").isChecked());
  assert.ok(await page.getByLabel("Angles are in degrees").isChecked());
  await page.getByRole("button", { name: "Check the data" }).click();
  await page.getByText(/400 samples of 1 motion\./).waitFor();
  assert.deepEqual(wrong, []);
  await close();
});

test("a verdict does not outlive its file or its columns", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#data`);
  const verdict = page.getByText("The data are");
  const checked = async () => {
    await page.getByRole("button", { name: "Check the data" }).click();
    await verdict.waitFor();
  };
  await give(page, "phone.csv", phyphox());
  await checked();
  await page.getByLabel("Angles are in degrees").uncheck();
  assert.equal(await verdict.count(), 0);
  await checked();
  await give(page, "words.csv", "no table at all");
  await page.locator(".message.bad").waitFor();
  assert.equal(await verdict.count(), 0);
  assert.equal(await page.getByRole("button", { name: "Check the data" }).count(), 0);
  assert.deepEqual(wrong, []);
  await close();
});

test("rates of a gyroscope are not proposed as positions, and their long names fit a telephone", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#data`, { viewport: { width: 390, height: 800 } });
  const rows = Array.from({ length: 100 }, (_, k) => `${k / 50},${Math.cos(k / 9)},${Math.sin(k / 9)}`);
  await give(page, "gyroscope.csv", `"Time (s)","Gyroscope x (rad/s)","Gyroscope y, smoothed and without its offset (rad/s)"\n${rows.join("\n")}\n`);
  await page.getByText("a model is learned from positions").waitFor();
  assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= 390);
  assert.equal(await page.getByRole("checkbox", { name: "is a coordinate", checked: true }).count(), 0);
  await page.getByRole("button", { name: "Check the data" }).click();
  assert.match(await page.locator(".message.bad").textContent(), /^Choose at least one column/);
  await page.getByLabel("Gyroscope x (rad/s) is a coordinate").check();
  await page.getByRole("button", { name: "Check the data" }).click();
  await page.locator(".message.bad").filter({ hasText: "rad/s" }).waitFor();
  assert.deepEqual(wrong, []);
  await close();
});

/** The bytes of a file of hostile.json: bytes, a text, and rows that are repeated. */
function content({ hex = "", text = "", row = "", repeat = 0 }) {
  const rows = Array.from({ length: repeat }, (_, k) => row.replaceAll("{k}", k)).join("");
  return Buffer.concat([Buffer.from(hex, "hex"), Buffer.from(text + rows)]);
}

test("files that mean harm are refused with a remedy, or used, and the page goes on", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#data`);
  const message = page.locator(".message.bad:visible");
  const columns = page.locator("[aria-label=Columns]:not([data-seen])");
  for (const file of JSON.parse(await readFile(new URL("./hostile.json", import.meta.url), "utf8"))) {
    await page.evaluate(() => {
      for (const old of document.querySelectorAll(".message")) old.hidden = true;
      for (const old of document.querySelectorAll("[aria-label=Columns]")) old.dataset.seen = "";
    });
    await page.getByLabel("Choose a file").setInputFiles({ name: file.name, mimeType: "text/plain", buffer: content(file) });
    await message.or(columns).first().waitFor();
    if (await columns.count()) {
      await page.getByRole("button", { name: "Check the data" }).click();
      await message.or(page.locator("[aria-label=Results] .big .badge")).first().waitFor();
    }
    const text = (await message.count()) ? await message.textContent() : "it was checked";
    assert.ok(text.length >= 14 && text.length < 3000, `${file.name}: ${text}`);
    // The page answers at once.
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(done)));
  }
  assert.equal(await page.locator("main script, main img").count(), 0);
  await page.getByRole("button", { name: /example/ }).click();
  await page.getByRole("button", { name: "Check the data" }).click();
  await page.getByText("The data are").waitFor();
  assert.deepEqual(wrong, []);
  await close();
});
