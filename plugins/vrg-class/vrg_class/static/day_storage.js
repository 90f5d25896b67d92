// What a browser keeps for a page. Where it keeps nothing, as in some private windows, it is kept until the page goes.

const memory = new Map();
let lacking = false;

/** The store that survives a reload of this tab alone. */
export const TAB = "sessionStorage";
const attempt = (act) => {
  try {
    return act();
  } catch {
    lacking = true; // denied, or full
    return undefined;
  }
};

/** What was kept under a name; null if nothing was. */
export const kept = (name, store = "localStorage") => memory.get(store + name) ?? attempt(() => window[store].getItem(name)) ?? null;

/** Keep a text; true if the browser really keeps it. */
export function keep(name, text, store = "localStorage") {
  const done = attempt(() => (window[store].setItem(name, text), true)) ?? false;
  if (done) memory.delete(store + name);
  else memory.set(store + name, text);
  return done;
}

export function drop(name, store = "localStorage") {
  memory.delete(store + name);
  attempt(() => window[store].removeItem(name));
}

/** The names that begin so. */
export const names = (start, store = "localStorage") => [
  ...new Set([...memory.keys()].filter((name) => name.startsWith(store + start)).map((name) => name.slice(store.length)).concat(
    attempt(() => Object.keys(window[store]).filter((name) => name.startsWith(start))) ?? [],
  )),
];

/** The browser has kept nothing of something. */
export const isLacking = () => lacking || !attempt(() => (window.localStorage.setItem("vrg-kept", ""), true));
