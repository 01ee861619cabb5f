// Pictures of every view at three widths in both themes: node lab/shots.mjs FOLDER.

import { mkdir } from "node:fs/promises";
import { browser, open, serve } from "./harness.mjs";

const [folder = "shots"] = process.argv.slice(2);
await mkdir(folder, { recursive: true });
const [server, own] = [await serve(), await browser()];
const views = ["play?system=double-pendulum", "play?system=kepler", "learn", "data", "lesson?step=1", "lesson?step=4"];
for (const colorScheme of ["light", "dark"]) {
  for (const width of [390, 768, 1280]) {
    for (const view of views) {
      const { page, wrong, close } = await open(own, `${server.url}#${view}`, { viewport: { width, height: 900 }, colorScheme });
      await page.waitForTimeout(700);
      if (view === "data") {
        await page.getByRole("button", { name: /example/ }).click();
        await page.getByRole("button", { name: "Check the data" }).click();
        await page.waitForTimeout(1500);
      }
      await page.screenshot({ path: `${folder}/${view.replace(/[?=]/g, "-")}-${width}-${colorScheme}.png`, fullPage: true });
      wrong.forEach((line) => console.error(view, width, colorScheme, line));
      await close();
    }
  }
}
await own.close();
server.close();
