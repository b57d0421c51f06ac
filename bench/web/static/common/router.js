// Views of the page by their addresses: `#/bench`, `#/plan/METHOD`, `#/plan/METHOD/edit`, `#/runs?specimen=S`, `#/runs/ID`, `#/runs/ID/report`,
// `#/runs/ID/replay`, `#/batches/ID`, `#/jobs`, `#/specimens/SERIAL`, `#/campaigns/ID`, `#/calibration?check=CHANNEL`, `#/audit`,
// `#/compare?run=A&run=B`.
// With several benches, each begins with the name of one: `#/@left/bench`.

import { shownBench } from "./bench.js";
import { byId } from "./format.js";

/** Views of one thing, by the view of their list. */
const SINGLE = { runs: "run", specimens: "specimen" };
/** View of the navigation to which another view belongs. */
const PARENT = { run: "runs", compare: "runs", jobs: "runs", batches: "runs", specimen: "specimens" };

/** Returns bench, view, id, part and query of an address; an unknown view is the bench. */
export function parseAddress(hash) {
  const [path, search = ""] = hash.replace(/^#\/?/, "").split("?");
  const parts = path.split("/").map(decode);
  const bench = parts[0].startsWith("@") ? parts.shift().slice(1) : "";
  const [first = "", id = "", part = ""] = parts;
  const name = (id && SINGLE[first]) || first;
  const view = byId(`view-${name}`) ? name : "bench";
  return { bench, view, id, part, query: new URLSearchParams(search) };
}

/** Address of the same view for a bench. */
export const addressOf = (bench, hash) => `#/@${encodeURIComponent(bench)}/${hash.replace(/^#?\/?(@[^/?]*\/?)?/, "") || "bench"}`;

/** Lets the address name the shown bench. Returns false if it names another, for which the page is loaded again. */
function followBench({ bench }) {
  if (!shownBench() || bench === shownBench()) return true;
  if (!bench) history.replaceState(null, "", addressOf(shownBench(), location.hash));
  else location.reload(); // no value of the former bench can remain in view
  return !bench;
}

function decode(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text; // a mistyped address is shown as it is
  }
}

/** Address of a run, or of one of its parts. */
export const runAddress = (id, part = "") => `#/runs/${encodeURIComponent(id)}${part && `/${part}`}`;

/** Address of a batch. */
export const batchAddress = (id) => `#/batches/${encodeURIComponent(id)}`;

/** Address of a specimen. */
export const specimenAddress = (serial) => `#/specimens/${encodeURIComponent(serial)}`;

/** Shows the view of the address, and follows its changes. */
export class Router {
  /** Takes the functions that show a view with its address, by name. */
  constructor(views) {
    this.views = views;
    addEventListener("hashchange", () => this.go(true));
  }

  /** Shows the present address; after a change by the person, the focus moves to the title of the view. */
  go(moved = false) {
    const address = parseAddress(location.hash);
    if (!followBench(address)) return;
    for (const section of document.querySelectorAll(".view")) section.hidden = section.id !== `view-${address.view}`;
    for (const link of document.querySelectorAll(".views a")) {
      const isHere = (PARENT[address.view] ?? address.view) === link.dataset.view;
      if (isHere) link.setAttribute("aria-current", "page");
      else link.removeAttribute("aria-current");
    }
    const title = byId(`view-${address.view}`).querySelector("h1");
    document.body.dataset.title = title.textContent;
    if (moved) {
      scrollTo(0, 0);
      title.focus({ preventScroll: true });
    }
    this.views[address.view]?.(address);
  }
}
