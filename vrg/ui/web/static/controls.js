// What a driver's hands hold: a stick on the screen, the keyboard, or a gamepad. Each needs to be held: a stick that is
// not touched, a key that is up, or a gamepad whose dead-man's switch is free commands nothing. The rules are those of the
// windows: the server sends them.

const KEYS = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, 1], ArrowRight: [0, -1] };
/** Buttons of the standard gamepad: A and B, and BACK. */
const AHEAD = 0, BACKWARD = 1, STOP = 8;

/** A deflection [right, down] of a stick, -1 to 1 each, as [ahead, left], with a radial dead zone. */
export function deflection(right, down, zone) {
  const length = Math.hypot(right, down);
  if (length <= zone) return [0, 0];
  const share = (Math.min(1, length) - zone) / (1 - zone) / length;
  return [-down * share || 0, -right * share || 0];
}

/** The sum of the keys that are held, as [ahead, left]. */
export function keysSum(held) {
  let forward = 0, turn = 0;
  for (const code of held) {
    forward += KEYS[code]?.[0] ?? 0;
    turn += KEYS[code]?.[1] ?? 0;
  }
  return [Math.max(-1, Math.min(1, forward)), Math.max(-1, Math.min(1, turn))];
}

export class Controls {
  /** `stop` engages the emergency stop; `lost` is called when the gamepad that was used last is gone. */
  constructor(stick, knob, stop, lost) {
    this.stick = stick;
    this.knob = knob;
    this.stop = stop;
    this.stopping = false;
    this.rules = { zone: 0, slow: 0, deadman: -1, turbo: -1, silence: 0 };
    this.held = new Set();
    /** The gamepad's switch must be free once before it counts again. */
    this.mustFree = false;
    this.fast = false;
    this.shift = false;
    this.touch = null;
    this.pointer = null;
    this.padIndex = null;
    this.padLost = false;
    /** The names of the gamepads whose buttons the browser does not know, so that none is taken for another. */
    this.unknown = [];
    stick.addEventListener("pointerdown", (event) => this.grab(event));
    stick.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) stick.addEventListener(name, (event) => this.free(event));
    window.addEventListener("gamepaddisconnected", ({ gamepad }) => {
      if (gamepad.index === this.padIndex) {
        this.padIndex = null;
        this.padLost = true;
        lost();
      }
    });
  }

  /** Take in that a key went down, or, if not `once`, that it still is; returns whether it steers. */
  press(code, once) {
    if (!(code in KEYS)) return false;
    if (once) this.held.add(code);
    return true;
  }

  release(code) {
    this.held.delete(code);
  }

  /** Hold nothing any more; what is still held then counts only when it was let go and is held again. */
  letGo() {
    this.mustFree = true;
    this.held.clear();
    this.shift = false;
    this.pointer = this.touch = null;
    this.place(0, 0);
  }

  grab(event) {
    if (this.pointer !== null) return;
    this.pointer = event.pointerId;
    this.stick.setPointerCapture(event.pointerId);
    this.move(event);
    event.preventDefault();
  }

  move(event) {
    if (event.pointerId !== this.pointer) return;
    const box = this.stick.getBoundingClientRect(), reach = 0.36 * Math.min(box.width, box.height);
    let right = (event.clientX - box.left - box.width / 2) / reach, down = (event.clientY - box.top - box.height / 2) / reach;
    const length = Math.max(1, Math.hypot(right, down));
    [right, down] = [right / length, down / length];
    this.touch = deflection(right, down, this.rules.zone);
    this.place(right * reach, down * reach);
  }

  free(event) {
    if (event.pointerId !== this.pointer) return;
    this.pointer = this.touch = null;
    this.place(0, 0);
  }

  place(x, y) {
    this.knob.style.transform = `translate(${x}px, ${y}px)`;
  }

  /** The gamepad whose dead-man's switch is held, or that was used last; null without one. BACK of any one stops all. */
  get pad() {
    const all = [...(navigator.getGamepads?.() ?? [])].filter((pad) => pad?.connected);
    const pads = all.filter((pad) => pad.mapping === "standard");
    this.unknown = all.filter((pad) => !pads.includes(pad)).map((pad) => pad.id);
    const held = (pad) => pad.buttons[this.rules.deadman]?.pressed;
    const stopping = pads.some((pad) => pad.buttons[STOP]?.pressed);
    if (stopping && !this.stopping) this.stop();
    this.stopping = stopping;
    const used = pads.find((pad) => pad.index === this.padIndex);
    const found = used && (held(used) || !pads.some(held)) ? used : (pads.find(held) ?? used ?? pads[0] ?? null);
    if (found && held(found)) {
      this.padIndex = found.index;
      this.padLost = false;
    }
    return found;
  }

  /** What the hands hold now: {forward, turn} from -1 to 1, or null if they hold nothing. */
  get hands() {
    const pad = this.pad, keys = [...this.held], switched = !!pad?.buttons[this.rules.deadman]?.pressed;
    let found = null, turbo = this.fast;
    // One whose battery is empty is held for ever, if only its dongle is plugged in.
    if (pad?.timestamp && performance.now() - pad.timestamp > 1000 * this.rules.silence) this.mustFree = true;
    // One that is not there, as after a reload, may come back with its switch held.
    this.mustFree &&= switched || !pad;
    if (this.touch) found = this.touch;
    else if (keys.length) {
      found = keysSum(keys);
      turbo ||= this.shift;
    } else if (switched && !this.mustFree) {
      found = deflection(pad.axes[0] ?? 0, pad.axes[1] ?? 0, this.rules.zone);
      found[0] += !!pad.buttons[AHEAD]?.pressed - !!pad.buttons[BACKWARD]?.pressed;
      found[0] = Math.max(-1, Math.min(1, found[0]));
      turbo ||= pad.buttons[this.rules.turbo]?.pressed;
    }
    const share = turbo ? 1 : this.rules.slow;
    return found && { forward: found[0] * share, turn: found[1] * share };
  }
}
