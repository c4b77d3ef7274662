/** Sees service workers off that a published site left at this address: the preview is not to be shown from what they kept. */

export async function dismissWorkers(navigator) {
  const there = (await navigator.serviceWorker?.getRegistrations()) ?? []
  const scripts = (registration) => [registration.active, registration.waiting, registration.installing].filter(Boolean)
  const ours = (registration) => scripts(registration).some(({ scriptURL }) => new URL(scriptURL).pathname.endsWith('/service-worker.js'))
  await Promise.all(there.filter(ours).map((registration) => registration.unregister()))
}
