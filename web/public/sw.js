// Works offline once loaded: all files of the page are kept, and the network comes first where there is one.
const CACHE = "lagrangian-laboratory";

self.addEventListener("install", (event) => {
  self.skipWaiting();
  event.waitUntil(keep());
});
self.addEventListener("activate", (event) => event.waitUntil(self.clients.claim()));

async function keep() {
  const files = await (await fetch("./files.json")).json();
  const cache = await caches.open(CACHE);
  const old = await cache.keys();
  const wanted = files.map((file) => new URL(file, self.location).href);
  await Promise.all(old.filter((request) => !wanted.includes(request.url)).map((request) => cache.delete(request)));
  await cache.addAll(wanted);
}

self.addEventListener("fetch", (event) => {
  const url = new URL(event.request.url);
  if (event.request.method !== "GET" || url.origin !== self.location.origin) return;
  event.respondWith(fromNetwork(event.request));
});

async function fromNetwork(request) {
  const cache = await caches.open(CACHE);
  try {
    const response = await fetch(request);
    if (response.ok && (await cache.match(request))) await cache.put(request, response.clone());
    return response;
  } catch (error) {
    const kept = await cache.match(request, { ignoreSearch: true });
    if (kept) return kept;
    throw error;
  }
}
