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
