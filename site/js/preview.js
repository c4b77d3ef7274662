// The preview's page script: loads the page again after a build, and shows what is wrong over the last good page.
// Served by `coursebuild serve` only; a published site does not have it.

const state = { version: null, overlay: null };

function reload() {
  // The browser keeps the scroll position of a page that is loaded again by itself.
  window.location.reload();
}

function clear() {
  state.overlay?.remove();
  state.overlay = null;
}

function show(text) {
  clear();
  const overlay = document.createElement("section");
  overlay.setAttribute("role", "alert");
  overlay.setAttribute("aria-label", "Problems");
  const pre = document.createElement("pre");
  pre.textContent = text;
  const close = document.createElement("button");
  close.type = "button";
  close.textContent = "Close";
  close.addEventListener("click", clear);
  // Set one by one: the page's policy allows no style attribute in its markup.
  Object.assign(overlay.style, {
    position: "fixed",
    inset: "auto 1rem 1rem",
    maxHeight: "60vh",
    overflow: "auto",
    zIndex: "1000",
    padding: "1rem",
    background: "#2b0f0f",
    color: "#fff",
    borderRadius: "6px",
    boxShadow: "0 4px 24px rgb(0 0 0 / 40%)",
  });
  Object.assign(pre.style, {
    margin: "0 0 .75rem",
    font: "13px/1.45 ui-monospace, monospace",
    whiteSpace: "pre-wrap",
    background: "none",
    color: "inherit",
  });
  overlay.append(pre, close);
  document.body.append(overlay);
  state.overlay = overlay;
}

const events = new EventSource("/.coursebuild/events");
events.addEventListener("hello", (event) => {
  // After a pause (a laptop that slept, a server that was started again) the page may be older than the site.
  if (state.version !== null && state.version !== event.data) reload();
  state.version = event.data;
});
events.addEventListener("reload", reload);
events.addEventListener("problems", (event) => show(JSON.parse(event.data)));
