/**
 * What the preview has in the place of a site's service worker: one that goes at once.
 *
 * A published site may have been served from the same address before, and its worker would still answer for it.
 */

self.addEventListener('install', () => self.skipWaiting())

self.addEventListener('activate', (event) => event.waitUntil(leave()))

async function leave() {
  const { scope } = self.registration
  await self.registration.unregister()
  const own = (await self.caches.keys()).filter((name) => name.startsWith('coursebuild ') && name.endsWith(` ${scope}`))
  await Promise.all(own.map((name) => self.caches.delete(name)))
}
