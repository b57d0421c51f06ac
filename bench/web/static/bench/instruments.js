// Table of the instruments and their wires, and warnings of the agent.

import { byId, element, fixed, shortTime, write } from "../common/format.js";

const rows = new Map();
/** Columns whose values are true at the time of a status only; the others are counts. */
const [AGE_COLUMN, CLOCK_COLUMN] = [2, 7];

/** Updates the table; rows keep their places, and only changed cells are written. */
export function showInstruments(instruments) {
  const body = byId("instruments");
  const names = new Set(instruments.map((instrument) => instrument.name));
  for (const [name, row] of rows) {
    if (!names.has(name)) {
      row.remove();
      rows.delete(name);
    }
  }
  for (const instrument of instruments) {
    if (!rows.has(instrument.name)) {
      rows.set(instrument.name, emptyRow());
      body.append(rows.get(instrument.name));
    }
    fill(rows.get(instrument.name), instrument);
  }
}

/** Shows that nothing is known about the instruments at present. */
export function forgetInstruments() {
  for (const row of rows.values()) {
    const [mark, message] = row.children[1].children;
    mark.className = "mark";
    write(mark, "no data");
    write(message, "");
    for (const place of [AGE_COLUMN, CLOCK_COLUMN]) write(row.children[place], "–");
  }
}

function emptyRow() {
  const name = element("th", { scope: "row" }, element("span"), element("small"));
  const connection = element("td", {}, element("span", { className: "mark" }), element("small"));
  const numbers = Array.from({ length: 6 }, () => element("td", { className: "number right" }));
  return element("tr", {}, name, connection, ...numbers);
}

function fill(row, instrument) {
  const [name, connection, ...numbers] = row.children;
  write(name.firstChild, instrument.name);
  write(name.lastChild, `${instrument.driver}, ${instrument.address}`);
  const isFaultless = instrument.connected && !instrument.message;
  connection.firstChild.className = `mark ${isFaultless ? "good" : instrument.connected ? "fair" : "bad"}`;
  write(connection.firstChild, instrument.connected ? "connected" : "not connected");
  write(connection.lastChild, instrument.message);
  const { age_s, received, lost, corrupted, resynchronised, clock_error_bound_s: bound } = instrument;
  const clockError = bound === null ? "no clock" : `± ${shortTime(bound)}`;
  const texts = [shortTime(age_s), count(received), count(lost), count(corrupted), count(resynchronised), clockError];
  texts.forEach((text, k) => write(numbers[k], text));
  [lost, corrupted, resynchronised].forEach((number, k) => numbers[k + 2].classList.toggle("attention", number > 0));
}

/** Formats a count with thin spaces between thousands. */
const count = (number) => fixed(number, 0).replace(/\B(?=(\d{3})+$)/g, "\u202f");

/** Shows the present warnings of the agent. */
export function showWarnings(warnings) {
  const list = byId("warnings");
  if (list.dataset.shown === JSON.stringify(warnings)) return;
  list.dataset.shown = JSON.stringify(warnings);
  list.replaceChildren(...warnings.map((text) => element("li", {}, text)));
}

/** Shows that the present warnings are not known; before the first status the list stays empty. */
export function forgetWarnings() {
  const list = byId("warnings");
  if (!list.dataset.shown) return;
  delete list.dataset.shown;
  list.replaceChildren(element("li", {}, "No data: the warnings are not known."));
}
