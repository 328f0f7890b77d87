// Grounds: maps as they come, and what was painted on them.

import { ServerError } from "./api.js";
import { THEMES, packed } from "./colours.js";
import { framesOf, json } from "./frames.js";

const SIGNS = { ".": 0, "#": 1, "?": 2, S: 0, G: 0, o: 0 };

/**
 * The ground that a scenario's map means.
 * @param {import("./api.js").Api} api
 * @param {any} spec a name, {bundled}, {library}, {recipe} or {rows}
 * @param {AbortSignal} [signal]
 * @returns {Promise<Ground>}
 */
export async function loadGround(api, spec, signal) {
  if (spec && typeof spec === "object" && Array.isArray(spec.rows)) return groundOfRows(spec);
  if (spec && typeof spec === "object" && "recipe" in spec) {
    return groundOfAnswer(await api.call("/api/make", { json: { map: spec }, signal }), "", spec);
  }
  const id = typeof spec === "string" ? spec : spec?.library ?? spec?.bundled;
  if (typeof id !== "string") throw new Error("This scenario's map is of a kind that the app cannot open: upload it as a picture.");
  return groundOfAnswer(await api.call(`/api/maps/${encodeURIComponent(id)}`, { signal }), id, spec);
}

/** @param {Response} answer @param {string} id @param {any} spec @returns {Promise<Ground>} */
async function groundOfAnswer(answer, id, spec) {
  /** @type {any} */
  let head = null;
  /** @type {Uint8Array | null} */
  let cells = null;
  /** @type {Uint8Array | null} */
  let terrain = null;
  if (!answer.body) throw new Error("an answer without a map");
  for await (const { kind, bytes } of framesOf(answer.body)) {
    if (kind === "H" || kind === "Z") head = { ...head, ...json(bytes) };
    else if (kind === "B" && !cells) cells = bytes;
    else if (kind === "B") terrain = bytes;
    else if (kind === "X") throw new ServerError(200, json(bytes));
  }
  if (!head || cells?.length !== head.width * head.height) throw new Error(`map ${id}: no cells`);
  const ground = { ...blankGround(head), id, cells, terrain };
  if (typeof spec === "object" && typeof spec.resolution === "number") ground.resolution = spec.resolution;
  return ground;
}

/** @param {any} head @returns {Ground} */
function blankGround(head) {
  return {
    id: head.id ?? "", name: head.name ?? "map", width: head.width, height: head.height, resolution: head.resolution ?? 1,
    hash: head.hash ?? "", origin: head.origin ?? [0, 0, 0], cells: new Uint8Array(0), terrain: null, start: head.start ?? null, goal: head.goal ?? null, obstacle_cells: head.obstacle_cells ?? [],
  };
}

/** @param {{rows: string[], name?: string, resolution?: number}} spec @returns {Ground} */
function groundOfRows(spec) {
  const height = spec.rows.length;
  const width = spec.rows[0]?.length ?? 0;
  if (!width || width * height > 1 << 22) throw new Error("This scenario's map is empty or too large.");
  const cells = new Uint8Array(width * height);
  /** @type {Record<string, Cell | null>} */
  const ends = { S: null, G: null };
  /** @type {Cell[]} */
  const bodies = [];
  spec.rows.forEach((row, y) => {
    if (row.length !== width) throw new Error(`Row ${y} of the map has ${row.length} cells, the first has ${width}.`);
    for (let x = 0; x < width; x++) {
      const sign = row[x];
      cells[y * width + x] = SIGNS[/** @type {keyof typeof SIGNS} */ (sign)] ?? 1;
      if (sign === "S" || sign === "G") ends[sign] = [x, y];
      else if (sign === "o") bodies.push([x, y]);
    }
  });
  const head = { name: spec.name ?? "inline", width, height, resolution: spec.resolution, start: ends.S, goal: ends.G, obstacle_cells: bodies };
  return { ...blankGround(head), cells };
}

/**
 * Put edits up to a tick onto the cells before any edit, into `out`.
 * @param {Uint8Array} base @param {Edit[]} edits @param {number} tick @param {number} width @param {Uint8Array} out
 */
export function applyEdits(base, edits, tick, width, out) {
  out.set(base);
  const height = base.length / width;
  for (const edit of [...edits].sort((a, b) => a.tick - b.tick)) {
    if (edit.tick > tick) continue;
    for (const [cells, value] of /** @type {Array<[Cell[], number]>} */ ([[edit.blocked, 1], [edit.freed, 0]])) {
      for (const [x, y] of cells) if (x >= 0 && y >= 0 && x < width && y < height) out[y * width + x] = value;
    }
  }
}

/**
 * Edits with a stroke put in at a tick: what is as it was before that tick is in none of the lists.
 * @param {Edit[]} edits @param {number} tick
 * @param {Map<number, number>} stroke value of each painted cell, 0 or 1
 * @param {Uint8Array} before the cells as the edits of earlier ticks leave them @param {number} width
 * @returns {Edit[]}
 */
export function withStroke(edits, tick, stroke, before, width) {
  const old = edits.find((edit) => edit.tick === tick);
  /** @type {Cell[]} */
  const blocked = (old?.blocked ?? []).filter(([x, y]) => !stroke.has(y * width + x));
  /** @type {Cell[]} */
  const freed = (old?.freed ?? []).filter(([x, y]) => !stroke.has(y * width + x));
  for (const [k, value] of stroke) {
    if (before[k] === value) continue;
    (value ? blocked : freed).push([k % width, Math.floor(k / width)]);
  }
  const others = edits.filter((edit) => edit.tick !== tick);
  if (!blocked.length && !freed.length) return others;
  return [...others, { tick, blocked, freed }].sort((a, b) => a.tick - b.tick);
}

/** Draw a small picture of a ground. @param {Ground} ground @param {HTMLCanvasElement} canvas @param {number} most pixels of its longer side @param {boolean} dark */
export function drawn(ground, canvas, most, dark) {
  const step = Math.max(1, Math.max(ground.width, ground.height) / most);
  const [w, h] = [Math.floor(ground.width / step), Math.floor(ground.height / step)].map((n) => Math.max(1, n));
  const { free, wall, unknown, dear } = THEMES[dark ? "dark" : "light"];
  const colours = [free, wall, unknown].map(packed);
  const costly = packed(dear);
  const image = new ImageData(w, h);
  const pixels = new Uint32Array(image.data.buffer);
  for (let y = 0; y < h; y++) {
    for (let x = 0; x < w; x++) {
      const k = Math.floor(y * step) * ground.width + Math.floor(x * step);
      pixels[y * w + x] = ground.cells[k] === 0 && (ground.terrain?.[k] ?? 0) > 90 ? costly : colours[ground.cells[k]];
    }
  }
  canvas.width = w;
  canvas.height = h;
  /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d")).putImageData(image, 0, 0);
}
