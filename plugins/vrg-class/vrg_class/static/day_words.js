// The words of the pages, in the language of the browser: see words/en.json.

/** ms until words are asked for again, and ms for an answer. */
const AGAIN = 1000, LATE = 5000;

/** Ask for the words until they come: without them a page says nothing. */
const fetched = () => fetch("words.json", { signal: AbortSignal.timeout?.(LATE) }).then((answer) => answer.json())
  .catch(() => new Promise((resolve) => setTimeout(() => resolve(fetched()), AGAIN)));

const found = await fetched();
export const LANGUAGE = found.tag;
const plural = new Intl.PluralRules(LANGUAGE);
document.documentElement.lang = LANGUAGE;

/** The value of a key such as "event.lost"; undefined if there is none. */
export const value = (key) => key.split(".").reduce((part, name) => part?.[name], found);

/** A text of a key, with fields in place of {name}; where it has forms for one and for others, `n` chooses. */
export function words(key, fields = {}) {
  const text = value(key) ?? key, form = typeof text === "string" ? text : text[plural.select(fields.n ?? 0)] ?? text.other;
  return form.replace(/\{(\w+)\}/g, (whole, name) => fields[name] ?? whole);
}

/** What the server refuses, in words: its answer {why, ...}. */
export const refusal = (answer) => words(`refused.${answer.why}`, answer);

const PLACES = { say: "textContent", title: "title", label: "ariaLabel", holder: "placeholder" };

/** Fill what the page's HTML marks: data-say, data-title, data-label and data-holder have keys. */
export function fill(root = document) {
  for (const [name, property] of Object.entries(PLACES)) {
    for (const element of root.querySelectorAll(`[data-${name}]`)) element[property] = words(element.dataset[name]);
  }
}
