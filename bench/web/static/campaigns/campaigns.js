// Campaigns at their addresses: the list with a start, and one campaign with its board, which follows it.

import { get } from "../common/api.js";
import { shownBench } from "../common/bench.js";
import { CampaignActions } from "./campaign_actions.js";
import { CampaignBoard } from "./campaign_board.js";
import { isAsking } from "../account/sign_in.js";
import { CampaignStart } from "./campaign_start.js";
import { campaignAddress, markStatus } from "./campaign_words.js";
import { byId, clock, element, localTime, write, zone } from "../common/format.js";
import { keep, refresh } from "../common/refresh.js";
import { ReportSignatures } from "../runs/signatures.js";

const PERIOD_MS = 2_000;
const PAGE = 20;

export class CampaignView {
  constructor() {
    this.id = "";
    this.older = [];
    this.board = new CampaignBoard();
    this.actions = new CampaignActions({ onChanged: (campaign) => this.showOne(campaign) });
    this.starter = new CampaignStart({ onStarted: ({ id }) => this.open(id) });
    byId("campaigns-older").addEventListener("click", () => this.loadOlder());
    setInterval(() => this.follow(), PERIOD_MS);
  }

  /** Shows the campaign of an address; without one the list. */
  show({ id }) {
    this.id = id;
    this.older = [];
    byId("campaign-overview").hidden = id !== "";
    byId("campaign").hidden = true;
    this.setTitle(id ? "Campaign" : "Campaigns");
    write(byId("campaign-note"), "Loading …");
    byId("campaign-signatures").replaceChildren(...(id ? [new ReportSignatures(`campaigns/${encodeURIComponent(id)}`, `campaign ${id}`).section] : []));
    if (id && id === this.begun) byId("stop").focus(); // the next key can stop what was started here
    return this.load();
  }

  /** Opens a campaign that was started here. */
  open(id) {
    this.begun = id;
    location.hash = campaignAddress(id);
  }

  /** Requests the present state while the view is visible, and one request at a time. */
  follow() {
    if (!byId("view-campaigns").hidden && !document.hidden && !this.loading && !isAsking()) this.load();
  }

  async load() {
    const { id } = this;
    this.loading = true;
    try {
      const found = await get(id ? `campaigns/${encodeURIComponent(id)}` : `campaigns?limit=${PAGE}`);
      if (id !== this.id) return; // another address was opened meanwhile
      this.seen = new Date();
      write(byId("campaign-note"), "");
      if (id) this.showOne(found);
      else this.showList(found);
    } catch (problem) {
      if (id === this.id) write(byId("campaign-note"), this.describe(problem));
    } finally {
      this.loading = false;
    }
  }

  /** Names the age of what is still shown. */
  describe(problem) {
    const isShown = this.seen && !byId("campaign").hidden;
    return isShown ? problem.after(`Shown as of ${clock(this.seen)} ${zone(this.seen)}`) : problem.after("Campaigns cannot be shown");
  }

  setTitle(title) {
    write(byId("view-campaigns").querySelector("h1"), title);
    document.body.dataset.title = title;
  }

  showOne(campaign) {
    if (campaign.id !== this.id) return;
    this.setTitle(`Campaign ${campaign.name}`);
    byId("campaign").hidden = false;
    this.board.show(campaign);
    this.actions.show(campaign);
  }

  async loadOlder() {
    try {
      const { items, next } = await get(`campaigns?limit=${PAGE}&before=${encodeURIComponent(this.next)}`);
      this.older.push(...items);
      this.next = next;
      this.load();
    } catch (problem) {
      write(byId("campaign-note"), problem.after("Older campaigns cannot be listed"));
    }
  }

  showList({ items, next }) {
    if (!this.older.length) this.next = next;
    const all = [...items, ...this.older.filter(({ id }) => !items.some((one) => one.id === id))];
    byId("campaigns-older").hidden = !this.next;
    write(byId("campaigns-zone"), `(${zone()})`);
    write(byId("campaigns-empty"), all.length ? "" : "No campaigns yet.");
    refresh(byId("campaigns"), all, () => all.map(makeRow));
  }
}

function makeRow(campaign) {
  const { id, name, bench, created, steps, done, reason, needs_person: isAsking } = campaign;
  const link = keep(element("a", { href: campaignAddress(id) }, name), id);
  const asks = isAsking ? element("small", { className: "attention" }, "A person is needed.") : null;
  return element("tr", {},
    element("th", { scope: "row" }, link, element("small", {}, bench === "agent" ? (shownBench() ? "bench" : "on this bench") : bench)),
    element("td", { className: "number" }, localTime(created)),
    element("td", {}, markStatus(campaign), element("small", {}, reason), asks),
    element("td", { className: "number" }, `${done} of ${steps} done`));
}
