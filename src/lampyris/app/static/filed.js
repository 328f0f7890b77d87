// Filed: a file that the server makes comes in pieces, and the browser saves it.

import { ServerError } from "./api.js";
import { json } from "./frames.js";
import { brought } from "./later.js";
import { el } from "./make.js";

const TYPES = /** @type {Record<string, string>} */ ({
  png: "image/png", svg: "image/svg+xml", webp: "image/webp", gif: "image/gif", csv: "text/csv", yaml: "application/yaml", html: "text/html", json: "application/json",
});

/**
 * The file as it comes, and before it how far it is. WebM and MP4 are made here, of the film as WebP.
 * @param {Page} page @param {Record<string, any>} body @param {string} ending @param {AbortSignal} signal @param {(said: any) => void} share @returns {Promise<Blob>}
 */
export async function fileOf(page, body, ending, signal, share) {
  if (ending === "webm" || ending === "mp4") {
    const film = await fileOf(page, { ...body, what: "webp" }, "webp", signal, share);
    const [video] = await brought(page, "video");
    return video.askVideo(film, ending, signal, share);
  }
  const parts = /** @type {any[]} */ ([]);
  let size = 0;
  let whole = false;
  for await (const { kind, bytes: data } of page.api.frames("/api/export", { ...body, progress: true }, signal)) {
    if (kind === "X") throw new ServerError(200, json(data));
    if (kind === "P") share(json(data));
    if (kind === "Z") whole = json(data).bytes === size;
    if (kind !== "B") continue;
    parts.push(data);
    size += data.length;
  }
  if (!whole) throw new Error("the file did not come whole");
  return new Blob(parts, { type: TYPES[ending] });
}

/** Letters and digits that every system takes in a file's name. @param {string} text */
export function safe(text) {
  return text.normalize("NFKD").replace(/[^A-Za-z0-9._-]+/g, "-").replace(/^[-.]+|[-.]+$/g, "").slice(0, 60);
}

/** @param {Blob} file @param {string} name */
export function save(file, name) {
  const address = URL.createObjectURL(file);
  const link = el("a", { href: address, download: name, hidden: true });
  document.body.append(link);
  link.click();
  link.remove();
  // The browser has begun to save once the click returns; Safari reads a moment later.
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

/** @param {number} n */
export function bytes(n) {
  return n < 1000 ? `${n} bytes` : n < 1e6 ? `${(n / 1000).toFixed(1)} kB` : `${(n / 1e6).toFixed(1)} MB`;
}
