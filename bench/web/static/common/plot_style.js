// Common style of all plots: colours of the style sheet, axes, and what a plot without a pointer shows.

/** Whether the dark scheme is chosen. */
export const DARK = matchMedia("(prefers-color-scheme: dark)");
const colours = new Map(); // kept, because reading a style many times in each frame is slow
DARK.addEventListener("change", () => colours.clear());

/** Value of a colour of the style sheet in the present scheme. */
export function colour(name) {
  if (!colours.has(name)) colours.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  return colours.get(name);
}

const FONT = "11px system-ui, 'Segoe UI', Roboto, sans-serif";

export function axis(more) {
  return {
    stroke: () => colour("--soft"), font: FONT, labelFont: FONT, gap: 4,
    grid: { stroke: () => colour("--line"), width: 1 }, ticks: { show: false }, ...more,
  };
}

export const signed = (u, splits) => splits.map((value) => String(value).replace("-", "−"));
export const QUIET = { cursor: { show: false }, legend: { show: false }, select: { show: false } };
