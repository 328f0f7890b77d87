// Landscape: the shown layer in 3-D, its values as heights, with the robot on its path. Loaded when it is asked for.

import { GOAL, LINES, THEMES, levels } from "./colours.js";
import { TOUCH, button, el, formatted, tell } from "./make.js";
import { Surface, distanceFor, seenFrom } from "./surface.js";

/** Corners of the mesh along its longer side at most; every second one while it moves. */
const MOST = 256;
/** Height of the greatest value, as a share of the longer side; how much higher walls are. */
const HIGH = 0.34;
const BUMP = 0.035;
/** Heights of the place that the view is turned about, as shares of the longer side. */
const HEIGHTS = [-0.12, -0.08, -0.04, 0, 0.04, 0.08, 0.12];
/** From where it is seen at first: turned about the vertical, and above the ground, radians. */
const FIRST = { turn: -0.5, height: 0.75 };
/** Seconds of a drive on the screen at most. */
const DRIVE_S = 14;
/** Pixels that are drawn in each direction at most, at rest and while it moves, and at least on a busy machine: software draws them as well. */
const PIXELS = { still: 2000, moving: 720, least: 400 };
/** Milliseconds between frames: of so few it takes more pixels, of so many fewer. */
const QUICK = 19;
const SLOW = 25;

/** The one that is open. @type {Landscape | null} */
let open = null;
let heard = false;

/** @param {Page} page @param {Layer} layer @param {string} title */
export function askLandscape(page, layer, title) {
  if (!heard) page.on("theme", () => open?.recolour());
  heard = true;
  open = new Landscape(page, layer, title);
  return open;
}

class Landscape {
  /** @param {Page} page @param {Layer} layer @param {string} title */
  constructor(page, layer, title) {
    this.page = page;
    this.layer = layer;
    /** Places on the ground: x, height, y; and when the robot is there. @type {number[][]} */
    this.places = [];
    /** @type {number[]} */
    this.times = [];
    /** Width of the path, cells. */
    this.wide = 0.5;
    this.moment = 0;
    this.playing = false;
    this.turn = FIRST.turn;
    this.height = FIRST.height;
    this.far = 1;
    /** Width to height of the view, and from how far all of the ground is seen in it. */
    this._ratio = 0;
    this._from = 1;
    this._before = 0;
    /** Pixels while it moves, as many as this machine draws in time. */
    this.pixels = PIXELS.moving;
    /** Milliseconds of a frame, smoothed. */
    this._pace = (QUICK + SLOW) / 2;
    this._last = 0;
    this._asked = false;
    this._moving = false;
    this._settled = 0;
    this.canvas = el("canvas", { class: "deep-view", tabindex: 0, role: "img", "aria-label": `${title} in 3-D with the path; arrow keys turn it, plus and minus bring it nearer` });
    this.play = button("Play", () => this.toggle(), { class: "btn primary" });
    this.slider = el("input", { type: "range", min: 0, max: 1000, value: 0, class: "grow", "aria-label": "Moment of the drive", oninput: () => this.seek(Number(this.slider.value) / 1000) });
    this.words = el("span", { class: "deep-words" });
    this.said = el("p", { class: "hint", role: "status" }, `${TOUCH.matches ? "Drag to turn it, pinch to come nearer." : "Drag or press the arrow keys to turn it, use the wheel or + and − to come nearer."} Walls are raised.`);
    this.root = el("dialog", { class: "deep", "aria-labelledby": "deep-title" },
      el("div", { class: "row" }, el("h1", { id: "deep-title", class: "grow" }, `${title} in 3-D`), button("Close", () => this.root.close())),
      this.canvas, el("div", { class: "row" }, this.play, this.slider, this.words), this.said);
    if (!document.querySelector('link[href="/static/landscape.css"]')) document.head.append(el("link", { rel: "stylesheet", href: "/static/landscape.css" }));
    document.body.append(this.root);
    if (page.play.playing) page.play.toggle();
    this.root.addEventListener("close", () => this._close());
    this.root.addEventListener("keydown", (event) => this._key(event));
    this.root.showModal();
    try {
      this.surface = new Surface(this.canvas);
      this._build();
    } catch (error) {
      tell(this.said, error instanceof Error ? error.message : String(error), true);
      this.play.disabled = this.slider.disabled = true;
      return;
    }
    this._sized = new ResizeObserver(() => this.draw());
    this._sized.observe(this.canvas);
    this._hands();
    this.canvas.focus();
    if (this.times.length > 1 && !window.matchMedia("(prefers-reduced-motion: reduce)").matches) this.toggle();
    else this.draw();
  }

  /** Meshes of the ground, the path and the robot. */
  _build() {
    const { layer, page } = this;
    const surface = /** @type {Surface} */ (this.surface);
    const step = Math.max(1, Math.ceil(Math.max(layer.width, layer.height) / MOST));
    const ground = groundOf(layer, step, page.dark);
    this.fine = surface.keep({ ...ground, index: trianglesOf(ground.across, ground.down, 1) });
    // As fine as before where it has few corners anyway.
    this.coarse = ground.across * ground.down < 20_000 ? this.fine : surface.keep({ ...ground, index: trianglesOf(ground.across, ground.down, 2) });
    const longer = Math.max(layer.width, layer.height);
    this.places = [];
    this.middle = [0, 0, 0];
    this.longer = longer;
    // A few corners of the ground say how large it looks.
    this.ends = ground.places.filter((_, k) => Math.floor(k / 3) % 7 === 0 || k < 3);
    const speed = /** @type {any} */ (page.plan?.speed);
    const flat = speed?.xy ? speed.xy.flat() : [...(page.plan?.cells ?? [])];
    for (let k = 0; k + 1 < flat.length; k += 2) {
      const [x, y] = [flat[k], flat[k + 1]];
      this.places.push([x - (layer.width - 1) / 2, heightAt(ground.cells, x, y) + 0.004 * longer, y - (layer.height - 1) / 2]);
    }
    this.times = speed?.t?.length === this.places.length ? speed.t : this.places.map((_, k) => k);
    this.wide = Math.max(0.35, 0.005 * longer);
    this.path = this.places.length > 1 ? surface.keep(ribbonOf(this.places, this.wide, [255, 255, 255])) : null;
    this.robot = surface.keep(ballOf(Math.max(0.5, 0.012 * longer), hex(LINES[0][0])));
    this.goal = surface.keep(ballOf(Math.max(0.4, 0.009 * longer), hex(GOAL)));
    if (!this.path) {
      tell(this.said, "There is no path to show.");
      this.play.disabled = this.slider.disabled = true;
    }
  }

  /** The page has gone dark, or light. */
  recolour() {
    if (!this._sized) return;
    this._build();
    this._ratio = 0;
    this.draw();
  }

  /** Pointer and wheel. */
  _hands() {
    const { canvas } = this;
    /** Pointers that are down, by number: where each is. @type {Map<number, [number, number]>} */
    const down = new Map();
    /** How far two fingers are apart. */
    const apart = () => {
      const [[ax, ay], [bx, by]] = [...down.values()];
      return Math.max(1, Math.hypot(bx - ax, by - ay));
    };
    canvas.addEventListener("pointerdown", (event) => {
      down.set(event.pointerId, [event.clientX, event.clientY]);
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      const from = down.get(event.pointerId);
      if (!from) return;
      const before = down.size === 2 ? apart() : 0;
      down.set(event.pointerId, [event.clientX, event.clientY]);
      // Two fingers turn it together, and pinch.
      const share = 1 / down.size;
      this._look((-share * (event.clientX - from[0])) / 160, (share * (event.clientY - from[1])) / 200);
      if (before) this._near(before / apart());
    });
    for (const name of /** @type {const} */ (["pointerup", "pointercancel"])) {
      canvas.addEventListener(name, (event) => {
        down.delete(event.pointerId);
        this.draw();
      });
    }
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this._near(Math.exp(event.deltaY / 700));
    }, { passive: false });
  }

  /** @param {number} turn @param {number} height */
  _look(turn, height) {
    this.turn += turn;
    this.height = Math.min(Math.max(this.height + height, 0.12), 1.5);
    this.draw(true);
  }

  /** @param {number} times */
  _near(times) {
    this.far = Math.min(Math.max(this.far * times, 0.25), 2);
    this.draw(true);
  }

  /** @param {KeyboardEvent} event */
  _key(event) {
    const at = /** @type {HTMLElement} */ (event.target);
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key === " " && !at.closest("button")) this.toggle();
    else if (at === this.slider) return;
    else if (event.key === "ArrowLeft") this._look(-0.1, 0);
    else if (event.key === "ArrowRight") this._look(0.1, 0);
    else if (event.key === "ArrowUp") this._look(0, 0.07);
    else if (event.key === "ArrowDown") this._look(0, -0.07);
    else if (event.key === "+" || event.key === "=") this._near(1 / 1.15);
    else if (event.key === "-") this._near(1.15);
    else return;
    event.preventDefault();
  }

  toggle() {
    if (!this.path) return;
    this.playing = !this.playing;
    if (this.playing && this.moment >= 1) this.moment = 0;
    this.play.textContent = this.playing ? "Pause" : "Play";
    this._before = 0;
    this.draw();
  }

  /** @param {number} share of the drive */
  seek(share) {
    this.moment = Math.min(Math.max(share, 0), 1);
    this.draw();
  }

  /** Draw in the next frame. @param {boolean} [moving] a hand is moving it: quickly */
  draw(moving = false) {
    this._moving = moving || (this._moving && this._asked);
    if (this._asked || !this.surface) return;
    this._asked = true;
    requestAnimationFrame((now) => {
      this._asked = false;
      if (!this.root.open) return;
      this._measure(now);
      this._advance(now);
      this._drawNow();
      this.page.tell("landscape-frame");
      // A hand that moves it says so again.
      if (this.playing) this.draw();
      else if (this._moving) this._settle();
    });
  }

  /** Take as many pixels as come in time. @param {number} now */
  _measure(now) {
    const span = now - this._last;
    this._last = now;
    if (span > 250) return;
    this._pace += 0.08 * (span - this._pace);
    const less = this._pace > SLOW && this.pixels > PIXELS.least;
    if (!less && !(this._pace < QUICK && this.pixels < PIXELS.still)) return;
    this.pixels *= less ? 0.8 : 1.25;
    this._pace = (QUICK + SLOW) / 2;
  }

  /** Finely again, once it is left alone. */
  _settle() {
    clearTimeout(this._settled);
    this._settled = window.setTimeout(() => this.root.open && this.draw(), 200);
  }

  /** @param {number} now */
  _advance(now) {
    if (!this.playing) return;
    const last = this.times[this.times.length - 1] || 1;
    if (this._before) this.moment += Math.min((now - this._before) / 1000, 0.25) / Math.min(last, DRIVE_S);
    this._before = now;
    if (this.moment < 1) return;
    this.moment = 1;
    this.toggle();
  }

  _drawNow() {
    const { canvas, places, times } = this;
    const surface = /** @type {Surface} */ (this.surface);
    const moving = this.playing || this._moving;
    const most = moving ? this.pixels : PIXELS.still;
    // Edges are smoothed by more pixels than the screen has, at rest.
    const wanted = moving ? 1 : 1.5 * Math.max(window.devicePixelRatio || 1, 1);
    const ratio = Math.min(wanted, most / Math.max(canvas.clientWidth, canvas.clientHeight, 1));
    const [w, h] = [Math.max(1, Math.round(canvas.clientWidth * ratio)), Math.max(1, Math.round(canvas.clientHeight * ratio))];
    if (canvas.width !== w || canvas.height !== h) {
      canvas.width = w;
      canvas.height = h;
    }
    /** @type {import("./surface.js").Thing[]} */
    const still = [{ kept: /** @type {any} */ (this._moving ? this.coarse : this.fine) }];
    /** @type {import("./surface.js").Thing[]} */
    const robot = [];
    if (this.path) {
      const t = this.moment * times[times.length - 1];
      let k = 0;
      while (k < times.length - 2 && times[k + 1] <= t) k++;
      const span = times[k + 1] - times[k];
      const share = span > 0 ? Math.min(Math.max((t - times[k]) / span, 0), 1) : 1;
      const at = places[k].map((v, c) => v + share * (places[k + 1][c] - v));
      at[1] += this.wide;
      still.push({ kept: /** @type {any} */ (this.path) }, { kept: /** @type {any} */ (this.goal), at: places[places.length - 1] });
      robot.push({ kept: /** @type {any} */ (this.robot), at });
      this.slider.value = String(Math.round(1000 * this.moment));
      const units = /** @type {any} */ (this.page.plan?.speed)?.units ?? "";
      this.words.textContent = `${formatted(t, 1)} ${units.startsWith("m/s") ? "s" : "transfers"}`;
      this.slider.setAttribute("aria-valuetext", this.words.textContent);
    }
    const paper = hex(THEMES[this.page.dark ? "dark" : "light"].paper).map((v) => v / 255);
    const far = this.far * this._reach(w / h);
    surface.draw(paper, seenFrom(this.middle ?? [0, 0, 0], this.turn, this.height, far, w / h), still, robot);
  }

  /** From how far all of it is seen, before anybody has turned it. @param {number} ratio */
  _reach(ratio) {
    if (ratio !== this._ratio) {
      this._ratio = ratio;
      this._from = Infinity;
      // Of several heights to look at, the one with as much room above the ground as below it.
      for (const share of HEIGHTS) {
        const middle = [0, share * (this.longer ?? 1), 0];
        const from = distanceFor(this.ends ?? [], middle, FIRST.turn, FIRST.height, ratio);
        if (from < this._from) Object.assign(this, { _from: from, middle });
      }
    }
    return this._from;
  }

  _close() {
    this.playing = false;
    this._sized?.disconnect();
    this.surface?.close();
    this.root.remove();
    open = null;
  }
}

/** A colour of the style sheet as three numbers. @param {string} text */
function hex(text) {
  return [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16));
}

/**
 * The ground as a mesh: a corner for each cell, or for each few. Walls have the height of what is nearest to them and a bit more.
 * @param {Layer} layer @param {number} step @param {boolean} dark
 */
function groundOf(layer, step, dark) {
  // Small maps have several corners in a cell, so that walls are steep.
  const sub = step > 1 ? 1 : Math.max(1, Math.min(4, Math.floor(MOST / Math.max(layer.width, layer.height))));
  const unit = step / sub;
  const from = 0.5 / sub - 0.5;
  const across = Math.ceil(layer.width / unit);
  const down = Math.ceil(layer.height / unit);
  const longer = Math.max(layer.width, layer.height);
  const known = spread(layer.values, layer.width, layer.height).map((v) => (HIGH * longer * (v - 1)) / 254);
  const cells = { heights: known, across: layer.width, down: layer.height };
  const values = new Uint8Array(across * down);
  const heights = new Float32Array(across * down);
  for (let j = 0; j < down; j++) {
    for (let i = 0; i < across; i++) {
      const [x, y] = [i * unit + from, j * unit + from];
      const k = j * across + i;
      values[k] = layer.values[Math.round(y) * layer.width + Math.round(x)];
      heights[k] = heightAt(cells, x, y) + (values[k] ? 0 : BUMP * longer);
    }
  }
  const places = new Float32Array(3 * values.length);
  const normals = new Float32Array(3 * values.length);
  const colours = new Uint8Array(3 * values.length);
  const tones = levels("landscape", dark);
  const wall = dark ? [84, 90, 100] : [58, 62, 72];
  for (let j = 0; j < down; j++) {
    for (let i = 0; i < across; i++) {
      const k = j * across + i;
      places.set([i * unit + from - (layer.width - 1) / 2, heights[k], j * unit + from - (layer.height - 1) / 2], 3 * k);
      const left = heights[i > 0 ? k - 1 : k];
      const right = heights[i < across - 1 ? k + 1 : k];
      const above = heights[j > 0 ? k - across : k];
      const below = heights[j < down - 1 ? k + across : k];
      normals.set([left - right, 2 * unit, above - below], 3 * k);
      const tone = tones[values[k]];
      colours.set(values[k] ? [tone & 255, (tone >> 8) & 255, (tone >> 16) & 255] : wall, 3 * k);
    }
  }
  return { places, normals, colours, across, down, cells };
}

/** Values with those of the nearest cells where there are none. @param {Uint8Array} values @param {number} across @param {number} down */
function spread(values, across, down) {
  const out = Float32Array.from(values);
  let front = /** @type {number[]} */ ([]);
  for (let k = 0; k < out.length; k++) if (out[k]) front.push(k);
  while (front.length) {
    const next = [];
    for (const k of front) {
      const x = k % across;
      for (const n of [x > 0 ? k - 1 : -1, x < across - 1 ? k + 1 : -1, k - across, k + across]) {
        if (n < 0 || n >= across * down || out[n]) continue;
        out[n] = out[k];
        next.push(n);
      }
    }
    front = next;
  }
  return out;
}

/** Two triangles for each square of corners. @param {number} across @param {number} down @param {number} stride */
function trianglesOf(across, down, stride) {
  const at = (/** @type {number} */ n) => Array.from({ length: Math.ceil((n - 1) / stride) + 1 }, (_, k) => Math.min(k * stride, n - 1));
  const [columns, rows] = [at(across), at(down)];
  const index = new Uint32Array(6 * (columns.length - 1) * (rows.length - 1));
  let n = 0;
  for (let j = 0; j + 1 < rows.length; j++) {
    for (let i = 0; i + 1 < columns.length; i++) {
      const [a, b] = [rows[j] * across + columns[i], rows[j] * across + columns[i + 1]];
      const [c, d] = [rows[j + 1] * across + columns[i], rows[j + 1] * across + columns[i + 1]];
      index.set([a, c, b, b, c, d], n);
      n += 6;
    }
  }
  return index;
}

/** Height of the ground at a place between corners. @param {{heights: Float32Array, across: number, down: number}} ground @param {number} x @param {number} y */
function heightAt({ heights, across, down }, x, y) {
  const i = Math.min(Math.max(Math.floor(x), 0), across - 1);
  const j = Math.min(Math.max(Math.floor(y), 0), down - 1);
  const [p, q] = [Math.min(i + 1, across - 1), Math.min(j + 1, down - 1)];
  const [u, v] = [Math.min(Math.max(x - i, 0), 1), Math.min(Math.max(y - j, 0), 1)];
  const top = heights[j * across + i] * (1 - u) + heights[j * across + p] * u;
  const low = heights[q * across + i] * (1 - u) + heights[q * across + p] * u;
  return top * (1 - v) + low * v;
}

/** A line as boards of a width, each as long as a leg: with a dark board beneath, so that it is seen on any ground. @param {number[][]} places @param {number} wide @param {number[]} colour @returns {import("./surface.js").Mesh} */
function ribbonOf(places, wide, colour) {
  /** @type {number[]} */
  const corners = [];
  /** @type {number[]} */
  const tones = [];
  /** @type {number[]} */
  const index = [];
  for (const [half, lift, tone] of /** @type {Array<[number, number, number[]]>} */ ([[0.95 * wide, 0.25 * wide, [32, 36, 44]], [0.5 * wide, 0.45 * wide, colour]])) {
    for (let k = 0; k + 1 < places.length; k++) {
      const [a, b] = [places[k], places[k + 1]];
      const long = Math.sqrt((b[0] - a[0]) ** 2 + (b[2] - a[2]) ** 2) || 1;
      const [sx, sz] = [(-(b[2] - a[2]) / long) * half, ((b[0] - a[0]) / long) * half];
      const [ex, ez] = [((b[0] - a[0]) / long) * half * 0.5, ((b[2] - a[2]) / long) * half * 0.5];
      const n = corners.length / 3;
      for (const [p, side, end] of /** @type {Array<[number[], number, number]>} */ ([[a, 1, -1], [a, -1, -1], [b, 1, 1], [b, -1, 1]])) {
        corners.push(p[0] + side * sx + end * ex, p[1] + lift, p[2] + side * sz + end * ez);
        tones.push(...tone);
      }
      index.push(n, n + 1, n + 2, n + 1, n + 3, n + 2);
    }
  }
  const normals = new Float32Array(corners.length);
  for (let k = 1; k < normals.length; k += 3) normals[k] = 1;
  return { places: Float32Array.from(corners), normals, colours: Uint8Array.from(tones), index: Uint32Array.from(index) };
}

/** A ball. @param {number} r @param {number[]} colour @returns {import("./surface.js").Mesh} */
function ballOf(r, colour) {
  const [round, high] = [20, 12];
  /** @type {number[]} */
  const normals = [];
  for (let j = 0; j <= high; j++) {
    for (let i = 0; i <= round; i++) {
      const [a, b] = [(Math.PI * j) / high, (2 * Math.PI * i) / round];
      normals.push(Math.sin(a) * Math.cos(b), Math.cos(a), Math.sin(a) * Math.sin(b));
    }
  }
  return {
    places: Float32Array.from(normals, (v) => r * v), normals: Float32Array.from(normals),
    colours: Uint8Array.from(normals, (_, k) => colour[k % 3]), index: trianglesOf(round + 1, high + 1, 1),
  };
}
