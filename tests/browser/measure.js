// How long frames take while the page of ten plots is scrolled, and what it weighs: `node measure.js`.

import { statSync } from "node:fs";

import { folder, launched, opened } from "./browser.js";

const browser = await launched();
const { page } = await opened(browser, "large.html");
await page.waitForTimeout(1000);

// Scrolls as fast as a hand, 30 px a frame, down and up, and notes the time between frames.
const times = await page.evaluate(async () => {
  const times = [], last = document.documentElement.scrollHeight - innerHeight;
  let before = await new Promise(requestAnimationFrame);
  for (let y = 0; y < 2 * last; y += 30) {
    scrollTo(0, y < last ? y : 2 * last - y);
    const now = await new Promise(requestAnimationFrame);
    times.push(now - before);
    before = now;
  }
  return times.sort((a, b) => a - b);
});
const quantile = (part) => times[Math.floor(part * (times.length - 1))].toFixed(1);
const rate = (1000 * times.length) / times.reduce((sum, time) => sum + time, 0);

const load = await page.evaluate(() => performance.getEntriesByType("navigation")[0].loadEventEnd);
console.log(`size ${(statSync(`${folder}/large.html`).size / 1e6).toFixed(2)} MB, loaded after ${load.toFixed(0)} ms`);
console.log(`${times.length} frames of scrolling: ${rate.toFixed(1)} a second; median ${quantile(0.5)} ms, 99 % ${quantile(0.99)} ms, longest ${quantile(1)} ms`);
await browser.close();
