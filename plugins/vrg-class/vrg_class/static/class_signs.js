// Signs that look like those of Python and are others: from texts, and from keyboards of telephones. Pure.

const INSTEAD = { "“": '"', "”": '"', "„": '"', "‟": '"', "«": '"', "»": '"', "″": '"', "‘": "'", "’": "'", "‚": "'", "‛": "'", "‹": "'", "›": "'", "´": "'", "`": "'", "′": "'", "×": "*", "÷": "/", "≤": "<=", "≥": ">=", "≠": "!=", "–": "-", "—": "-", "−": "-", "‐": "-", "‑": "-", "【": "[", "】": "]", "「": '"', "」": '"' };

/** What Python knows in place of a sign: {kind, sign, instead}; null for one that it knows, or that has no such. */
function odd(sign) {
  if (sign < "\x7f" && sign !== "`") return null;
  const instead = /[\p{Zs}\u200b-\u200d\u2060\ufeff]/u.test(sign) ? " " : INSTEAD[sign] ?? sign.normalize("NFKC");
  if (!/^[!-~ ]{1,2}$/.test(instead) || /^\w$/.test(instead)) return null;
  const kind = instead === " " ? "space" : /["']/.test(instead) ? "quote" : /[()[\]{}]/.test(instead) ? "bracket" : instead === "-" ? "dash" : "sign";
  return { kind, sign, instead };
}

/**
 * The first odd sign of a line, outside of texts and comments, or null: {kind, sign, instead, column, place}; `column`
 * counts signs from 1, as people do, and `place` counts as JavaScript does, from 0.
 */
export function oddSign(line) {
  let quote = "", place = 0;
  for (const sign of line) {
    if (quote) quote = sign === quote ? "" : quote;
    else if (sign === "#") return null;
    else if (sign === '"' || sign === "'") quote = sign;
    else if (odd(sign)) return { ...odd(sign), place, column: [...line.slice(0, place)].length + 1 };
    place += sign.length;
  }
  return null;
}
