// Who is signed in. The session itself is in a cookie that no script can read; this module has what the page shows of it.

const OPERATOR = "mrbench.operator";

let session = null;

/** Session of the service, with `person`, `kind`, `csrf` and `expires`; null before signing in. */
export const signedIn = () => session;

/** Takes over a session, and tells all parts of the page. */
export function setSession(value) {
  session = value;
  document.dispatchEvent(new Event("session"));
}

/** Header that shows the service that a request comes from this page. */
export const csrfHeader = () => (session?.csrf ? { "X-CSRF-Token": session.csrf } : {});

/** Full name under which the service records what this person does; empty with a token, which several may use. */
export const recordedName = () => (session?.kind === "user" ? session.person.full_name : "");

/** Name for a field of the operator: the signed-in person, or with a token the name that was used last. */
export const operatorName = () => recordedName() || (localStorage.getItem(OPERATOR) ?? "");

/** Keeps the name of an operator in this browser, if no person is signed in. */
export function keepOperatorName(name) {
  if (!recordedName()) localStorage.setItem(OPERATOR, name);
}

/** Fills fields with the operator's name now, and for each person who signs in; `fixed` ones cannot be edited then. */
export function followOperator(field, { fixed = false } = {}) {
  let filled = null;
  const fill = () => {
    const name = operatorName();
    if (name !== filled) field.value = filled = name;
    field.readOnly = fixed && recordedName() !== "";
  };
  fill();
  document.addEventListener("session", fill);
}
