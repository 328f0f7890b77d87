// Frames: what the server streams. Each is a length, a kind of one letter and a payload, little endian.

/** @typedef {{kind: string, bytes: Uint8Array}} Frame */

const MOST = 1 << 28;

/**
 * The frames of a streamed answer, one by one as they arrive.
 * @param {ReadableStream<Uint8Array>} stream
 * @returns {AsyncGenerator<Frame>}
 */
export async function* framesOf(stream) {
  const reader = stream.getReader();
  let held = new Uint8Array(1 << 16);
  let from = 0;
  let to = 0;
  try {
    for (;;) {
      while (to - from >= 5) {
        const size = new DataView(held.buffer, from, 4).getUint32(0, true);
        if (size < 1 || size > MOST) throw new Error(`a frame of ${size} bytes`);
        if (to - from < 4 + size) break;
        const kind = String.fromCharCode(held[from + 4]);
        // A copy: what follows is written over the buffer.
        yield { kind, bytes: held.slice(from + 5, from + 4 + size) };
        from += 4 + size;
      }
      const { value, done } = await reader.read();
      if (done) break;
      if (to + value.length > held.length) {
        const need = to - from + value.length;
        const room = need > held.length ? new Uint8Array(Math.max(need, 2 * held.length)) : held;
        room.set(held.subarray(from, to));
        held = room;
        to -= from;
        from = 0;
      }
      held.set(value, to);
      to += value.length;
    }
    if (to !== from) throw new Error("the answer broke off in the middle of a frame");
  } finally {
    // Whoever stops reading early wants no more of it; after the end this does nothing.
    reader.cancel().catch(() => {});
    reader.releaseLock();
  }
}

/** @param {Uint8Array} bytes */
export function json(bytes) {
  return JSON.parse(new TextDecoder().decode(bytes));
}

/**
 * A layer, or the heat of a tick without its tick.
 * @param {Uint8Array} bytes
 * @returns {Layer}
 */
export function layerOf(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const letters = view.getUint8(0);
  const name = new TextDecoder().decode(bytes.subarray(1, 1 + letters));
  let at = 1 + letters;
  const width = view.getUint32(at, true);
  const height = view.getUint32(at + 4, true);
  const low = view.getFloat32(at + 8, true);
  const high = view.getFloat32(at + 12, true);
  at += 16;
  if (bytes.length - at !== width * height) throw new Error(`layer ${name}: ${bytes.length - at} cells`);
  return { name, width, height, low, high, values: bytes.subarray(at) };
}

/**
 * Ticks of a simulation, put into the run.
 * @param {Uint8Array} bytes
 * @param {Run} run
 */
export function addTicks(bytes, run) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const first = view.getUint32(0, true);
  const n = view.getUint16(4, true);
  const bodies = view.getUint16(6, true);
  if (first !== run.ticks) throw new Error(`ticks from ${first} on, not from ${run.ticks}`);
  const size = 8 + n * (4 + 4 + 1 + 4 * bodies + 4);
  if (bytes.length !== size) throw new Error(`${n} ticks in ${bytes.length} bytes, not in ${size}`);
  const last = first + n;
  run.robot = grown(run.robot, 2 * last);
  run.speed = grown(run.speed, last);
  run.cause = grown(run.cause, last);
  run.near = grown(run.near, last);
  // Copied out as bytes, so that nothing has to lie at a multiple of its size. Machines that run browsers are
  // little endian, as the frames are.
  let at = 8;
  /** @param {number} length */
  const next = (length) => bytes.slice(at, (at += length)).buffer;
  run.robot.set(new Int16Array(next(4 * n)), 2 * first);
  run.speed.set(new Float32Array(next(4 * n)), first);
  run.cause.set(bytes.subarray(at, (at += n)), first);
  const places = new Int16Array(next(4 * n * bodies));
  for (let k = 0; k < n; k++) run.places.push(places.subarray(2 * bodies * k, 2 * bodies * (k + 1)));
  run.near.set(new Float32Array(next(4 * n)), first);
  run.ticks = last;
}

/**
 * Cells that a robot with a sensor has seen for the first time, put into the run.
 * @param {Uint8Array} bytes
 * @param {Run} run
 */
export function addSeen(bytes, run) {
  const n = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength).getUint32(0, true);
  if (bytes.length !== 4 + 8 * n || !run.seen) throw new Error(`${n} cells seen in ${bytes.length} bytes`);
  const cells = new Uint32Array(bytes.slice(4, 4 + 4 * n).buffer);
  const ticks = new Uint32Array(bytes.slice(4 + 4 * n).buffer);
  for (let k = 0; k < n; k++) run.seen[cells[k]] = ticks[k];
}

/** Seconds from one sample of a run to the next; 0: its ticks have no known length. @param {Run | null} run */
export function secondsOf(run) {
  return run?.step ?? run?.tick_s ?? 0;
}

/** Ticks of a run as a time, or as their number. @param {Run | null} run @param {number} tick */
export function timeOf(run, tick) {
  const seconds = secondsOf(run);
  return seconds ? `${(tick * seconds).toFixed(1)} s` : String(tick);
}

/** A run of which nothing has come but its head. @param {Record<string, any>} head @returns {Run} */
export function newRun(head) {
  return {
    job: String(head.job ?? ""), planner: head.planner ?? "", label: head.label ?? head.controller ?? head.planner ?? "", law: head.law ?? "",
    units: head.units ?? "", ticks: 0, done: false, robot: new Int16Array(0), speed: new Float32Array(0),
    cause: new Uint8Array(0), causes: head.causes ?? [], bodies: [...(head.obstacle_specs ?? [])], places: [],
    near: new Float32Array(0), caps: [], events: [], end: null,
    step: head.step, tick_s: head.tick_s ?? null, yaw: new Float32Array(0), rivals: [], paths: head.paths ?? [],
    seen: head.sensor ? new Int32Array(head.map.width * head.map.height).fill(-1) : null, reach: head.sensor?.[0] ?? 0, angle: head.sensor?.[1] ?? 0,
    goals: head.goal_track ?? null,
  };
}

/**
 * Events of a simulation, put into the run; who appears says what it is.
 * @param {Uint8Array} bytes
 * @param {Run} run
 */
export function addEvents(bytes, run) {
  for (const event of json(bytes)) {
    run.events.push(event);
    if (event.obstacle) run.bodies.push(event.obstacle);
  }
}

/**
 * The same array, or a longer one with its contents.
 * @template {Int16Array | Float32Array | Uint8Array} T
 * @param {T} array
 * @param {number} need
 * @returns {T}
 */
export function grown(array, need) {
  if (need <= array.length) return array;
  const Kind = /** @type {new (n: number) => T} */ (array.constructor);
  const longer = new Kind(Math.max(need, 2 * array.length, 256));
  longer.set(/** @type {any} */ (array));
  return longer;
}
