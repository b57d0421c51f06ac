// List of the benches with their states, shown if there are several. Each is a link to the present view of that bench.

import { get } from "../common/api.js";
import { showBench, shownBench } from "../common/bench.js";
import { byId, element, write } from "../common/format.js";
import { addressOf, parseAddress } from "../common/router.js";

const PERIOD_MS = 2_000;
const NOT_FOUND = 404;

export class BenchList {
  /** Takes a function that receives a sentence if the benches cannot be listed, or the address names none of them. */
  constructor({ onProblem }) {
    this.onProblem = onProblem;
    this.entries = new Map();
    addEventListener("hashchange", () => this.link());
  }

  /** Chooses the bench of the address, else the first one; without effect on a service with one bench. */
  async begin() {
    const items = await this.request();
    if (items.length < 2) return;
    const { bench } = parseAddress(location.hash);
    const known = items.some(({ name }) => name === bench);
    if (bench && !known) this.onProblem(`There is no bench ${bench}; ${items[0].name} is shown.`);
    showBench(known ? bench : items[0].name);
    write(byId("bench-name"), shownBench());
    byId("stop").setAttribute("aria-label", `Stop ${shownBench()}`);
    byId("search-bench").hidden = false;
    byId("known-benches").replaceChildren(...items.map(({ name }) => element("option", { value: name })));
    this.make(items);
    clearInterval(this.timer);
    this.timer = setInterval(() => this.load(), PERIOD_MS);
  }

  async request() {
    try {
      return (await get("benches")).items;
    } catch (problem) {
      if (problem.status === NOT_FOUND) return []; // a service of an older version has one bench
      throw problem;
    }
  }

  /** Shows the present states; each entry stays, so that the focus does not move. */
  async load() {
    if (document.hidden) return;
    try {
      for (const item of await this.request()) this.show(item);
    } catch {
      for (const name of this.entries.keys()) this.show({ name, state: "unknown", description: "the service does not answer" });
    }
  }

  make(items) {
    const rows = items.map(({ name }) => {
      const shape = document.createElementNS("http://www.w3.org/2000/svg", "use");
      const icon = document.createElementNS("http://www.w3.org/2000/svg", "svg");
      icon.setAttribute("class", "shape");
      icon.setAttribute("aria-hidden", "true");
      icon.append(shape);
      const words = element("span", { className: "soft" });
      const link = element("a", {}, icon, element("strong", {}, name), " ", words);
      if (name === shownBench()) link.setAttribute("aria-current", "true");
      this.entries.set(name, { link, words, shape });
      return element("li", {}, link);
    });
    byId("benches").replaceChildren(...rows);
    byId("benches").hidden = false;
    for (const item of items) this.show(item);
    this.link();
  }

  show({ name, state, description }) {
    const entry = this.entries.get(name);
    if (!entry) return;
    write(entry.words, description);
    entry.link.dataset.state = state;
    entry.shape.setAttribute("href", `#shape-${state}`);
  }

  /** Lets each entry lead to the present view. */
  link() {
    for (const [name, { link }] of this.entries) link.href = addressOf(name, location.hash);
  }
}
