// An emergency stop that was pressed here, until the bus has it: then the state of the match shows it as engaged.

/** ms between two attempts, ms after which one that has not come back counts as not sent, and ms for which it is tried. */
const AGAIN = 500, LATE = 1500, LONGEST = 30000;

export class PendingStop {
  /** `send()` sends it, and is true if there was a connection. */
  constructor(send) {
    this.send = send;
    /** Empty; `sending` while it may be on its way; or `unsent`. */
    this.stands = "";
    this.since = 0;
    this.last = 0;
  }

  press(now) {
    this.stands = "sending";
    this.since = now;
    this.last = -Infinity;
    this.look(now, false);
  }

  /** Send it if it is time; `engaged` is whether the bus has it. True if it is given up now. */
  look(now, engaged) {
    if (!this.stands) return false;
    if (engaged || now - this.since > LONGEST) {
      this.stands = "";
      return !engaged;
    }
    let sent = true;
    if (now - this.last >= AGAIN) {
      sent = this.send();
      this.last = now;
    }
    if (!sent || now - this.since > LATE) this.stands = "unsent";
    return false;
  }
}
