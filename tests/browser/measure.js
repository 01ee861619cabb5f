// How long frames take while the page of ten plots is scrolled, and what it weighs: `node measure.js [PAGE]`.

import { statSync } from "node:fs";

import { folder, launched, opened } from "./browser.js";

const browser = await launched();
const { page } = await opened(browser, process.argv[2] ?? "large.html");
await page.waitForTimeout(1000);
const load = await page.evaluate(() => performance.getEntriesByType("navigation")[0].loadEventEnd);
console.log(`size ${(statSync(`${folder}/${process.argv[2] ?? "large.html"}`).size / 1e6).toFixed(2)} MB, loaded after ${load.toFixed(0)} ms`);

// Scrolls to the end, so many px a frame (12 are 720 px a second), and returns the times between frames.
const scrolled = (step) => page.evaluate(async (step) => {
  const times = [], last = document.documentElement.scrollHeight - innerHeight;
  scrollTo(0, 0);
  let before = await new Promise(requestAnimationFrame);
  for (let y = 0; y < last; y += step) {
    scrollTo(0, y);
    const now = await new Promise(requestAnimationFrame);
    times.push(now - before);
    before = now;
  }
  return times.sort((a, b) => a - b);
}, step);

for (const [pass, step] of [["first, while plots are painted", 12], ["again", 12], ["again, faster", 40]]) {
  const times = await scrolled(step), quantile = (part) => times[Math.floor(part * (times.length - 1))].toFixed(1);
  const rate = (1000 * times.length) / times.reduce((sum, time) => sum + time, 0);
  console.log(`${pass}: ${times.length} frames, ${rate.toFixed(1)} a second; median ${quantile(0.5)} ms, 95 % ${quantile(0.95)} ms, longest ${quantile(1)} ms`);
}

// The time that the page's own code takes to follow the pointer.
const cost = await page.evaluate(() => {
  const over = document.querySelector(".u-over"), edge = over.getBoundingClientRect();
  const moves = 200, start = performance.now();
  for (let k = 0; k < moves; k++) over.dispatchEvent(new MouseEvent("mousemove", { clientX: edge.left + 60 + k, clientY: edge.top + 100 }));
  return (performance.now() - start) / moves;
});
console.log(`a move of the pointer over the linked plots: ${cost.toFixed(2)} ms`);
await browser.close();
