// Tables of text and lists of facts, in the form that all views share.

import { element } from "./format.js";

/** Table with a caption; the first cell of each row is its head. A long one scrolls in itself. */
export function table(caption, heads, rows) {
  const row = ([first, ...others]) => element("tr", {},
    element("th", { scope: "row" }, first), ...others.map((content) => element("td", { className: "number" }, content)));
  const className = rows.length > 16 ? "scroll tall" : "scroll";
  return element("div", { className, tabIndex: 0, role: "group", "aria-label": caption },
    element("table", {},
      element("caption", {}, caption),
      element("thead", {}, element("tr", {}, ...heads.map((text) => element("th", { scope: "col" }, text)))),
      element("tbody", {}, ...rows.map(row))));
}

/** List of names with their contents; each content is a list of texts and elements. */
export function factList(rows) {
  return element("dl", { className: "facts" }, ...Object.entries(rows).map(([name, content]) =>
    element("div", {}, element("dt", {}, name), element("dd", {}, ...content))));
}

/** Section that a person opens and closes; `whenOpened` is called each time that it is opened. */
export function foldedSection(title, { open = false, whenOpened = () => {} } = {}) {
  const body = element("div", { className: "folded" });
  const details = element("details", { open }, element("summary", {}, element("h2", {}, title)), body);
  details.addEventListener("toggle", () => details.open && whenOpened());
  return { section: element("section", { "aria-label": title }, details), body };
}
