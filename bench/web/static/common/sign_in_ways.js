// Sign-in by the provider of the organisation (OpenID Connect): its button, and sentences on its failures.

import { get } from "./api.js";
import { element } from "./format.js";

const START = new URL("api/v1/session/oidc", document.baseURI);
const AGAIN = "Try again, or sign in with a password.";
/** Sentence for each failure; the address names only its kind, so that nobody can put words of their own on the page. */
const PROBLEMS = {
  "provider-unreachable": `The sign-in provider does not answer. ${AGAIN}`,
  "provider-unusable": `The sign-in provider gave an unusable answer. ${AGAIN} An administrator finds the reason in the service's log.`,
  refused: `The sign-in provider refused, or the sign-in was cancelled there. ${AGAIN}`,
  "state-unknown": "This sign-in had ended or took longer than 10 minutes, or began in another browser. Begin it again here.",
  "code-refused": `The sign-in provider did not confirm the sign-in. ${AGAIN} An administrator finds the reason in the service's log.`,
  "token-invalid": `The sign-in provider's confirmation is not valid. ${AGAIN} An administrator finds the reason in the service's log.`,
  "name-unusable": "Your name at the sign-in provider cannot be a user name here. Ask an administrator of this bench.",
  "name-taken": "Another user of this bench already has your name. Ask an administrator of this bench.",
  "role-missing": "None of your groups may use this bench. Ask an administrator of this bench for access.",
  disabled: "Your user is disabled on this bench. Ask an administrator of this bench.",
};

/**
 * Adds the button of the provider to a container, if the service offers one; returns whether it does.
 *
 * Without an answer there is no button; the other ways to sign in report that the service cannot be reached.
 */
export async function addSignInWays(container) {
  const ways = await get("session/ways").catch(() => null);
  if (!ways?.oidc) return false;
  const link = element("a", { className: "button", href: makeAddress() }, `Sign in with ${ways.oidc.name}`);
  link.addEventListener("click", () => (link.href = makeAddress())); // the view may have changed since
  container.replaceChildren(link);
  return true;
}

/** Returns the sentence on a sign-in that has failed, or an empty text; the address becomes that of the view before. */
export function takeSignInProblem() {
  const given = new URLSearchParams(location.hash.slice(1));
  if (!given.has("problem")) return "";
  history.replaceState(null, "", `${location.pathname}${location.search}#${given.get("view") ?? "/"}`);
  return PROBLEMS[given.get("problem")] ?? `The sign-in failed. ${AGAIN}`;
}

/** Address that leads to the provider, and back to the present view. */
function makeAddress() {
  const view = location.hash.slice(1);
  START.search = new URLSearchParams(view.startsWith("/") ? { view } : {});
  return START.href;
}
