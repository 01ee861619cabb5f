// Stored pictures of pages, and whether a page still looks like its own (ADR 0112).

import assert from "node:assert/strict";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname } from "node:path";
import { fileURLToPath } from "node:url";
import { PNG } from "pngjs";

import { frame, launched, scrolledThrough } from "./browser.js";

export const WIDTHS = [390, 768, 1280];
export const THEMES = ["light", "dark"];

/** Pixels on a side of a block, whose mean colour is stored. */
const BLOCK = 4;
/** Colours are stored in steps of this size, of 256. */
const STEP = 8;
/** How far a colour may lie outside of those around the same block in the other picture. */
const TOLERANCE = 14;
/** Blocks on a side of a square, and how many of its 64 may differ. */
const SQUARE = 8;
const MOST = 12;

const STORED = fileURLToPath(new URL("./pictures/", import.meta.url));
const FAILED = fileURLToPath(new URL("../../target/browser/pictures/", import.meta.url));
const STORING = process.env.LAGRANGIAN_STORE === "1";

/** Chromium with one font, that of the repository, without the subpixels of a screen. */
export const launchedForPictures = () =>
  launched({ args: ["--disable-lcd-text", "--font-render-hinting=none", "--force-color-profile=srgb"], env: { ...process.env, FONTCONFIG_FILE: `${STORED}fonts.conf` } });

/** Asserts that a page looks like the picture of this name; with `LAGRANGIAN_STORE=1` it stores the picture instead. */
export async function assertLooksAsStored(page, name) {
  await scrolledThrough(page);
  const shot = PNG.sync.read(await settled(page));
  const now = reduced(shot);
  const place = `${STORED}${name}.png`;
  if (STORING) return write(place, now);
  const stored = read(place);
  const marks = differences(stored, now);
  const worst = worstSquare(marks, now);
  if (worst.count <= MOST && sameSize(stored, now)) return;
  const files = { stored, now: shot, difference: marked(now, marks) };
  for (const [what, picture] of Object.entries(files)) write(`${FAILED}${name}-${what}.png`, picture);
  const size = sameSize(stored, now) ? "" : ` is ${now.width} × ${now.height} blocks instead of ${stored.width} × ${stored.height};`;
  const where = `around (${worst.x}, ${worst.y}) ${worst.count} of ${SQUARE * SQUARE} blocks differ, and ${MOST} may`;
  assert.fail(`${name}${size} ${where}. Look at ${FAILED}${name}-{stored,now,difference}.png; if the page is right, store it anew: tests/browser/README.md`);
}

/** The whole page, once it stays as it is. */
async function settled(page) {
  for (let before; ; ) {
    const shot = await page.screenshot({ fullPage: true, animations: "disabled", caret: "hide" });
    if (before?.equals(shot)) return shot;
    before = shot;
    await frame(page);
  }
}

/** The mean colours of the blocks of a picture, in steps. */
export function reduced({ width, height, data }) {
  const small = new PNG({ width: Math.ceil(width / BLOCK), height: Math.ceil(height / BLOCK) });
  for (let y = 0; y < small.height; y++) {
    for (let x = 0; x < small.width; x++) {
      const sum = [0, 0, 0];
      let count = 0;
      for (let v = y * BLOCK; v < Math.min(height, (y + 1) * BLOCK); v++) {
        for (let u = x * BLOCK; u < Math.min(width, (x + 1) * BLOCK); u++, count++) {
          for (let c = 0; c < 3; c++) sum[c] += data[4 * (v * width + u) + c];
        }
      }
      const at = 4 * (y * small.width + x);
      for (let c = 0; c < 3; c++) small.data[at + c] = Math.min(255, Math.round(sum[c] / count / STEP) * STEP);
      small.data[at + 3] = 255;
    }
  }
  return small;
}

/**
 * Which blocks differ, 1 for each: those whose colour is not among the colours around the same block in the other picture, seen from
 * either. So edges may move by a block, and nothing may be missing or added.
 */
export function differences(one, other) {
  const [width, height] = [Math.max(one.width, other.width), Math.max(one.height, other.height)];
  const marks = { width, height, data: new Uint8Array(width * height) };
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) marks.data[y * width + x] = Number(strange(one, other, x, y) || strange(other, one, x, y));
  }
  return marks;
}

/** Whether the block of a picture lies outside of the colours around it in another; one beyond its edge does. */
function strange(one, other, x, y) {
  if (x >= one.width || y >= one.height) return true;
  for (let c = 0; c < 3; c++) {
    let [low, high] = [255, 0];
    for (let v = Math.max(0, y - 1); v <= Math.min(other.height - 1, y + 1); v++) {
      for (let u = Math.max(0, x - 1); u <= Math.min(other.width - 1, x + 1); u++) {
        const value = other.data[4 * (v * other.width + u) + c];
        low = Math.min(low, value);
        high = Math.max(high, value);
      }
    }
    const value = one.data[4 * (y * one.width + x) + c];
    if (value < low - TOLERANCE || value > high + TOLERANCE) return true;
  }
  return false;
}

/** The square with the most blocks that differ, by its middle in pixels of the page. */
export function worstSquare({ width, height, data }) {
  let worst = { count: 0, x: 0, y: 0 };
  for (let y = 0; y < height; y += SQUARE / 2) {
    for (let x = 0; x < width; x += SQUARE / 2) {
      let count = 0;
      for (let v = y; v < Math.min(height, y + SQUARE); v++) {
        for (let u = x; u < Math.min(width, x + SQUARE); u++) count += data[v * width + u];
      }
      if (count > worst.count) worst = { count, x: (x + SQUARE / 2) * BLOCK, y: (y + SQUARE / 2) * BLOCK };
    }
  }
  return worst;
}

/** A pale copy of a picture with its marks in red. */
function marked(picture, marks) {
  const pale = new PNG({ width: marks.width, height: marks.height });
  for (let y = 0; y < marks.height; y++) {
    for (let x = 0; x < marks.width; x++) {
      const at = 4 * (y * marks.width + x), from = 4 * (y * picture.width + x);
      const known = x < picture.width && y < picture.height;
      const red = marks.data[y * marks.width + x] === 1;
      for (let c = 0; c < 3; c++) pale.data[at + c] = red ? [220, 20, 20][c] : known ? 128 + picture.data[from + c] / 2 : 255;
      pale.data[at + 3] = 255;
    }
  }
  return pale;
}

const sameSize = (one, other) => one.width === other.width && Math.abs(one.height - other.height) <= 1;

function read(place) {
  try {
    return PNG.sync.read(readFileSync(place));
  } catch (error) {
    throw new Error(`cannot read the stored picture ${place} (${error.message}): store it, tests/browser/README.md says how`);
  }
}

function write(place, picture) {
  mkdirSync(dirname(place), { recursive: true });
  writeFileSync(place, PNG.sync.write(picture, { colorType: 2, deflateLevel: 9 }));
}
