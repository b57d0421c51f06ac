// Health of the service in one strip: agent, worker, queue, disk, wires, clocks, log store, calibration. Each entry is a word, with the reason of a fault.
// The queue leads to its view.

import { get } from "../common/api.js";
import { byId, element, shortTime, spaced } from "../common/format.js";
import { keep, refresh } from "../common/refresh.js";

const PERIOD_MS = 5_000;
/** Error of a clock [s] above which it is marked; a sample lasts a millisecond. */
const CLOCK_ERROR_S = 1e-3;
/** Order of the entries, whichever of them arrives first. */
const ORDER = ["Service", "Agent", "Wires", "Clocks", "Worker", "Queue", "Campaigns", "Disk", "Log store", "Calibration"];
/** Views that show more of an entry. */
const VIEWS = { Queue: "#/jobs" };

export class HealthStrip {
  constructor() {
    this.entries = {};
  }

  /** Requests the health now and from then on. */
  open() {
    clearInterval(this.timer);
    this.timer = setInterval(() => this.request(), PERIOD_MS);
    this.request();
  }

  async request() {
    try {
      const { agent, worker, queue, disk, calibration, campaigns, log_store: store } = await get("health");
      this.show({
        Agent: entry(agent), Worker: entry(worker), Queue: { kind: "good", text: queue }, Disk: entry(disk),
        Calibration: calibration === "ok" ? { kind: "good", text: "nothing due" } : { kind: "fair", text: shorten(calibration) },
        Campaigns: campaigns === "ok" ? null : { kind: "fair", text: campaigns },
        "Log store": store === "not used" ? null : entry(store),
      });
    } catch (problem) {
      this.show({ Service: { kind: "bad", text: problem.message } });
    }
  }

  /** Shows the state of the clocks and wires in a status of the agent. */
  showStatus({ instruments }) {
    const absent = instruments.filter(({ connected }) => !connected).map(({ name }) => name);
    const bounds = instruments.map((one) => one.clock_error_bound_s).filter((bound) => bound !== null);
    const worst = Math.max(0, ...bounds);
    this.show({
      Wires: absent.length ? { kind: "bad", text: `${absent.join(", ")} not connected` } : { kind: "good", text: "ready" },
      Clocks: { kind: worst > CLOCK_ERROR_S ? "fair" : "good", text: bounds.length ? `within ${shortTime(worst)}` : "none" },
    });
  }

  show(entries) {
    this.entries = entries.Service ? entries : { ...this.entries, ...entries };
    if (entries.Agent) delete this.entries.Service;
    const shown = ORDER.filter((name) => this.entries[name]).map((name) => [name, this.entries[name]]);
    refresh(byId("health"), shown, () => shown.map(makeItem));
  }
}

function makeItem([name, { kind, text }]) {
  const content = [element("span", { className: `mark ${kind}` }, name), ` ${text}`];
  const address = VIEWS[name];
  return element("li", {}, ...(address ? [keep(element("a", { href: address }, ...content), name)] : content));
}

/** Channels and dates alone; the view of the certificates has the rest. */
const shorten = (calibration) => spaced(calibration.replaceAll(/: calibration | \(certificate [^;]*/g, (part) => (part.startsWith(":") ? " " : "")));
const entry = (state) => (state === "ok" ? { kind: "good", text: "ready" } : { kind: "bad", text: state });
