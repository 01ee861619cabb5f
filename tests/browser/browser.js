// A real browser for the tests: the distribution's Chromium, a page in it, and what must never happen there.

import { createHash } from "node:crypto";
import { existsSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const places = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
const executablePath = places.find((place) => place && existsSync(place));
const axe = createRequire(import.meta.url).resolve("axe-core/axe.min.js");

/** The folder of the pages that `cargo xtask browser` makes. */
export const folder = resolve(process.env.LAGRANGIAN_PAGES ?? new URL("../../target/browser/pages", import.meta.url).pathname);

/** Starts Chromium; the sandbox is left where the system allows none (as root, in containers). */
export async function launched({ args = [], ...options } = {}) {
  if (!executablePath) throw new Error("there is no Chromium: install it (apt-get install chromium) or set CHROMIUM to its path");
  const open = process.getuid?.() === 0 ? ["--no-sandbox"] : [];
  return chromium.launch({ executablePath, args: [...args, ...open], ...options });
}

/**
 * Opens a page of the folder. `faults` collects errors of the console and requests to anywhere but the file itself.
 */
export async function opened(browser, name, { width = 1280, theme = "light", touch = false } = {}) {
  const context = await browser.newContext({ viewport: { width, height: 900 }, colorScheme: theme, hasTouch: touch, isMobile: touch, reducedMotion: "reduce" });
  const page = await context.newPage();
  const address = pathToFileURL(`${folder}/${name}`).href, faults = [];
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && faults.push(message.text()));
  page.on("pageerror", (error) => faults.push(error.message));
  page.on("request", (request) => request.url() !== address && !/^(data|blob):/.test(request.url()) && faults.push(`request to ${request.url()}`));
  await page.goto(address);
  return { page, faults, close: () => context.close() };
}

/** What axe finds wrong: the rule and the elements. */
export async function violations(page) {
  await page.evaluate(readFileSync(axe, "utf8"));
  const { violations } = await page.evaluate(() => globalThis.axe.run(document, { resultTypes: ["violations"] }));
  return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target.join(" ")).join(", ")}`);
}

/** The plot of a figure by the name of the figure, and what is around it. */
export function plotOf(page, id) {
  const figure = page.locator(`#figure-${id}, #map-${id}`).first();
  const box = figure.locator(".plot");
  return {
    figure,
    box,
    readout: figure.locator(".readout"),
    /** The text of the values, without spaces beside each other. */
    async values() {
      await page.waitForFunction((box) => !box.querySelector(".readout").hidden, await box.elementHandle());
      return (await figure.locator(".readout > div").allInnerTexts()).map((line) => line.replace(/\s+/g, " ").trim());
    },
    /** Brings it into sight, and waits until it is painted. */
    async seen() {
      await box.scrollIntoViewIfNeeded();
      await page.waitForFunction((box) => box.querySelector(".mount canvas"), await box.elementHandle());
      await frame(page);
      return box.boundingBox();
    },
    /** A hash of the picture in its canvas, to tell whether something was painted. */
    picture: async () => {
      await frame(page);
      const data = await figure.locator(".mount canvas").evaluate((canvas) => canvas.toDataURL());
      return createHash("sha256").update(data).digest("hex");
    },
  };
}

/** Waits until what was asked for is painted. */
export const frame = (page) => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

/** Scrolls to the end and back, and waits at each step until the plots in sight are painted, one a frame. */
export async function scrolledThrough(page) {
  const tall = await page.evaluate(() => document.documentElement.scrollHeight);
  for (let y = 0; y < tall; y += 600) {
    await page.evaluate((y) => scrollTo(0, y), y);
    await frame(page);
    await page.waitForFunction(() => [...document.querySelectorAll("[data-plot] .plot")].every((box) => {
      const { top, bottom, height } = box.getBoundingClientRect();
      return height === 0 || bottom < 0 || top > innerHeight || box.querySelector(".mount canvas");
    }));
  }
  await page.evaluate(() => scrollTo(0, 0));
  await frame(page);
}

/** Fingers on the screen, as the browser's own protocol sends them. */
export async function fingers(page) {
  const session = await page.context().newCDPSession(page);
  return (type, ...spots) => session.send("Input.dispatchTouchEvent", { type, touchPoints: spots.map(([x, y], id) => ({ x, y, id })) });
}
