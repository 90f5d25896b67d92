// What a browser keeps for a page. Where it keeps nothing, as in some private windows, it is kept until the page goes.

/** The store that survives a reload of this tab alone. */
export const TAB = "sessionStorage";
const memory = { localStorage: new Map(), sessionStorage: new Map() };
let lacking = false;

function attempt(act) {
  try {
    return act();
  } catch {
    lacking = true; // denied, or full
    return undefined;
  }
}

/** What was kept under a name; null if nothing was. */
export const kept = (name, store = "localStorage") => memory[store].get(name) ?? attempt(() => window[store].getItem(name)) ?? null;

/** Keep a text; true if the browser really keeps it. */
export function keep(name, text, store = "localStorage") {
  drop(name, store);
  const done = attempt(() => (window[store].setItem(name, text), true)) ?? false;
  if (!done) memory[store].set(name, text);
  return done;
}

export function drop(name, store = "localStorage") {
  memory[store].delete(name);
  attempt(() => window[store].removeItem(name));
}

/** The names that begin so. */
export const names = (start) => [...memory.localStorage.keys(), ...(attempt(() => Object.keys(window.localStorage)) ?? [])].filter((name) => name.startsWith(start));

/** The browser has kept nothing of something. */
export const isLacking = () => lacking || !attempt(() => (window.localStorage.setItem("vrg-kept", ""), true));
