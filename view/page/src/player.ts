// The moment that is shown, what is selected, and who wants to know.

import type { Document } from "./document";

export const SPEEDS = [0.25, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000];
/** A run takes about as long as this to watch, s. */
const WATCH = 45;

type Change = "time" | "play" | "select" | "theme" | "series";

export class Player {
    time = 0;
    playing = false;
    speed: number;
    selected: number | null = null;
    readonly duration: number;
    private readonly listeners = new Map<Change, (() => void)[]>();
    private before = 0;

    constructor(readonly document: Document) {
        this.duration = document.duration ?? 0;
        const wanted = this.duration / WATCH;
        this.speed = SPEEDS.findLast((s) => s <= Math.max(1, wanted)) ?? 1;
    }

    on(changes: Change[], listener: () => void): void {
        for (const change of changes) {
            const list = this.listeners.get(change) ?? [];
            list.push(listener);
            this.listeners.set(change, list);
        }
    }

    tell(change: Change): void {
        for (const listener of this.listeners.get(change) ?? []) listener();
    }

    seek(time: number): void {
        const next = Math.min(this.duration, Math.max(0, time));
        if (next === this.time) return;
        this.time = next;
        this.tell("time");
    }

    play(on: boolean): void {
        if (this.duration === 0) return;
        if (on && this.time >= this.duration) this.seek(0);
        this.playing = on;
        this.before = 0;
        this.tell("play");
    }

    faster(steps: number): void {
        const i = SPEEDS.indexOf(this.speed) + steps;
        this.speed = SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, i))]!;
        this.tell("play");
    }

    select(body: number | null): void {
        if (body === this.selected) return;
        this.selected = body;
        this.tell("select");
    }

    /** Goes on by the browser's clock, ms. */
    frame(now: number): void {
        if (!this.playing) return;
        // After a pause of the browser itself the run does not jump.
        const step = this.before === 0 ? 0 : Math.min(1, (now - this.before) / 1000);
        this.before = now;
        this.seek(this.time + step * this.speed);
        if (this.time >= this.duration) this.play(false);
    }

    /** The next moment, or the one before, at which something in the plan begins. */
    jump(forward: boolean): void {
        const starts = this.document.plan.flatMap((node) => node.runs.map((run) => run.start));
        const slack = 1e-6 * Math.max(1, this.duration);
        const there = starts.filter((s) => (forward ? s > this.time + slack : s < this.time - slack));
        if (forward) this.seek(there.length ? Math.min(...there) : this.duration);
        else this.seek(there.length ? Math.max(...there) : 0);
    }
}
