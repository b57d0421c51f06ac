// Rights of the signed-in person. A control without its right is disabled, and its description says which right is missing.

import { byId, element } from "./format.js";
import { signedIn } from "./session.js";

/** Roles; each has the rights of those before it. */
export const ROLES = ["viewer", "technician", "engineer", "administrator"];
/** What each right permits, and the first role that has it. */
export const RIGHTS = {
  view: ["read everything", "viewer"],
  stop: ["stop and abort", "viewer"],
  operate: ["operate the bench", "technician"],
  analyse: ["request computations", "technician"],
  reset_trip: ["reset after a trip", "engineer"],
  manage_methods: ["store methods", "engineer"],
  approve_methods: ["approve methods", "engineer"],
  change_limits: ["change limits and calibration", "engineer"],
  manage_runs: ["trash, restore and repair runs", "engineer"],
  sign_reports: ["sign reports", "technician"],
  administer: ["manage people and tokens of others", "administrator"],
};

/** Roles that have a right. */
export const rolesWith = (right) => ROLES.slice(ROLES.indexOf(RIGHTS[right][1]));

/** True if the signed-in person has a right; the service decides before anybody is signed in. */
export const has = (right) => signedIn()?.person.rights.includes(right) ?? true;

/** Sentences about a missing right: which one, and who has it. */
export function explain(right) {
  const roles = rolesWith(right);
  const who = roles.length > 1 ? `The roles ${roles.slice(0, -1).join(", ")} and ${roles.at(-1)} have it.` : `The role ${roles[0]} has it.`;
  return `You lack the right to ${RIGHTS[right][0]} (${right}). ${who}`;
}

/** Declares which rights a control needs, one or several; returns the control. */
export function need(rights, control) {
  control.dataset.right = rights;
  mark(control);
  return control;
}

/** Enables or disables a control. It stays in reach of the keyboard, so that its description can be read. */
function mark(control) {
  const missing = control.dataset.right.split(" ").find((right) => !has(right));
  const others = (control.getAttribute("aria-describedby") ?? "").split(" ").filter((id) => id && !id.startsWith("right-"));
  const described = missing ? [...others, `right-${missing}`] : others;
  if (missing) control.setAttribute("aria-disabled", "true");
  else control.removeAttribute("aria-disabled");
  if (described.length) control.setAttribute("aria-describedby", described.join(" "));
  else control.removeAttribute("aria-describedby");
  control.dataset.title ??= control.title;
  control.title = missing ? explain(missing) : control.dataset.title;
}

/** Follows the signed-in person. `onRefused` receives the reason when somebody uses a control without its right. */
export function watchRights(onRefused) {
  const reasons = Object.keys(RIGHTS).map((right) => element("p", { id: `right-${right}` }, explain(right)));
  document.body.append(element("div", { hidden: true }, ...reasons));
  document.addEventListener("session", () => document.querySelectorAll("[data-right]").forEach(mark));
  document.addEventListener("click", (event) => {
    const control = event.target.closest?.("[data-right][aria-disabled=true]");
    if (!control) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    onRefused(byId(control.getAttribute("aria-describedby").split(" ").at(-1)).textContent);
  }, { capture: true });
}
