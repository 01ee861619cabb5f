// The figures of docs/performance.md, in Chromium: node lab/figures.mjs [SECONDS].

import { browser, open, serve } from "./harness.mjs";

const [seconds = "20"] = process.argv.slice(2);
const [server, own] = [await serve(), await browser()];
const { page, close } = await open(own, `${server.url}#lesson?step=5`);

const figures = await page.evaluate(async (budget) => {
  const files = await (await fetch("./files.json")).json();
  const file = (part) => files.find((name) => name.includes(part));
  const module = await WebAssembly.compileStreaming(fetch(file("relaxed")));
  const worker = new Worker(file("worker"), { type: "module" });
  worker.postMessage({ module });
  let id = 0;
  const ask = (request) =>
    new Promise((done, failed) => {
      const own = id++;
      worker.addEventListener("message", function hear({ data }) {
        if (data.id !== own) return;
        worker.removeEventListener("message", hear);
        if (data.error) failed(new Error(data.error));
        else done(data.value);
      });
      worker.postMessage({ id: own, request });
    });
  const of = { name: "double-pendulum" };
  await ask({ ask: "states", of, samples: 100_000, seed: 0 });
  await ask({ ask: "start", fit: { family: "lnn", seconds: budget } });
  let advanced;
  do advanced = await ask({ ask: "advance", milliseconds: 250 });
  while (!advanced.done);
  const energy = await ask({ ask: "energy", of, starts: 40, duration: 100, reference: 29.4, seed: 1 });
  return { steps: advanced.losses.at(-1).step, loss: advanced.best, energy, speed: await ask({ ask: "speed" }) };
}, Number(seconds));

/** Milliseconds until a motion is shown, on a processor that is four times slower. */
async function interactive() {
  const context = await own.newContext({ serviceWorkers: "block" });
  const fresh = await context.newPage();
  const session = await context.newCDPSession(fresh);
  await session.send("Emulation.setCPUThrottlingRate", { rate: 4 });
  const begun = performance.now();
  await fresh.goto(server.url);
  await fresh.locator(".figures dd").first().waitFor();
  return Math.round(performance.now() - begun);
}

figures.interactive_ms = await interactive();
const { mean, median, worst, unfinished } = figures.energy;
console.log(JSON.stringify({ ...figures, energy: { mean, median, worst, unfinished } }, null, 2));
await close();
await own.close();
server.close();
