window.seen = [];
window.addEventListener("error", (event) => window.seen.push(String(event.message)));
window.addEventListener("unhandledrejection", (event) => window.seen.push(String(event.reason)));
