// Report of a run inside the page, so that it has an address that can be reloaded, kept and sent.

import { file } from "../common/api.js";
import { element } from "../common/format.js";

/**
 * Creates the frame of a report and its buttons.
 *
 * The report is fetched as text, so that it can be shown in a frame without scripts and saved.
 */
export async function makeReport(run) {
  const { blob, name } = await file(`runs/${encodeURIComponent(run.id)}/report`);
  const frame = makeReportFrame(await blob.text(), `Report of run ${run.id}`);
  const print = element("button", { type: "button" }, "Print …");
  print.addEventListener("click", () => frame.contentWindow.print());
  const save = element("a", { className: "button", href: URL.createObjectURL(blob), download: name }, "Save");
  return [element("p", { className: "actions" }, print, save), frame];
}

/** Creates the frame that shows the page of a report, without its scripts. */
export function makeReportFrame(html, title) {
  const frame = element("iframe", { className: "report", title, srcdoc: html });
  frame.setAttribute("sandbox", "allow-same-origin allow-modals");
  // As high as its content, so that there is only one scroll bar.
  frame.addEventListener("load", () => { frame.style.height = `${frame.contentDocument.documentElement.scrollHeight + 16}px`; });
  return frame;
}
