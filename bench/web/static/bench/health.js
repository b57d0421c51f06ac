// Health of the service in one strip: agent, worker, queue, disk, wires, clocks, log store, calibration. Each entry is a word, with the reason of a fault.
// The queue leads to its view.

import { get } from "../common/api.js";
import { byId, element, shortTime, spaced } from "../common/format.js";
import { keep, refresh } from "../common/refresh.js";

/** The service answers from values that it keeps for a second or until they change, so asking often costs little. */
const PERIOD_MS = 1_000;
/** Longest wait for an answer, so that the entries of a service that does not answer do not stay. */
const TIMEOUT_MS = 3_000;
const NOT_KNOWN = { kind: "plain", text: "not known" };
/** Error of a clock [s] above which it is marked; a sample lasts a millisecond. */
const CLOCK_ERROR_S = 1e-3;
/** Order of the entries, whichever of them arrives first. */
const ORDER = ["Service", "Agent", "Wires", "Clocks", "Worker", "Queue", "Campaigns", "Disk", "Log store", "Calibration"];
/** Views that show more of an entry. */
const VIEWS = { Queue: "#/jobs" };

export class HealthStrip {
  constructor() {
    this.entries = {};
    this.requesting = false;
    this.hasStatus = false;
  }

  /** Requests the health now and from then on. */
  open() {
    clearInterval(this.timer);
    this.timer = setInterval(() => this.request(), PERIOD_MS);
    this.request();
  }

  async request() {
    if (this.requesting) return;
    this.requesting = true;
    try {
      const { agent, worker, queue, disk, calibration, campaigns, log_store: store } = await get("health", TIMEOUT_MS);
      this.show({
        Service: null,
        Agent: agent === "ok" && !this.hasStatus ? NOT_KNOWN : entry(agent), // its last status may be true no more
        Worker: entry(worker), Queue: { kind: "good", text: queue }, Disk: entry(disk),
        Calibration: calibration === "ok" ? { kind: "good", text: "nothing due" } : { kind: "fair", text: shorten(calibration) },
        Campaigns: campaigns === "ok" ? null : { kind: "fair", text: campaigns },
        "Log store": store === "not used" ? null : entry(store),
      });
    } catch (problem) {
      const { Wires, Clocks } = this.entries; // they come with a status; of the rest nothing is known
      this.entries = { Wires, Clocks };
      this.show({ Service: { kind: "bad", text: problem.message } });
    } finally {
      this.requesting = false;
    }
  }

  /** Shows the state of the clocks and wires in a status of the agent. */
  showStatus({ instruments }) {
    this.hasStatus = true;
    const bounds = instruments.map((one) => one.clock_error_bound_s).filter((bound) => bound !== null);
    const worst = Math.max(0, ...bounds);
    this.show({
      Wires: describeWires(instruments),
      Clocks: { kind: worst > CLOCK_ERROR_S ? "fair" : "good", text: bounds.length ? `within ${shortTime(worst)}` : "none" },
    });
  }

  /** Shows that no status arrives: agent, wires and clocks are not known until the next one. */
  forget() {
    this.hasStatus = false;
    this.show({ Wires: NOT_KNOWN, Clocks: NOT_KNOWN, ...(this.entries.Agent && { Agent: NOT_KNOWN }) });
    if (this.timer) this.request(); // its answer says why
  }

  /** Shows changed entries; null removes one. */
  show(entries) {
    this.entries = { ...this.entries, ...entries };
    const shown = ORDER.filter((name) => this.entries[name]).map((name) => [name, this.entries[name]]);
    refresh(byId("health"), shown, () => shown.map(makeItem));
  }
}

function makeItem([name, { kind, text }]) {
  const content = [element("span", { className: `mark ${kind}` }, name), ` ${text}`];
  const address = VIEWS[name];
  return element("li", {}, ...(address ? [keep(element("a", { href: address }, ...content), name)] : content));
}

/** Instruments that are not connected; else those with a fault, such as silence on an open line. Their table says which. */
function describeWires(instruments) {
  const absent = instruments.filter(({ connected }) => !connected).map(({ name }) => name);
  if (absent.length) return { kind: "bad", text: `${absent.join(", ")} not connected` };
  const faulty = instruments.filter(({ message }) => message).map(({ name }) => name);
  return faulty.length ? { kind: "fair", text: `fault of ${faulty.join(", ")}` } : { kind: "good", text: "ready" };
}

/** Channels and dates alone; the view of the certificates has the rest. */
const shorten = (calibration) => spaced(calibration.replaceAll(/: calibration | \(certificate [^;]*/g, (part) => (part.startsWith(":") ? " " : "")));
const entry = (state) => (state === "ok" ? { kind: "good", text: "ready" } : { kind: "bad", text: state });
