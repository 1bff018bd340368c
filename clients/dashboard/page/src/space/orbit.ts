// SPDX-License-Identifier: Apache-2.0
//
// The viewpoint. Only the user changes it.

/** rad. 0, 0 looks along −z from the user's side; `turn` > 0 moves to the right, `rise` > 0 up. */
export interface View {
  readonly turn: number;
  readonly rise: number;
  /** 1: the scene fills the picture. */
  readonly zoom: number;
}

export const kFirstView: View = { turn: 0.42, rise: 0.3, zoom: 1 };
const kHighest = 1.5;

export function turnedBy(view: View, turn: number, rise: number): View {
  return { ...view, turn: view.turn + turn, rise: Math.min(Math.max(view.rise + rise, -kHighest), kHighest) };
}

export function zoomedBy(view: View, factor: number): View {
  return { ...view, zoom: Math.min(Math.max(view.zoom * factor, 0.3), 12) };
}

/** Returns the grid in which `n` cells with aspect ratio `cell` are largest in a picture with aspect ratio `picture`.
 */
export function gridOf(n: number, cell: number, picture: number): { columns: number; rows: number } {
  let best = { columns: 1, rows: Math.max(n, 1), size: 0 };
  for (let columns = 1; columns <= n; ++columns) {
    const rows = Math.ceil(n / columns);
    const size = Math.min(picture / (columns * cell), 1 / rows);
    if (size > best.size * 1.001) best = { columns, rows, size };
  }
  return { columns: best.columns, rows: best.rows };
}

/** rad per pixel of a drag. */
const kTurnPerPixel = 0.008;

/**
 * Handles drags, wheel, touch and keys on `element`. One finger rotates only sideways, so that the page can still be
 * scrolled vertically; two fingers rotate and zoom. For the same reason, the wheel zooms only after a click on the
 * view.
 */
export class Orbit {
  view: View = kFirstView;
  readonly #fingers = new Map<number, { x: number; y: number }>();

  constructor(element: HTMLElement, readonly moved: () => void) {
    const set = (view: View): void => {
      this.view = view;
      this.moved();
    };
    element.addEventListener("pointerdown", (event) => {
      this.#fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      element.setPointerCapture(event.pointerId);
      element.focus({ preventScroll: true });
    });
    element.addEventListener("pointermove", (event) => {
      const before = this.#fingers.get(event.pointerId);
      if (!before) return;
      const others = [...this.#fingers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const [dx, dy] = [event.clientX - before.x, event.clientY - before.y];
      let view = this.view;
      if (others.length === 0) {
        view = turnedBy(view, -kTurnPerPixel * dx, event.pointerType === "touch" ? 0 : kTurnPerPixel * dy);
      } else {
        const other = others[0]!;
        const apart = (x: number, y: number): number => Math.max(Math.hypot(x - other.x, y - other.y), 10);
        // Each finger contributes half of the rotation.
        view = turnedBy(view, (-kTurnPerPixel * dx) / 2, (kTurnPerPixel * dy) / 2);
        view = zoomedBy(view, apart(event.clientX, event.clientY) / apart(before.x, before.y));
      }
      this.#fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      set(view);
    });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
      element.addEventListener(name, (event) => this.#fingers.delete(event.pointerId));
    }
    element.addEventListener("wheel", (event) => {
      if (document.activeElement !== element && !event.ctrlKey) return;
      event.preventDefault();
      set(zoomedBy(this.view, Math.exp(-event.deltaY / 500)));
    }, { passive: false });
    element.addEventListener("dblclick", () => set(kFirstView));
    element.addEventListener("keydown", (event) => {
      const step = 0.1;
      if (event.key === "ArrowLeft") set(turnedBy(this.view, -step, 0));
      else if (event.key === "ArrowRight") set(turnedBy(this.view, step, 0));
      else if (event.key === "ArrowUp") set(turnedBy(this.view, 0, step));
      else if (event.key === "ArrowDown") set(turnedBy(this.view, 0, -step));
      else if (event.key === "+" || event.key === "=") set(zoomedBy(this.view, 1.2));
      else if (event.key === "-") set(zoomedBy(this.view, 1 / 1.2));
      else if (event.key === "0" || event.key === "Home") set(kFirstView);
      else return;
      event.preventDefault();
    });
  }
}
