// An emergency stop that was pressed here, until the bus has it: then the state of the match shows it as engaged.

/** ms between two attempts, ms after which one that has not come back counts as not sent, and ms for which it is tried. */
const AGAIN = 500, LATE = 1500, LONGEST = 30000;
/** ms after it was sent from which on what is heard tells of it: before, an older stop may just be released. */
const SETTLED = 300;

export class PendingStop {
  /** `send()` sends it, and is true if there was a connection. */
  constructor(send) {
    this.send = send;
    /** Empty; `sending` while it may be on its way; or `unsent`. */
    this.stands = "";
    this.since = 0;
    this.tried = 0;
    this.sent = Infinity;
  }

  press(now) {
    this.stands = "sending";
    this.since = now;
    this.tried = -Infinity;
    this.sent = Infinity;
  }

  /**
   * Send it if it is time. `heard` is when the server was heard last, and `engaged` whether it said then that the match
   * is stopped. True if it is given up now.
   */
  look(now, heard, engaged) {
    if (!this.stands) return false;
    const done = engaged && heard > this.sent + SETTLED;
    if (done || now - this.since > LONGEST) {
      this.stands = "";
      return !done;
    }
    if (now - this.tried >= AGAIN) {
      this.tried = now;
      this.sent = this.send() ? Math.min(this.sent, now) : Infinity;
    }
    this.stands = this.sent === Infinity || now - this.since > LATE ? "unsent" : "sending";
    return false;
  }
}
