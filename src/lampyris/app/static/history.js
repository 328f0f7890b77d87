// History: the studies that this browser has sent, the newest first. The server forgets them when it ends.

/** @typedef {{job: string, when: number, title: string, met: import("./meeting.js").Meeting}} Sent */

const KEPT = "lampyris-studies";
const MOST = 16;

/** @returns {Sent[]} */
export function history() {
  try {
    const found = JSON.parse(localStorage.getItem(KEPT) ?? "[]");
    return Array.isArray(found) ? found.filter((one) => typeof one?.job === "string" && Array.isArray(one.met?.planners)) : [];
  } catch {
    return [];
  }
}

/** @param {Sent} sent */
export function remember(sent) {
  write([sent, ...history().filter(({ job }) => job !== sent.job)].slice(0, MOST));
}

/** @param {string} job */
export function forget(job) {
  write(history().filter((one) => one.job !== job));
}

/** @param {Sent[]} all */
function write(all) {
  try {
    localStorage.setItem(KEPT, JSON.stringify(all));
  } catch {
    // Then a reload forgets them.
  }
}
