// Asks the server of the class, and listens to what it tells.
import { pause } from "./link.js";
import { keep, kept, TAB } from "./storage.js";
import { refusal, words } from "./day_words.js";

/** With these codes the server closes a connection: its token is not known, what is known of its student has changed, or it has too many pages. */
export const UNKNOWN = 4001, CHANGED = 4002, CROWDED = 1008;

/** What the server refuses: its sentence, the reason `why` and the `answer`; `status` is 0 where it was not reached. */
export class Refusal extends Error {
  constructor(text, status, answer = {}) {
    super(text);
    Object.assign(this, { status, answer, why: answer.why ?? "" });
  }
}

/** Ask as the one with a token; returns the answer, or throws a Refusal. `how` are further options of fetch. */
export async function ask(path, token, body = {}, how = {}) {
  let response, answer;
  try {
    response = await fetch(path, { method: "POST", headers: { Authorization: `Bearer ${token}` }, body: JSON.stringify(body), ...how });
    answer = await response.json().catch(() => ({}));
  } catch {
    throw new Refusal(words("student.offline"), 0);
  }
  if (response.ok) return answer;
  throw new Refusal(answer.why ? refusal(answer) : `${response.status} ${response.statusText}`, response.status, answer);
}

/** What stands behind the # of the address, which is taken out of it. */
export function takeHash() {
  const found = location.hash.slice(1);
  if (found) history.replaceState(null, "", location.pathname);
  return found;
}

/** The token of a page: from its address, or as it was kept for a reload. */
export function keptToken(name) {
  const token = takeHash() || kept(name, TAB) || "";
  // Where nothing is kept, the address has it after a reload, too.
  if (token && !keep(name, token, TAB)) history.replaceState(null, "", `#${token}`);
  return token;
}

/** Listens for a student. `onMessage(message)` is called with each message, `onChange(feed)` when the connection changes. */
export class Feed {
  constructor(token, onMessage, onChange) {
    Object.assign(this, { token, onMessage, onChange, open: false, refused: false, attempt: 0 });
    this.connect();
  }

  connect() {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss:" : "ws:"}//${location.host}/feed`);
    this.socket = socket;
    socket.onopen = () => socket.send(this.token);
    socket.onmessage = ({ data }) => {
      if (socket !== this.socket) return;
      if (!this.open) {
        Object.assign(this, { open: true, attempt: 0 });
        this.onChange(this);
      }
      for (const message of JSON.parse(data)) this.onMessage(message);
    };
    socket.onclose = ({ code }) => {
      if (socket !== this.socket) return;
      this.open = false;
      this.refused = [CROWDED, UNKNOWN, CHANGED].includes(code) ? code : 0;
      this.onChange(this);
      if (!this.refused) this.timer = setTimeout(() => this.connect(), 1000 * pause(this.attempt++, Math.random()));
    };
  }

  /** Listen no more. */
  stop() {
    clearTimeout(this.timer);
    const socket = this.socket;
    this.socket = null;
    socket.close();
  }
}
