// Lighthouse on the laboratory and the sample pages, on a desktop and a phone: `node audits.js FOLDER [PART-OF-ADDRESS]`, where FOLDER
// holds Lighthouse (`npm install --prefix FOLDER lighthouse`); prints scores and what is below 90, and ends with 1 where a score is below 95.

import { resolve } from "node:path";
import { pathToFileURL } from "node:url";

import { folder, launched } from "./browser.js";
import { serve } from "./lab/harness.mjs";

const LEAST = 95;
/** Runs of each, since other work on the machine counts as work of the page. */
const RUNS = 3;
const PORT = 9333;

const [place, part = ""] = process.argv.slice(2);
if (!place) throw new Error("name the folder that holds Lighthouse: npm install --prefix /tmp/audits lighthouse, then node audits.js /tmp/audits");
const modules = pathToFileURL(`${resolve(place)}/node_modules/lighthouse/core/index.js`);
const { default: lighthouse, desktopConfig } = await import(modules);

const [lab, pages] = [await serve(), await serve(folder)];
const addresses = ["", "#learn", "#data", "#lesson", "theory.html"].map((view) => `${lab.url}${view}`);
addresses.push(...["known.html", "large.html"].map((name) => `${pages.url}${name}`));

/** What Lighthouse says of an address, in a browser of its own. */
async function audited(address, screen) {
  const browser = await launched({ args: [`--remote-debugging-port=${PORT}`] });
  const flags = { port: PORT, onlyCategories: ["performance", "accessibility", "best-practices"], logLevel: "error" };
  const { lhr } = await lighthouse(address, flags, screen === "desktop" ? desktopConfig : undefined);
  await browser.close();
  return lhr;
}

/** Prints the run with the middle performance of several; returns whether all its scores are high enough. */
async function judged(address, screen) {
  const runs = [];
  for (let k = 0; k < RUNS; k++) runs.push(await audited(address, screen));
  const { categories, audits } = runs.sort((a, b) => a.categories.performance.score - b.categories.performance.score)[Math.floor(RUNS / 2)];
  const scores = Object.values(categories).map(({ id, score }) => [id, Math.round(100 * score)]);
  console.log(screen.padEnd(8), address, ...scores.map(([id, score]) => `${id} ${score}`));
  for (const { auditRefs } of Object.values(categories)) {
    for (const { id, weight } of auditRefs) {
      const { score, displayValue = "" } = audits[id];
      if (weight > 0 && score !== null && score < 0.9) console.log("        ", id, score, displayValue);
    }
  }
  return scores.every(([, score]) => score >= LEAST);
}

let fine = true;
for (const address of addresses.filter((own) => own.includes(part))) {
  for (const screen of ["desktop", "phone"]) fine = (await judged(address, screen)) && fine;
}
lab.close();
pages.close();
process.exit(fine ? 0 : 1);
