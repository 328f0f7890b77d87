// The nouns that cross between the modules of the page. Types only; nothing here runs.

/** @typedef {[number, number]} Cell column and row, from the top left */

/**
 * Cells that turn wall or free at the beginning of a tick; 0: before anything has moved.
 * @typedef {{tick: number, blocked: Cell[], freed: Cell[]}} Edit
 */

/** @typedef {{name: string, settings: Record<string, unknown>}} Who */

/**
 * What a scenario file says, as far as the page changes it. Keys it does not know are kept as they are.
 * @typedef {{
 *   version: 1, name?: string, map: unknown, map_hash?: string, start: Cell | null, goal: Cell | null,
 *   robot: Record<string, number | null>, preset: string, moves: string | null, planner: Who, law: Who | null,
 *   seed: number, obstacles: Array<Record<string, any>>, edits: Edit[],
 *   simulate?: {ticks: number | null, patience: number | null},
 * }} Scenario
 */

/**
 * A map as the server sends it. `cells`: 0 free, 1 wall, 2 unknown; row by row from the top.
 * @typedef {{
 *   id: string, name: string, width: number, height: number, resolution: number, hash: string,
 *   cells: Uint8Array, terrain: Uint8Array | null, start: Cell | null, goal: Cell | null,
 * }} Ground
 */

/**
 * Values of every cell, 0: none, 1 to 255 from low to high.
 * @typedef {{name: string, width: number, height: number, low: number, high: number, values: Uint8Array}} Layer
 */

/**
 * A simulation as far as it has come. Arrays grow; `ticks` says how much of them is filled.
 * @typedef {{
 *   job: string, planner: string, label: string, law: string, units: string, ticks: number, done: boolean,
 *   robot: Int16Array, speed: Float32Array, cause: Uint8Array, causes: string[],
 *   bodies: Array<{kind: string, radius: number, yields: boolean}>, places: Int16Array[],
 *   near: Float32Array, events: Array<{tick: number, word: string, cell: Cell, sentence: string}>,
 *   end: Record<string, any> | null,
 * }} Run
 */

/**
 * A plan: its way, and the speed at each node with what binds it.
 * @typedef {{
 *   status: string, sentence: string, cells: Int16Array, waypoints: Cell[] | null, cost: number | null,
 *   optimal_cost: number | null, gap: number | null, sum_cost_to_go: number | null, iterations: number,
 *   expansions: number, gates: {count: number, on_path: any[], in_map: any[]}, jumps: any[],
 *   speed: {v: number[], s: number[], t: number[], cause: string[], why: string[], units: string,
 *           caps: Array<{cause: string, v: Array<number | null>}>} | null,
 *   seconds: number,
 * }} Plan
 */

export {};
