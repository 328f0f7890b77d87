// Bounds: what each rule alone would allow at a moment of a run, beside the speed that was driven.

/**
 * What each rule allows at some ticks, put into the run; null where it says nothing.
 * @param {Uint8Array} bytes @param {Run} run
 */
export function addCaps(bytes, run) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const first = view.getUint32(0, true);
  const n = view.getUint16(4, true);
  const rules = view.getUint16(6, true);
  let at = 8;
  const names = [];
  for (let k = 0; k < rules; k++) {
    const letters = bytes[at];
    names.push(new TextDecoder().decode(bytes.subarray(at + 1, at + 1 + letters)));
    at += 1 + letters;
  }
  if (bytes.length !== at + 4 * n * rules) throw new Error(`bounds of ${n} ticks in ${bytes.length} bytes`);
  for (const cause of names) {
    let cap = run.caps.find((one) => one.cause === cause);
    if (!cap) run.caps.push((cap = { cause, v: [] }));
    while (cap.v.length < first) cap.v.push(null);
    for (let k = 0; k < n; k++, at += 4) {
      const v = view.getFloat32(at, true);
      cap.v.push(Number.isNaN(v) ? null : v);
    }
  }
}

/** As long as a chart needs them: a rule that said nothing lately has no entries yet. @param {Run} run @param {number} n */
export function capsOf(run, n) {
  for (const { v } of run.caps) while (v.length < n) v.push(null);
  return run.caps.map(({ cause, v }) => ({ cause, v: v.length === n ? v : v.slice(0, n) }));
}

/**
 * Why this speed at a tick, in words: what binds it, and what the other rules allow, the tightest first.
 * @param {Run} run @param {number} k @param {(v: number) => string} brief
 */
export function whyOf(run, k, brief) {
  const word = run.causes[run.cause[k]] ?? "";
  const some = run.caps.flatMap(({ cause, v }) => (cause !== word && typeof v[k] === "number" ? [{ cause, v: /** @type {number} */ (v[k]) }] : []));
  if (!some.length) return word;
  const listed = some.sort((a, b) => a.v - b.v).map(({ cause, v }) => `${cause} ≤ ${brief(v)}`).join(", ");
  return `${word}; ${listed}`;
}

/**
 * On a chart of free distances: less than a cell, a near miss; and none at all. That is no contact: bodies are at least
 * as large as their cells, so that it is 0 between cells side by side. In a drive it is contact.
 * @param {any} u the chart @param {number} cell @param {boolean} dark @param {string} none what 0 is called
 */
export function closeness(u, cell, dark, none) {
  const ratio = window.devicePixelRatio || 1;
  const pen = /** @type {CanvasRenderingContext2D} */ (u.ctx);
  const { left, top, width } = u.bbox;
  const miss = Math.max(u.valToPos(cell, "y", true), top);
  const touch = u.valToPos(0, "y", true);
  pen.save();
  pen.fillStyle = dark ? "rgb(255 156 146 / 16%)" : "rgb(179 38 30 / 10%)";
  pen.fillRect(left, miss, width, touch - miss);
  pen.fillStyle = dark ? "#ff9c92" : "#b3261e";
  pen.fillRect(left, touch - ratio, width, 2 * ratio);
  pen.font = `${10 * ratio}px system-ui, sans-serif`;
  pen.textAlign = "right";
  if (touch - miss > 12 * ratio) pen.fillText("near miss", left + width - 4 * ratio, miss + 10 * ratio);
  pen.fillText(none, left + width - 4 * ratio, touch + 10 * ratio);
  pen.restore();
}
