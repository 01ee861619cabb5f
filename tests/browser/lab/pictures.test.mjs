// The laboratory looks as it is stored, at three widths in both themes.

import { after, before, test } from "node:test";
import { assertLooksAsStored, launchedForPictures, THEMES, WIDTHS } from "../pictures.js";
import { open, serve } from "./harness.mjs";

let server, chromium;
before(async () => ([server, chromium] = [await serve(), await launchedForPictures()]));
after(async () => {
  await chromium.close();
  server.close();
});

/** A swing of one angle, 4 s at 50 Hz. */
const swing = ["t,q1", ...Array.from({ length: 200 }, (_, k) => `${(0.02 * k).toFixed(2)},${Math.cos(0.06 * k).toFixed(6)}`)].join("\n");

/** What is looked at: the name of the picture, the address, and what is done there first. */
const VIEWS = [
  ["play", "play?system=double-pendulum", (page) => page.locator(".figures dd").first().waitFor()],
  ["learn", "learn?system=double-pendulum", (page) => page.locator('[aria-label^="Energy along"][aria-label*="truth"]').waitFor()],
  ["data", "data", (page) => page.getByText("Nothing yet").waitFor()],
  ["inspected", "data", inspected],
  ["lesson", "lesson?step=1", (page) => page.getByText("Action of your path").waitFor()],
];

async function inspected(page) {
  await page.getByLabel("Choose a file").setInputFiles({ name: "swing.csv", mimeType: "text/csv", buffer: Buffer.from(swing) });
  await page.getByRole("button", { name: "Check the data" }).click();
  await page.getByRole("button", { name: "Fit", exact: true }).waitFor();
}

for (const [name, address, done] of VIEWS) {
  test(`${name} looks as stored`, async (own) => {
    const { page, close } = await open(chromium, `${server.url}#${address}`, { serviceWorkers: "block" });
    await done(page);
    await page.getByText("The library is ready.").waitFor();
    for (const width of WIDTHS) {
      for (const colorScheme of THEMES) {
        await page.setViewportSize({ width, height: 900 });
        await page.emulateMedia({ colorScheme });
        await own.test(`looks as stored at ${width} px, ${colorScheme}`, () => assertLooksAsStored(page, `lab/${name}-${width}-${colorScheme}`));
      }
    }
    await close();
  });
}
