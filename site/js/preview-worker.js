/**
 * The preview's replacement of a site's service worker, which unregisters itself at once.
 *
 * A published site may have been served from this address before; its worker would still answer.
 */

self.addEventListener('install', () => self.skipWaiting())

self.addEventListener('activate', (event) => event.waitUntil(leave()))

async function leave() {
  const { scope } = self.registration
  await self.registration.unregister()
  const names = (await self.caches.keys()).filter((name) => name.startsWith('coursebuild ') && name.endsWith(` ${scope}`))
  await Promise.all(names.map((name) => self.caches.delete(name)))
}
