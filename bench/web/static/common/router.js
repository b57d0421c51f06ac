// Views of the page by their addresses: `#/bench`, `#/plan/METHOD`, `#/plan/METHOD/edit`, `#/runs?specimen=S`, `#/runs/ID`, `#/runs/ID/report`,
// `#/runs/ID/replay`, `#/specimens/SERIAL`, `#/campaigns/ID`, `#/calibration?check=CHANNEL`, `#/audit`, `#/compare?run=A&run=B`.

import { byId } from "./format.js";

/** Views of one thing, by the view of their list. */
const SINGLE = { runs: "run", specimens: "specimen" };
/** View of the navigation to which another view belongs. */
const PARENT = { run: "runs", compare: "runs", specimen: "specimens" };

/** Returns view, id, part and query of an address; an unknown view is the bench. */
export function parseAddress(hash) {
  const [path, search = ""] = hash.replace(/^#\/?/, "").split("?");
  const [first, id = "", part = ""] = path.split("/").map(decode);
  const name = (id && SINGLE[first]) || first;
  const view = byId(`view-${name}`) ? name : "bench";
  return { view, id, part, query: new URLSearchParams(search) };
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
