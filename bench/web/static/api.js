// The service's REST interface: the token, calls that answer JSON, files, and errors in words.

const BASE = new URL("api/v1/", document.baseURI);
const KEPT_AS = "mrbench.token";
const PATIENCE_MS = 20_000;
const FILE_PATIENCE_MS = 600_000;

/** What the service refused or could not do, as it says itself; `message` is a sentence for a person. */
export class Problem extends Error {
  constructor(status, title, detail) {
    super(detail || title);
    this.status = status;
    this.title = title;
  }

  /** The whole in a sentence that says first what it prevented. */
  after(what) {
    return `${what}: ${this.message.replace(/\.$/, "")}.`;
  }

  get refused() {
    return this.status === 401;
  }
}

/** Moves a token from the address into this tab's storage, so that no bookmark and no screenshot keeps it. */
export function takeToken() {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  if (given) {
    keepToken(given);
    history.replaceState(null, "", location.pathname + location.search);
  }
  return token();
}

export const token = () => sessionStorage.getItem(KEPT_AS);
export const keepToken = (value) => sessionStorage.setItem(KEPT_AS, value);
export const forgetToken = () => sessionStorage.removeItem(KEPT_AS);

/** Address of the live websocket; a browser cannot send headers there, so the token stands in the query. */
export function liveAddress() {
  const address = new URL("live", BASE);
  address.protocol = address.protocol.replace("http", "ws");
  address.searchParams.set("token", token() ?? "");
  return address.href;
}

export const get = (path, patience) => call("GET", path, undefined, patience);
export const post = (path, body, patience) => call("POST", path, body, patience);

/** Fetches a file with the token in its header; a plain link could not carry one. */
export async function file(path) {
  const answer = await send("GET", path, undefined, FILE_PATIENCE_MS);
  const named = /filename="?([^";]+)"?/.exec(answer.headers.get("content-disposition") ?? "");
  return { blob: await answer.blob(), name: named?.[1] ?? path.replaceAll("/", "-") };
}

async function call(method, path, body, patience) {
  const answer = await send(method, path, body, patience);
  return answer.status === 204 ? null : answer.json();
}

async function send(method, path, body, patience = PATIENCE_MS) {
  const headers = { Authorization: `Bearer ${token() ?? ""}` };
  if (body !== undefined) headers["Content-Type"] = "application/json";
  let answer;
  try {
    answer = await fetch(new URL(path, BASE), {
      method, headers, body: body && JSON.stringify(body), signal: AbortSignal.timeout(patience),
    });
  } catch (error) {
    throw new Problem(0, "No answer", silence(error, patience));
  }
  if (!answer.ok) throw await problemOf(answer);
  return answer;
}

function silence(error, patience) {
  return error.name === "TimeoutError"
    ? `The service at ${BASE.host} took longer than ${patience / 1000} s.`
    : `The service at ${BASE.host} cannot be reached.`;
}

async function problemOf(answer) {
  const said = await answer.json().catch(() => ({}));
  const title = said.title ?? `${answer.status} ${answer.statusText}`;
  return new Problem(answer.status, title, typeof said.detail === "string" ? said.detail : "");
}
