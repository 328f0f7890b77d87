// The server, as the page sees it: every call bears the token, every error is a sentence.

import { framesOf, json as parsed } from "./frames.js";

/** @typedef {{code: string, what: string, where?: string, allowed?: string, todo?: string}} Fault */

/** What carries requests: HTTP, or on the page without a server the worker that answers them. */
export const wire = { ask: (/** @type {string} */ path, /** @type {RequestInit} */ init) => fetch(path, init) };

export class ServerError extends Error {
  /** @param {number} status @param {Fault} fault */
  constructor(status, fault) {
    const allowed = fault.allowed ? ` (allowed: ${fault.allowed})` : "";
    const where = fault.where ? `${fault.where}: ` : "";
    super(`${where}${fault.what}${allowed}${fault.todo ? `; ${fault.todo}` : ""}`);
    this.status = status;
    this.fault = fault;
  }
}

/** The server does not answer: it was stopped, or another one has its port. */
export class Gone extends Error {}

export class Api {
  /** @param {string} token */
  constructor(token) {
    this.token = token;
    /** Called when the server stops answering, and when it is back. @type {(gone: boolean) => void} */
    this.onGone = () => {};
    /** Called when an answer waits for code that is compiled for the first time, and when none does any more. @type {(on: boolean) => void} */
    this.onCompiling = () => {};
    /** Answers that do. */
    this._compiling = 0;
    /** When the server answered last: milliseconds of the page. */
    this.heard = 0;
  }

  /**
   * @param {string} path
   * @param {{json?: unknown, bytes?: Uint8Array, signal?: AbortSignal, method?: string}} [body] none: a GET
   * @returns {Promise<Response>}
   */
  async call(path, body) {
    /** @type {Record<string, string>} */
    const headers = { "X-Lampyris-Token": this.token };
    /** @type {RequestInit} */
    const init = { method: body?.method, headers, cache: "no-store", credentials: "omit", redirect: "error", signal: body?.signal };
    if (body && (body.json !== undefined || body.bytes)) {
      init.method = "POST";
      headers["Content-Type"] = body.bytes ? "application/octet-stream" : "application/json";
      init.body = body.bytes ? /** @type {any} */ (body.bytes) : JSON.stringify(body.json);
    }
    let answer;
    try {
      answer = await wire.ask(path, init);
    } catch (error) {
      if (body?.signal?.aborted) throw error;
      this.onGone(true);
      throw new Gone("the server does not answer");
    }
    this.heard = performance.now();
    // Another server has this one's port: for who holds the old token, theirs is gone.
    this.onGone(answer.status === 401);
    if (answer.ok) return answer;
    let fault = { code: "HTTP", what: `the server says ${answer.status}` };
    try {
      fault = (await answer.json()).error ?? fault;
    } catch {
      // Not one of ours: its number has to do.
    }
    throw new ServerError(answer.status, fault);
  }

  /** @param {string} path @param {unknown} [json] @returns {Promise<any>} */
  async json(path, json) {
    return (await this.call(path, json === undefined ? undefined : { json })).json();
  }

  /** @param {string} path @returns {Promise<Uint8Array>} */
  async bytes(path) {
    return new Uint8Array(await (await this.call(path)).arrayBuffer());
  }

  /**
   * The frames of an answer as they come.
   * @param {string} path @param {unknown} json @param {AbortSignal} [signal]
   */
  async *frames(path, json, signal) {
    const answer = await this.call(path, { json, signal });
    if (!answer.body) throw new Gone("an answer without a body");
    let compiling = false;
    const now = (/** @type {boolean} */ on) => {
      if (on === compiling) return;
      compiling = on;
      this._compiling += on ? 1 : -1;
      this.onCompiling(this._compiling > 0);
    };
    try {
      for await (const frame of framesOf(answer.body)) {
        now(frame.kind === "P" && parsed(frame.bytes).what === "compiling");
        yield frame;
      }
    } catch (error) {
      if (signal?.aborted) throw error;
      this.onGone(true);
      throw new Gone("the server stopped in the middle of its answer");
    } finally {
      now(false);
    }
  }
}
