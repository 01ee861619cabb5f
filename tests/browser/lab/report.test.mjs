// The page of a run: made in the browser, shown over the laboratory where it can do no harm, and saved as one file.

import assert from "node:assert/strict";
import { readFile, writeFile, mkdtemp } from "node:fs/promises";
import { tmpdir } from "node:os";
import path from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { violations } from "../browser.js";
import { browser, open, serve } from "./harness.mjs";

let server, own;
before(async () => ([server, own] = [await serve(), await browser()]));
after(async () => {
  await own.close();
  server.close();
});

/** Drops a table of a pendulum whose columns are these, checks it, and fits it for two seconds. */
async function fitted(page, header = "t,angle") {
  const rows = Array.from({ length: 500 }, (_, k) => `${k / 50},${1.2 * Math.cos(3.1 * (k / 50)) + 0.2 * Math.sin(1.7 * (k / 50))}`);
  const buffer = Buffer.from(`${header}\n${rows.join("\n")}\n`);
  await page.getByLabel("Choose a file").setInputFiles({ name: "swing.csv", mimeType: "text/csv", buffer });
  await page.getByRole("button", { name: "Check the data" }).click();
  await page.getByText("The data are").waitFor();
  await page.getByLabel("Time to learn").focus();
  await page.keyboard.press("Home");
  await page.getByRole("button", { name: "Fit", exact: true }).click();
  await page.getByText("on motions that were held back").waitFor({ timeout: 60_000 });
}

/** Opens the report; the document in it. */
async function opened(page) {
  await page.getByRole("button", { name: "Open the report" }).click();
  const report = page.frameLocator("dialog iframe").frameLocator("iframe");
  await report.locator("h1").waitFor();
  return report;
}

test("from a dropped table to a report whose headlines are judged and whose figures answer", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#data`);
  await fitted(page);
  const report = await opened(page);
  assert.ok((await report.locator(".card.good, .card.fair, .card.poor").count()) >= 2);
  assert.match(await report.locator(".subtitle").textContent(), new RegExp(`swing\\.csv .* ${new Date().getUTCFullYear()}-`));
  for (const title of ["Loss", "Energy at rest along angle"]) await report.getByRole("heading", { name: title }).first().waitFor();
  assert.match(await report.getByText(/SHA-256/).textContent(), /swing\.csv \(SHA-256 [0-9a-f]{12}…\)/);
  const plot = report.locator("figure .plot").first();
  await plot.scrollIntoViewIfNeeded();
  await plot.hover();
  await report.locator("figure .readout > div").first().waitFor();
  await page.getByRole("button", { name: "Close" }).click();
  await page.locator("dialog").waitFor({ state: "detached" });
  assert.equal(await page.evaluate(() => document.activeElement.textContent), "Open the report");
  assert.deepEqual(wrong, []);
  await close();
});

test("the saved report is a file that opens by itself", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#data`);
  await fitted(page);
  const [saved] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save the report" }).click()]);
  assert.equal(saved.suggestedFilename(), "swing.html");
  const bytes = await readFile(await saved.path());
  assert.match(bytes.subarray(0, 60).toString(), /^<!DOCTYPE html>\n<html lang="en">/);
  const file = path.join(await mkdtemp(path.join(tmpdir(), "report-")), "swing.html");
  await writeFile(file, bytes);
  const alone = await open(own, pathToFileURL(file).href);
  assert.ok((await alone.page.locator(".card").count()) >= 3);
  assert.ok((await alone.page.locator("figure.live .plot").count()) >= 4);
  await alone.page.locator("figure.live .plot").first().scrollIntoViewIfNeeded();
  await alone.page.locator("figure.live .plot canvas").first().waitFor();
  assert.deepEqual(alone.wrong.filter((line) => !line.startsWith("a request")), []);
  await alone.close();
  assert.deepEqual(wrong, []);
  await close();
});

test("what a file contains does nothing in the report, which reaches neither the laboratory nor what it keeps", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#data`);
  await page.evaluate(() => localStorage.setItem("theme", "dark"));
  await fitted(page, 't,"<img src=x onerror=top.document.title=1>"');
  const report = await opened(page);
  assert.equal(await report.locator("img").count(), 0);
  const reached = await report.locator("html").evaluate(() => {
    const tried = [() => parent.document.title, () => top.location.href, () => localStorage.length, () => document.cookie];
    return tried.filter((look) => {
      try {
        look();
        return true;
      } catch {
        return false;
      }
    }).length;
  });
  assert.equal(reached, 0);
  assert.equal(await report.locator("html").evaluate(() => fetch(document.baseURI).then(() => "an answer", () => "none")), "none");
  assert.equal(wrong.filter((line) => !/Content Security Policy/.test(line)).length, 0, String(wrong));
  await close();
});

test("the report is shown without a network", async () => {
  const { page, close } = await open(own, `${server.url}#data`);
  await page.evaluate(() => navigator.serviceWorker.ready);
  await page.waitForFunction(async () => (await (await caches.open("lagrangian-laboratory")).keys()).some((key) => key.url.endsWith("/report.html")));
  await page.context().setOffline(true);
  await page.reload();
  await fitted(page);
  await (await opened(page)).locator(".card").first().waitFor();
  await close();
});

for (const colorScheme of ["light", "dark"]) {
  test(`the report has the theme of the laboratory and no barrier that axe finds, in ${colorScheme}`, async () => {
    const { page, close } = await open(own, `${server.url}#data`, { colorScheme, bypassCSP: true, viewport: { width: 390, height: 800 } });
    await fitted(page);
    const report = await opened(page);
    assert.equal(await report.locator("html").getAttribute("data-theme"), colorScheme);
    assert.ok((await report.locator("html").evaluate((root) => root.scrollWidth)) <= 390);
    assert.deepEqual(await violations(page), []);
    await close();
  });
}
