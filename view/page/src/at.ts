// What holds at a time.

import type { Document, Node, State, Track, Words } from "./document";

/** Index of the last entry that is not after `time`; -1 before the first. */
export function last(times: number[], time: number): number {
    let low = 0;
    let high = times.length;
    while (low < high) {
        const middle = (low + high) >> 1;
        if (times[middle]! <= time) low = middle + 1;
        else high = middle;
    }
    return low - 1;
}

/** The value of a series, on the straight line between its samples; `null` where there is none. */
export function value(document: Document, series: number, time: number): number | null {
    const { axis, values } = document.series[series]!;
    const times = document.axes[axis]!;
    const i = last(times, time);
    if (i < 0) return values[0] ?? null;
    const [a, b] = [values[i] ?? null, values[i + 1] ?? null];
    if (a === null || b === null || i + 1 >= times.length) return a;
    const span = times[i + 1]! - times[i]!;
    return span > 0 ? a + ((b - a) * (time - times[i]!)) / span : b;
}

export function word(words: Words, time: number): string {
    return words.words[Math.max(0, last(words.times, time))] ?? "";
}

/** Where between which keys of a track a time is. */
export function key(track: Track, time: number): { from: number; to: number; part: number } {
    const from = Math.max(0, last(track.times, time));
    const to = Math.min(from + 1, track.times.length - 1);
    const span = track.times[to]! - track.times[from]!;
    const part = track.smooth && span > 0 ? Math.min(1, Math.max(0, (time - track.times[from]!) / span)) : 0;
    return { from, to, part };
}

/** The state of a node; what takes no time has its last state from then on. */
export function state(node: Node, time: number): State | "pending" {
    let found: State | "pending" = "pending";
    for (const run of node.runs) {
        if (run.start > time) break;
        found = run.end === null ? (run.state === "running" ? "running" : run.state) : run.end > time ? "running" : run.state;
    }
    return found;
}
