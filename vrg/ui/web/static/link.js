// The connection to the server: it comes back by itself, with growing pauses.

const SHORTEST = 0.5, LONGEST = 5;
/** How many batches may come before they are acknowledged. */
const EACH = 3;

/** The pause in s before the next attempt; `attempt` counts from 0, `chance` is from 0 to 1. */
export function pause(attempt, chance) {
  return Math.min(LONGEST, SHORTEST * 2 ** attempt) * (0.75 + 0.5 * chance);
}

export class Link {
  /** `hello` gives the first request; `onMessage(message)`, `onChange(link)` are called. */
  constructor(hello, onMessage, onChange) {
    this.hello = hello;
    this.onMessage = onMessage;
    this.onChange = onChange;
    this.attempt = 0;
    this.socket = null;
    this.open = false;
    this.stopped = false;
    this.nextAt = 0;
    this.heardAt = 0;
    this.timer = 0;
  }

  connect() {
    clearTimeout(this.timer);
    this.stopped = false;
    this.nextAt = 0;
    const address = new URL("socket", location.href); // beside the page, wherever another server may show that
    address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(address);
    this.socket = socket;
    let batches = 0;
    socket.onopen = () => socket.send(JSON.stringify({ t: "hello", ...this.hello() }));
    socket.onmessage = (event) => {
      if (socket !== this.socket) return;
      this.heardAt = performance.now();
      for (const message of JSON.parse(event.data)) {
        if (message.t === "welcome") {
          this.attempt = 0;
          this.open = true;
        }
        this.onMessage(message);
      }
      batches += 1;
      if (this.open && batches % EACH === 0) this.send({ t: "ack", count: batches });
      this.onChange(this);
    };
    socket.onclose = () => {
      if (socket !== this.socket) return;
      this.open = false;
      if (!this.stopped) {
        const wait = pause(this.attempt++, Math.random());
        this.nextAt = performance.now() + 1000 * wait;
        this.timer = setTimeout(() => this.connect(), 1000 * wait);
      }
      this.onChange(this);
    };
    this.onChange(this);
  }

  /** Try no more until `connect` is called. */
  stop() {
    this.stopped = true;
    clearTimeout(this.timer);
    this.socket?.close();
  }

  /** Send a request; whether there was a connection to send it on. */
  send(request) {
    const open = this.socket?.readyState === WebSocket.OPEN;
    if (open) this.socket.send(JSON.stringify(request));
    return open;
  }
}
