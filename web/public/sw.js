// Works offline once loaded: all files of the page are kept, and the network comes first where there is one.
const CACHE = "lagrangian-laboratory";
/** The build of the library that the page runs: of the others nothing is kept. */
const LIBRARY = new URL(self.location).searchParams.get("library");

self.addEventListener("install", (event) => {
  self.skipWaiting();
  event.waitUntil(keep());
});
self.addEventListener("activate", (event) => event.waitUntil(self.clients.claim()));

/** Keeps the files of the newest build, of which those in assets/ never change under their names. */
async function keep() {
  const all = await (await fetch("./files.json", { cache: "no-cache" })).json();
  const files = all.filter((file) => !file.endsWith(".wasm") || file.includes(`/${LIBRARY}-`));
  const cache = await caches.open(CACHE);
  const old = await cache.keys();
  const wanted = files.map((file) => new URL(file, self.location).href);
  const missing = wanted.filter((url) => !url.includes("/assets/") || !old.some((request) => request.url === url));
  await cache.addAll(missing);
  await Promise.all(old.filter((request) => !wanted.includes(request.url)).map((request) => cache.delete(request)));
}

self.addEventListener("fetch", (event) => {
  const url = new URL(event.request.url);
  if (event.request.method !== "GET" || url.origin !== self.location.origin) return;
  event.respondWith(fromNetwork(event.request));
  // A page that was built again since: its files, too. Without a network there is nothing to do.
  if (event.request.mode === "navigate") event.waitUntil(keep().catch(() => undefined));
});

async function fromNetwork(request) {
  try {
    return await fetch(request);
  } catch (error) {
    const cache = await caches.open(CACHE);
    const kept = await cache.match(request, { ignoreSearch: true });
    if (kept) return kept;
    throw error;
  }
}
