// Repeated display of the same part: what has not changed stays, and the focus stays on its control.

const shown = new WeakMap();

/** Replaces the content of a node by that of `make` if the facts that it shows have changed. */
export function refresh(node, facts, make) {
  const text = JSON.stringify(facts);
  if (shown.get(node) === text) return;
  shown.set(node, text);
  const focused = node.contains(document.activeElement) ? document.activeElement.dataset.key : "";
  node.replaceChildren(...make());
  if (focused) node.querySelector(`[data-key="${CSS.escape(focused)}"]`)?.focus();
}

/** Creates a button with a key by which it keeps the focus. */
export function keep(control, key) {
  control.dataset.key = key;
  return control;
}
