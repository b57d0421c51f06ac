// Client of the REST interface: JSON requests, files, and errors with their messages. The browser adds the cookie of the session.

import { element } from "./format.js";
import { parseBatch } from "../live/live_batch.js";
import { csrfHeader, setSession } from "./session.js";

const BASE = new URL("api/v1/", document.baseURI);
const SESSION = "session";
const READING = ["GET", "HEAD"];
const TIMEOUT_MS = 20_000;
const FILE_TIMEOUT_MS = 600_000;

/** Error of a request, with the detail that the service returned; `message` is a sentence for a person. */
export class Problem extends Error {
  constructor(status, title, detail, type = "", retryAfter = null) {
    super(detail || title);
    Object.assign(this, { status, title, type, retryAfter });
  }

  /** Returns a sentence that begins with the consequence. */
  after(consequence) {
    return `${consequence}: ${this.message.replace(/\.$/, "")}.`;
  }

  /** True if the service was started without a rig, which is no failure. */
  get hasNoRig() {
    return this.type === "urn:mrbench:problem:no-rig";
  }

  /** True if the browser has the cookie of a newer session than the page. */
  get hasOldSession() {
    return this.type === "urn:mrbench:problem:csrf";
  }

  get unauthorised() {
    return this.status === 401;
  }
}

/** Signs in with `{ name, password }`, `{ token }` or `{ code }`. */
export const signIn = async (credentials) => setSession(await call("POST", SESSION, credentials));

/** Asks the service who is signed in; the cookie survives a reload, the page's memory does not. */
export const readSession = async () => setSession(await call("GET", SESSION));

/** Ends the session. */
export const signOut = () => call("DELETE", SESSION);

/** Address of the live websocket. */
export function liveAddress() {
  const address = new URL("live", BASE);
  address.protocol = address.protocol.replace("http", "ws");
  return address.href;
}

export const get = (path, timeout) => call("GET", path, undefined, timeout);
export const post = (path, body, timeout) => call("POST", path, body, timeout);

/** Deletes something; what the service returns says what became of it. */
export const remove = (path) => call("DELETE", path);

/** Changes something; with an ETag refused, with status 412, if it was changed since that ETag was read. */
export const patch = (path, body, etag) => call("PATCH", path, body, undefined, etag ? { "If-Match": etag } : {});

/** Returns `{ data, etag }`; the ETag is for a later `patch`. */
export async function getTag(path) {
  const response = await send("GET", path);
  return { data: await readJson(response), etag: response.headers.get("etag") };
}

/** Fetches recorded samples in binary batches; see `parseBatch`. */
export async function samples(path) {
  const response = await send("GET", path, undefined, FILE_TIMEOUT_MS);
  const channels = JSON.parse(response.headers.get("x-mrbench-channels"));
  const content = await response.arrayBuffer();
  const batches = [];
  for (let offset = 0; offset < content.byteLength; offset += batches.at(-1).bytes) batches.push(parseBatch(content, channels, offset));
  return batches;
}

/** Makes a key for one request; `randomUUID` is missing on a page that was loaded without TLS from elsewhere. */
const makeKey = () => crypto.randomUUID?.() ?? `${Date.now()}-${Math.random()}`;

/** Sends a request that starts something: with a key, so that it is repeated safely if its answer is lost. */
export async function start(path, body, method = "POST") {
  const headers = { "Idempotency-Key": makeKey() };
  try {
    return await call(method, path, body, TIMEOUT_MS, headers);
  } catch (problem) {
    if (problem.status !== 0) throw problem;
    return call(method, path, body, TIMEOUT_MS, headers); // no answer: perhaps it was lost on its way
  }
}

/** Fetches a file. A plain link could not say why a file is refused. */
export async function file(path) {
  const response = await send("GET", path, undefined, FILE_TIMEOUT_MS);
  const match = /filename="?([^";]+)"?/.exec(response.headers.get("content-disposition") ?? "");
  return { blob: await response.blob(), name: match?.[1] ?? path.replaceAll("/", "-") };
}

/** Fetches a file and lets the browser save it, under a given name or that of the service; returns the name. */
export async function saveFile(path, wanted) {
  const { blob, name } = await file(path);
  const address = URL.createObjectURL(blob);
  element("a", { href: address, download: wanted ?? name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
  return wanted ?? name;
}

/** Sends a form with files; `onProgress` receives the sent share. A plain fetch reports no progress. */
export function upload(path, form, onProgress) {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open("POST", new URL(path, BASE));
    const headers = { ...csrfHeader(), "Idempotency-Key": makeKey() };
    for (const [name, value] of Object.entries(headers)) request.setRequestHeader(name, value);
    request.responseType = "json";
    request.upload.addEventListener("progress", ({ loaded, total }) => onProgress(total ? loaded / total : 0));
    request.addEventListener("error", () => reject(new Problem(0, "No answer", `The service at ${BASE.host} cannot be reached.`)));
    request.addEventListener("load", () => {
      if (request.status < 300) resolve(request.response);
      else reject(makeProblem(request.status, request.statusText, request.response ?? {}, { path }));
    });
    request.send(form);
  });
}

async function call(method, path, body, timeout = TIMEOUT_MS, headers) {
  const response = await send(method, path, body, timeout, headers);
  return response.status === 204 ? null : readJson(response, timeout);
}

/** Reads a body, which on a slow connection may end later than its headers. */
async function readJson(response, timeout = TIMEOUT_MS) {
  try {
    return await response.json();
  } catch (error) {
    throw new Problem(0, "No answer", describeFailure(error, timeout));
  }
}

/** Sends a request. Another tab may have signed in anew meanwhile: then once more, with the value of that session. */
async function send(...request) {
  try {
    return await attempt(...request);
  } catch (problem) {
    if (!problem.hasOldSession) throw problem;
    await readSession();
    return attempt(...request);
  }
}

async function attempt(method, path, body, timeout = TIMEOUT_MS, more = {}) {
  const headers = { ...(READING.includes(method) ? {} : csrfHeader()), ...more };
  if (body !== undefined) headers["Content-Type"] = "application/json";
  let response;
  try {
    response = await fetch(new URL(path, BASE), {
      method, headers, body: body && JSON.stringify(body), signal: AbortSignal.timeout(timeout),
    });
  } catch (error) {
    throw new Problem(0, "No answer", describeFailure(error, timeout));
  }
  if (!response.ok) throw await readProblem(response, path);
  return response;
}

function describeFailure(error, timeout) {
  return error.name === "TimeoutError"
    ? `The service at ${BASE.host} did not answer within ${timeout / 1000} s.`
    : `The service at ${BASE.host} cannot be reached.`;
}

async function readProblem(response, path) {
  const retryAfter = Number(response.headers.get("retry-after")) || null;
  return makeProblem(response.status, response.statusText, await response.json().catch(() => ({})), { path, retryAfter });
}

function makeProblem(status, phrase, { title, detail, type }, { path, retryAfter = null }) {
  if (status === 401 && path !== SESSION) {
    document.dispatchEvent(new Event("unauthorised")); // one place asks to sign in again
    return new Problem(401, "Not signed in", "The session has ended. Sign in again.");
  }
  return new Problem(status, title ?? `${status} ${phrase}`, typeof detail === "string" ? detail : "", type, retryAfter);
}
