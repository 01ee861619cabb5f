// Works offline once loaded: what was fetched is kept, the network comes first where there is one.
const CACHE = "lagrangian-laboratory";

self.addEventListener("install", () => self.skipWaiting());
self.addEventListener("activate", (event) => event.waitUntil(self.clients.claim()));

self.addEventListener("message", (event) => {
  // Files that were loaded before this worker was there.
  if (Array.isArray(event.data?.keep)) {
    const own = event.data.keep.filter((url) => new URL(url).origin === self.location.origin);
    event.waitUntil(caches.open(CACHE).then((cache) => cache.addAll(own)));
  }
});

self.addEventListener("fetch", (event) => {
  const url = new URL(event.request.url);
  if (event.request.method !== "GET" || url.origin !== self.location.origin) return;
  event.respondWith(fromNetwork(event.request));
});

async function fromNetwork(request) {
  const cache = await caches.open(CACHE);
  try {
    const response = await fetch(request);
    if (response.ok) await cache.put(request, response.clone());
    return response;
  } catch (error) {
    const kept = await cache.match(request, { ignoreSearch: true });
    if (kept) return kept;
    throw error;
  }
}
