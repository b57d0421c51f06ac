// Tables of text and lists of facts, in the form that all views share.

import { element } from "./format.js";

/** Table of rows that are elements; each head is a text or an element. A wide one scrolls in itself. */
export function rowTable(label, heads, rows, { caption = null, className = "scroll" } = {}) {
  const head = heads.map((one) => (one instanceof Element ? one : element("th", { scope: "col" }, one)));
  return element("div", { className, tabIndex: 0, role: "group", "aria-label": label },
    element("table", {}, caption, element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...rows)));
}

/** Table with a caption; the first cell of each row is its head. Cells are texts, elements, or lists of them. */
export function table(caption, heads, rows) {
  const row = ([first, ...others]) => element("tr", {},
    element("th", { scope: "row" }, ...[first].flat()), ...others.map((content) => element("td", { className: "number" }, ...[content].flat())));
  const className = rows.length > 16 ? "scroll tall" : "scroll";
  return rowTable(caption, heads, rows.map(row), { caption: element("caption", {}, caption), className });
}

/** List of names with their contents: texts, elements, or lists of them. */
export function factList(rows) {
  return element("dl", { className: "facts" }, ...Object.entries(rows).map(([name, content]) =>
    element("div", {}, element("dt", {}, name), element("dd", {}, ...[content].flat()))));
}

/** Section that a person opens and closes; `whenOpened` is called each time that it is opened. */
export function foldedSection(title, { open = false, whenOpened = () => {} } = {}) {
  const body = element("div", { className: "folded" });
  const details = element("details", { open }, element("summary", {}, element("h2", {}, title)), body);
  details.addEventListener("toggle", () => details.open && whenOpened());
  return { section: element("section", { "aria-label": title }, details), body };
}
