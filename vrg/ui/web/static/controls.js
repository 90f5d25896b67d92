// What a driver's hands hold: a stick on the screen, the keyboard, or a gamepad. Each needs to be held: a stick that is
// not touched, a key that is up, or a gamepad whose shoulder button is free commands nothing.

const DEAD_ZONE = 0.12;
const SLOW = 0.5;
const KEYS = {
  ArrowUp: [1, 0], KeyW: [1, 0], ArrowDown: [-1, 0], KeyS: [-1, 0], ArrowLeft: [0, 1], KeyA: [0, 1], ArrowRight: [0, -1], KeyD: [0, -1],
};
/** The shoulder buttons and the triggers of the standard gamepad. */
const DEADMAN = [4, 5], TURBO = [6, 7];

/** A deflection [right, down] of a stick, -1 to 1 each, as [ahead, left], with a radial dead zone. */
export function deflection(right, down) {
  const length = Math.hypot(right, down);
  if (length < DEAD_ZONE) return [0, 0];
  const share = (Math.min(1, length) - DEAD_ZONE) / (1 - DEAD_ZONE) / length;
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
  constructor(stick, knob) {
    this.stick = stick;
    this.knob = knob;
    this.held = new Set();
    this.fast = false;
    this.shift = false;
    this.touch = null;
    this.pointer = null;
    this.padIndex = null;
    this.padLost = false;
    stick.addEventListener("pointerdown", (event) => this.grab(event));
    stick.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) stick.addEventListener(name, (event) => this.free(event));
    window.addEventListener("gamepaddisconnected", ({ gamepad }) => {
      if (gamepad.index === this.padIndex) {
        this.padIndex = null;
        this.padLost = true;
      }
    });
  }

  /** Take in that a key went down; returns whether it steers. */
  press(code) {
    if (!(code in KEYS)) return false;
    this.held.add(code);
    return true;
  }

  release(code) {
    this.held.delete(code);
  }

  /** Hold nothing any more. */
  letGo() {
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
    this.touch = deflection(right, down);
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

  /** The gamepad whose shoulder button is held, or that was used last; null without one. */
  get pad() {
    const pads = [...(navigator.getGamepads?.() ?? [])].filter((pad) => pad?.connected);
    const held = (pad) => DEADMAN.some((button) => pad.buttons[button]?.pressed);
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
    const pad = this.pad, keys = [...this.held];
    let found = null, turbo = this.fast;
    if (this.touch) found = this.touch;
    else if (keys.length) {
      found = keysSum(keys);
      turbo ||= this.shift;
    } else if (pad && DEADMAN.some((button) => pad.buttons[button]?.pressed)) {
      found = deflection(pad.axes[0] ?? 0, pad.axes[1] ?? 0);
      turbo ||= TURBO.some((button) => pad.buttons[button]?.value > 0.5);
    }
    const share = turbo ? 1 : SLOW;
    return found && { forward: found[0] * share, turn: found[1] * share };
  }
}
