/** Unregisters service workers that a published site left at this address, so that they do not answer for the preview. */

export async function dismissWorkers(navigator) {
  const registrations = (await navigator.serviceWorker?.getRegistrations()) ?? []
  const scripts = (registration) => [registration.active, registration.waiting, registration.installing].filter(Boolean)
  const isSiteWorker = (registration) => scripts(registration).some(({ scriptURL }) => new URL(scriptURL).pathname.endsWith('/service-worker.js'))
  await Promise.all(registrations.filter(isSiteWorker).map((registration) => registration.unregister()))
}
