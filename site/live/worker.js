// Worker: Python by Pyodide, which answers what the page asks. Nothing is fetched from outside this folder.

import { loadPyodide } from "./pyodide/pyodide.mjs";

/** Requests that are being answered; one that nobody waits for is taken out. @type {Set<number>} */
const running = new Set();

/** Let what was posted meanwhile be heard. */
const { port1, port2 } = new MessageChannel();
/** @type {Array<() => void>} */
const waiting = [];
port2.onmessage = () => waiting.shift()?.();
const turn = () => new Promise((go) => {
  waiting.push(/** @type {() => void} */ (go));
  port1.postMessage(0);
});

async function begin() {
  const began = performance.now();
  const home = new URL("pyodide/", import.meta.url).href;
  const packed = fetch(new URL("python.zip", import.meta.url)).then((answer) => answer.arrayBuffer());
  const python = await loadPyodide({ indexURL: home, env: { NUMBA_DISABLE_JIT: "1", HOME: "/home/pyodide" } });
  postMessage({ stage: "Unpacking NumPy and lampyris ..." });
  python.unpackArchive(await packed, "zip", { extractDir: "/live" });
  postMessage({ stage: "Importing lampyris ..." });
  python.runPython("import sys; sys.path[:0] = ['/live']");
  const engine = python.pyimport("live_engine");
  postMessage({ ready: { pyodide: python.version, seconds: (performance.now() - began) / 1000 } });
  return engine;
}

const engine = begin();
engine.catch((error) => postMessage({ failed: String(error?.message ?? error).slice(-2000) }));

onmessage = async ({ data }) => {
  if (data.cancel) {
    running.delete(data.cancel);
    return;
  }
  const { id, path, body } = data; // the body is text, or undefined
  running.add(id);
  const made = await engine;
  // A goal that is dragged asks faster than it is answered: what was given up meanwhile is not begun.
  await turn();
  if (!running.has(id)) return;
  const answer = made.ask(path, body);
  // The head travels with the first piece: each message wakes the page.
  /** @type {{status?: number, kind?: string}} */
  let head = { status: answer.status, kind: answer.kind };
  for (;;) {
    const proxy = running.has(id) ? answer.next() : undefined;
    if (!proxy) break;
    const piece = proxy.toJs();
    proxy.destroy();
    postMessage({ id, ...head, piece }, [piece.buffer]);
    head = {};
    await turn();
  }
  answer.destroy();
  running.delete(id);
  postMessage({ id, ...head, end: true });
};
