// The nouns that cross between the modules of the page. Types only; nothing here runs or is loaded: as the one file
// that is no module, it gives its names to all of them.

/** @typedef {[number, number]} Cell column and row, from the top left */

/**
 * Cells that turn wall or free at the beginning of a tick; 0: before anything has moved.
 * @typedef {{tick: number, blocked: Cell[], freed: Cell[]}} Edit
 */

/** @typedef {{name: string, settings: Record<string, unknown>}} Who */

/**
 * What a scenario file says, as far as the page changes it. Keys it does not know are kept as they are. `start_yaw`,
 * `goal_yaw`: headings for planners of poses, radians in the map frame; `start_m`, `goal_m`: ends in metres of a file
 * that is being opened. `drive`: settings of a drive in continuous time, which planners of poses always make; `controllers`:
 * what else drives beside its own one, to be compared; of the page alone, and in no file; so is `fleet`, what the panel Fleet has (see fleetkeep.js), and whether it is `open`.
 * @typedef {{
 *   version: 1, name?: string, map: unknown, map_hash?: string, start: Cell | null, goal: Cell | null,
 *   start_yaw: number | null, goal_yaw: number | null, start_m?: number[], goal_m?: number[],
 *   robot: Record<string, any>, preset: string, moves: string | null, planner: Who, law: Who | null,
 *   seed: number, obstacles: Array<Record<string, any>>, edits: Edit[],
 *   simulate?: {ticks: number | null, patience: number | null}, drive?: Record<string, any>, controllers?: Who[], fleet?: Record<string, any>,
 * }} Scenario
 */

/**
 * A map as the server sends it. `cells`: 0 free, 1 wall, 2 unknown; row by row from the top.
 * @typedef {{
 *   id: string, name: string, width: number, height: number, resolution: number, hash: string,
 *   origin: [number, number, number], cells: Uint8Array, terrain: Uint8Array | null, start: Cell | null, goal: Cell | null, obstacle_cells: Cell[],
 * }} Ground
 */

/**
 * Values of every cell, 0: none, 1 to 255 from low to high.
 * @typedef {{name: string, width: number, height: number, low: number, high: number, values: Uint8Array}} Layer
 */

/**
 * A simulation as far as it has come. Arrays grow; `ticks` says how much of them is filled. `cut`: a wall was painted
 * at its last tick, and what came after it is taken off. Of a drive in continuous time the ticks are samples, `step` seconds
 * apart, with the robot's `yaw` on the screen; a tick of a simulation stands for `tick_s` seconds, null where speeds are not in m/s; `rivals` are the drives of other controllers in the
 * same scene, `paths` what the robot was to follow, each from `t` seconds on. `seen`: the tick at
 * which a robot with a sensor saw each cell first, -1 never, and null where the map is known; `reach`: how many cells it sees, `angle`: its field of view, radians.
 * `goals`: the cells of a goal that moves.
 * @typedef {{
 *   job: string, planner: string, label: string, law: string, units: string, ticks: number, done: boolean,
 *   robot: Int16Array | Float32Array, speed: Float32Array, cause: Uint8Array, causes: string[],
 *   bodies: Array<{kind: string, radius: number, yields: boolean, outline?: Array<[number, number]>, yaw?: number, turns?: Array<[number, number]>}>, places: Array<Int16Array | Float32Array>,
 *   near: Float32Array, caps: Array<{cause: string, v: Array<number | null>}>, events: Array<{tick: number, word: string, cell: Cell, sentence: string}>,
 *   end: Record<string, any> | null, cut?: boolean, step?: number, tick_s?: number | null, yaw: Float32Array, rivals: Run[], paths: Array<{t: number, poses: number[][]}>,
 *   seen: Int32Array | null, reach: number, angle: number, goals: Cell[] | null,
 * }} Run
 */

/**
 * A plan: its way, and the speed at each node with what binds it.
 * @typedef {{
 *   status: string, sentence: string, cells: Int16Array, waypoints: Cell[] | null, cost: number | null,
 *   optimal_cost: number | null, gap: number | null, sum_cost_to_go: number | null, iterations: number,
 *   expansions: number, gates: {count: number, on_path: any[], in_map: any[]}, jumps: any[],
 *   speed: {xy?: number[][], v: number[], s: number[], t: number[], cause: string[], why: string[], units: string,
 *           caps: Array<{cause: string, v: Array<number | null>}>} | null,
 *   seconds: number, weakened?: string[], pose_cells?: number[][], rounds?: import("./rounds.js").Round[], length_m?: number, bound?: number | null, reversals?: number,
 *   obstacle_specs?: Array<{kind: string, radius: number, yields: boolean, at: Cell, outline?: Array<[number, number]>, yaw?: number, waypoints?: Cell[], path?: Cell[]}>,
 * }} Plan
 */

/**
 * The player of a run. It fills `page.map.moment` from the run, between ticks too. Without a run, or with one of
 * another scenario, `toggle` asks for one with `page.simulate()`. `hold`: time stands still while a hand is on it.
 * @typedef {{
 *   tick: number, last: number, playing: boolean, speed: number, seek: (t: number) => void, toggle: () => void,
 *   step: (n: number) => void, rate: (f: number) => void, hold: (held: boolean) => void,
 * }} Play
 */

/** @typedef {"note" | "good" | "bad"} Tone */

/**
 * What every module gets. Made by page.js, filled by main.js.
 *
 * Announced by name: "ground" (a map came or its cells changed; detail, when none could be had: why), "plan" (page.plan is new; detail: Plan or null),
 * "run" (another run began; detail {tick, play}: where the player shall go and whether it shall run), "ticks" (more
 * of the run arrived), "end" (it ended), "tick" (the shown moment changed; detail: number), "layer", "gone"
 * (detail: boolean), "progress" (page.driving changed), "theme" (detail: dark, boolean), "busy" (detail: boolean), "tool" (detail: name),
 * "opening" (the first scene is about to play by itself), "panel" (detail: the panel that was opened), "fleet" (a fleet is shown in place of a single robot, or no longer), "token" (another address was opened), "help", "map" (the view panned or zoomed).
 * Changes of the scenario are announced by `store.listen(changed keys)`.
 *
 * @typedef {{
 *   store: import("./state.js").Store, api: import("./api.js").Api, map: import("./map.js").MapView,
 *   hello: any, ground: Ground | null, base: Uint8Array | null, plan: Plan | null, run: Run | null, play: Play,
 *   dark: boolean, gone: boolean, tool: string, fleet: import("./fleet.js").Fleet | null,
 *   on: (name: string, hear: (detail: any) => void) => void,
 *   tell: (name: string, detail?: any) => void,
 *   busy: (who: string, on: boolean) => void,
 *   say: (sentence: string, tone?: Tone) => void,
 *   fault: (error: unknown) => void,
 *   simulate: (how?: {tick?: number, play?: boolean, cut?: boolean}) => Promise<void>,
 *   stop: () => void,
 *   replan: () => void,
 *   turn: () => number,
 *   open: (map: unknown, turn?: number) => Promise<boolean>,
 *   adopt: (scenario: Scenario, turn?: number) => Promise<boolean>,
 *   titleOf: (name: string) => string,
 *   asked: (ticks?: boolean) => Scenario, drives: () => boolean, driving: string, planning: boolean, driver: typeof import("./driven.js").driver | null,
 *   link: () => Promise<string>,
 *   show: (section: string) => void | Promise<void>,
 *   use: (tool: string) => void, met: () => string,
 * }} Page
 *
 * `base`: cells of the map before any edit. `fault`: say what went wrong, whatever was thrown. `simulate`: run the
 * scenario from its beginning. `stop`: cancel what runs. `replan`: plan again soon. `open`: take another map.
 * `turn`: a number for a wish for a map; of several the newest counts, `open` and `adopt` say whether it was this one.
 * `adopt`: take a whole scenario (undoable). `asked`: the scenario as the server takes it; `ticks`: without
 * what it says of drives. `drives`: whether a run is a drive in continuous time. `driver`: what is done with drives, once it is loaded. `driving`: what is computed before there is something to play. `link`: this state's
 * address, with the token of this start. `busy`: somebody works, or no longer does. `show`: open the tab with a section; done once what is in it is there. `use`: take up a tool.
 * `fleet`: what is shown in place of a single robot, while the panel Fleet is open. `met`: who meets in a comparison, as a part of the link.
 */
