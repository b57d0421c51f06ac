// Bench that the page shows, and how requests name it. A service with one bench needs no name.

let shown = "";

/** Name of the shown bench; empty if the service has one bench. */
export const shownBench = () => shown;

/** Chooses the bench, before anything is requested of it. Another one needs the page to be loaded again. */
export function showBench(name) {
  shown = name;
}

/** Path of the shown bench, or of one of its parts, such as `/stop`. */
export const benchPath = (part = "") => (shown ? `benches/${encodeURIComponent(shown)}${part}` : `bench${part}`);

/** Adds the bench to the body of a request. */
export const withBench = (body) => (shown ? { ...body, bench: shown } : body);

/** Adds the bench to the query of a path that has none. */
export const benchQuery = (path) => (shown ? `${path}${path.includes("?") ? "&" : "?"}${new URLSearchParams({ bench: shown })}` : path);
