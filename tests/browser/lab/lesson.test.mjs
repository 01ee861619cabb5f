// The lesson: five steps, each with something that can be tried.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { browser, open, serve } from "./harness.mjs";

let server, own;
before(async () => ([server, own] = [await serve(), await browser()]));
after(async () => {
  await own.close();
  server.close();
});

test("the action of a bent path is above that of the true one, on either side", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#lesson`);
  const above = async (bend) => {
    await page.getByLabel("How far your path is bent").fill(String(bend));
    await page.waitForTimeout(300);
    const text = await page.getByText("Action of your path").textContent();
    return Number(/, ([\d.e−]+) J s above/.exec(text)[1].replace("−", "-"));
  };
  await page.getByText("Action of your path").waitFor();
  assert.ok((await above(0.4)) > 0.1);
  assert.ok((await above(-0.4)) > 0.1);
  assert.ok((await above(0)) < 1e-6);
  assert.deepEqual(wrong, []);
  await close();
});

test("five steps follow each other, and the third one learns", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#lesson`);
  const titles = ["Least action", "Euler–Lagrange", "Learn L", "Energy is kept", "When it fails"];
  for (const [k, title] of titles.entries()) {
    await page.getByRole("heading", { name: `${k + 1}. ${title}` }).waitFor();
    if (title === "Learn L") {
      await page.getByRole("button", { name: "Learn", exact: true }).click();
      await page.locator('[data-side="lagrangian"]').waitFor({ timeout: 60_000 });
    }
    if (k < 4) await page.getByRole("button", { name: "Next" }).click();
  }
  await page.getByRole("link", { name: /Friction/ }).click();
  await page.waitForFunction(() => location.hash.startsWith("#learn"));
  assert.ok(await page.getByLabel("What if there is friction?").isChecked());
  assert.deepEqual(wrong, []);
  await close();
});

test("each step leads to its section of the theory, which is there without a network too", async () => {
  const { page, wrong, close } = await open(own, `${server.url}#lesson`);
  await page.evaluate(() => navigator.serviceWorker.ready);
  await page.waitForFunction(async () => (await (await caches.open("lagrangian-laboratory")).keys()).some((key) => key.url.endsWith("/theory.html")));
  await page.context().setOffline(true);
  const read = [];
  for (const step of [1, 2, 4, 5]) {
    await page.goto(`${server.url}#lesson?step=${step}`);
    await page.reload();
    await page.getByText("In the theory").getByRole("link").click();
    const section = page.locator(":target");
    await section.waitFor();
    read.push(await section.textContent());
  }
  assert.deepEqual(read, ["1 The action", "2 The equation of motion", "4 Energy and power", "11 Dissipation"]);
  // The Euler–Lagrange equation is (2), and whoever mentions it leads there.
  await page.locator('p a[href="#eq-2"]').first().click();
  assert.match(await page.locator("pre", { has: page.locator(":target") }).textContent(), /d\/dt ∂L\/∂q̇ − ∂L\/∂q = τ/);
  const dead = await page.locator('a[href^="#"]').evaluateAll((links) => links.map((link) => link.hash).filter((hash) => !document.getElementById(hash.slice(1))));
  assert.deepEqual(dead, []);
  assert.deepEqual(wrong.filter((line) => !line.includes("ERR_INTERNET_DISCONNECTED")), []);
  await close();
});
