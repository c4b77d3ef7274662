/**
 * The preview's replacement of a site's service worker, which unregisters itself at once.
 *
 * A published site may have been served from this address before; its worker would still answer.
 */

const worker = /** @type {any} */ (self)

worker.addEventListener('install', () => worker.skipWaiting())

worker.addEventListener('activate', (event) => event.waitUntil(leave()))

async function leave() {
  const { scope } = worker.registration
  await worker.registration.unregister()
  const names = (await worker.caches.keys()).filter((name) => name.startsWith('coursebuild ') && name.endsWith(` ${scope}`))
  await Promise.all(names.map((name) => worker.caches.delete(name)))
}
