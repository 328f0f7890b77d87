// A scenario as text, for drafts, and as a part of an address. Long lists of painted cells are written as runs within
// rows, `{"rows": [down, on, n, down, on, n, ...]}`: so many rows down from the run before, so many columns on from its
// end (in another row: from the left), n cells. Lists, as in scenario files, are read as well.

/** Cells up to which a list is shorter, or as good. */
const FEW = 32;
/** Cells of the largest map: more in one list are no drawing. */
const MOST = 1 << 22;
const WIDE = 1 << 16;

/** Cells as they are written: a short list, or runs. @param {Cell[]} cells */
export function packed(cells) {
  if (cells.length <= FEW) return cells;
  const keys = Float64Array.from(cells, ([x, y]) => y * WIDE + x).sort();
  /** @type {number[]} */
  const rows = [];
  let [row, end] = [0, 0];
  for (const key of keys) {
    const [y, x] = [Math.floor(key / WIDE), key % WIDE];
    if (rows.length && y === row && x === end) rows[rows.length - 1]++;
    else if (y !== row || x > end || !rows.length) rows.push(y - row, x - (y === row ? end : 0), 1);
    else continue;
    [row, end] = [y, x + 1];
  }
  return { rows };
}

/** A list of cells, however it is written; what is neither is empty. @param {any} made @returns {Cell[]} */
export function cellsOf(made) {
  if (Array.isArray(made)) return made;
  /** @type {Cell[]} */
  const cells = [];
  const rows = Array.isArray(made?.rows) ? made.rows : [];
  let [y, end] = [0, 0];
  for (let k = 0; k + 2 < rows.length; k += 3) {
    const [down, on, n] = rows.slice(k, k + 3);
    if (![down, on, n].every(Number.isInteger) || cells.length + n > MOST) throw new Error("The drawing is damaged.");
    y += down;
    let x = (down ? 0 : end) + on;
    for (end = x + n; x < end; x++) cells.push([x, y]);
  }
  return cells;
}

/** A scenario as text: the same for the same walls, in whatever order they were painted. @param {Scenario} scenario */
export function textOf(scenario) {
  const edits = scenario.edits.map((edit) => ({ ...edit, blocked: packed(edit.blocked), freed: packed(edit.freed) }));
  return JSON.stringify({ ...scenario, edits });
}

/** A scenario as a part of a link: its text, deflated, in base64 of addresses. @param {Scenario} scenario @returns {Promise<string>} */
export async function toLink(scenario) {
  const stream = new Blob([textOf(scenario)]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return btoa(text).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/** What a part of a link says. @param {string} text @returns {Promise<any>} */
export async function ofLink(text) {
  const plain = atob(text.replaceAll("-", "+").replaceAll("_", "/"));
  const bytes = Uint8Array.from(plain, (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return JSON.parse(await new Response(stream).text());
}

/** Parts of the fragment: `t` the token, `s` a scenario, `v` how it is looked at, `m` a map. @param {string} hash */
export function fragment(hash = location.hash) {
  return new URLSearchParams(hash.slice(1));
}
