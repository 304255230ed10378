// The time line: what was done when, in lanes for what ran side by side; a place to scrub.

import { state } from "./at";
import type { Document } from "./document";
import type { Player } from "./player";
import { clock, element } from "./show";

interface Bar {
    node: number;
    start: number;
    end: number;
    lane: number;
    /** Below a bar of the lane, the steps it consists of. */
    inner: boolean;
    state: string;
}

const LANE = 26;

export class Timeline {
    private from = 0;
    private to: number;
    private readonly bars: [Bar, HTMLElement][] = [];
    private readonly ticks = element("div", "ticks");
    private readonly lanes = element("div", "lanes");
    private readonly marks = element("div", "marks");
    private readonly head = element("div", "head");
    private readonly area: HTMLElement;

    constructor(
        private readonly player: Player,
        root: HTMLElement,
    ) {
        this.to = player.duration;
        const { bars, lanes } = layout(player.document, player.duration);
        for (const bar of bars) {
            const label = player.document.plan[bar.node]!.label;
            const box = element("div", `bar ${bar.state}${bar.inner ? " inner" : ""}`, bar.inner ? "" : element("span", "", label));
            box.title = `${label}\n${clock(bar.start, player.duration)} – ${clock(bar.end, player.duration)}`;
            box.style.top = `${bar.lane * LANE + (bar.inner ? 19 : 2)}px`;
            this.lanes.append(box);
            this.bars.push([bar, box]);
        }
        this.lanes.style.height = `${Math.max(1, lanes) * LANE}px`;
        const scroll = element("div", "scroll", this.lanes);
        this.area = element("div", "area", this.ticks, scroll, this.marks, this.head);
        root.append(this.area);
        this.mark();
        this.listen();
        new ResizeObserver(() => this.arrange()).observe(root);
        player.on(["time"], () => this.show());
        this.arrange();
    }

    private mark(): void {
        const { log, expectations } = this.player.document;
        const add = (time: number, kind: string, text: string) => {
            const mark = element("div", `mark ${kind}`);
            mark.title = `${clock(time, this.player.duration)}  ${text}`;
            mark.dataset["time"] = String(time);
            mark.addEventListener("pointerdown", (event) => {
                event.stopPropagation();
                this.player.seek(time);
            });
            this.marks.append(mark);
        };
        for (const line of log) if (line.level !== "info") add(line.time, line.level, line.text);
        for (const e of expectations) add(e.time, e.passed ? "passed" : "missed", `expect ${e.text}`);
    }

    private listen(): void {
        const seek = (event: PointerEvent) => {
            const box = this.area.getBoundingClientRect();
            this.player.seek(this.from + ((event.clientX - box.left) / box.width) * (this.to - this.from));
        };
        this.area.addEventListener("pointerdown", (event) => {
            if (event.button !== 0) return;
            this.player.play(false);
            this.area.setPointerCapture(event.pointerId);
            seek(event);
        });
        this.area.addEventListener("pointermove", (event) => {
            if (this.area.hasPointerCapture(event.pointerId)) seek(event);
        });
        this.area.addEventListener("dblclick", () => this.zoom(0, this.player.duration));
        this.area.addEventListener(
            "wheel",
            (event) => {
                event.preventDefault();
                const box = this.area.getBoundingClientRect();
                const span = this.to - this.from;
                if (Math.abs(event.deltaX) > Math.abs(event.deltaY) || event.shiftKey) {
                    const by = ((event.deltaX || event.deltaY) / box.width) * span;
                    const from = Math.min(this.player.duration - span, Math.max(0, this.from + by));
                    this.zoom(from, from + span);
                    return;
                }
                const part = (event.clientX - box.left) / box.width;
                const at = this.from + part * span;
                const next = Math.min(this.player.duration, Math.max(this.player.duration * 1e-4, span * Math.exp(event.deltaY * 0.0015)));
                const from = Math.min(this.player.duration - next, Math.max(0, at - part * next));
                this.zoom(from, from + next);
            },
            { passive: false },
        );
    }

    private zoom(from: number, to: number): void {
        [this.from, this.to] = [from, to];
        this.arrange();
    }

    private arrange(): void {
        const width = this.area.clientWidth;
        const scale = width / (this.to - this.from || 1);
        const x = (time: number) => (time - this.from) * scale;
        for (const [bar, box] of this.bars) {
            const [a, b] = [Math.max(-4, x(bar.start)), Math.min(width + 4, x(bar.end))];
            const hidden = b < -2 || a > width + 2 || (bar.inner && b - a < 1);
            box.style.display = hidden ? "none" : "";
            if (hidden) continue;
            box.style.left = `${a}px`;
            box.style.width = `${Math.max(2, b - a - 1)}px`;
            box.classList.toggle("narrow", b - a < 34);
        }
        for (const mark of this.marks.children as HTMLCollectionOf<HTMLElement>) mark.style.left = `${x(Number(mark.dataset["time"]))}px`;
        this.ticks.replaceChildren();
        const step = tick(this.to - this.from, width);
        for (let t = Math.ceil(this.from / step) * step; t <= this.to + 1e-9; t += step) {
            const mark = element("span", "", clock(t, step < 1 ? 1 : 1e9));
            mark.style.left = `${x(t)}px`;
            if (x(t) < width - 30) this.ticks.append(mark);
        }
        this.show();
    }

    private show(): void {
        const { time } = this.player;
        const part = (time - this.from) / (this.to - this.from || 1);
        this.head.style.left = `${part * 100}%`;
        this.head.style.display = part < 0 || part > 1 ? "none" : "";
        for (const [bar, box] of this.bars) {
            const now = time >= bar.start && (time < bar.end || (bar.end === this.player.duration && time === bar.end));
            if (box.classList.contains("now") !== now) box.classList.toggle("now", now);
            const past = time >= bar.end;
            if (box.classList.contains("past") !== past) box.classList.toggle("past", past);
        }
    }
}

/** Time between two ticks, s, for some 110 px between them. */
function tick(span: number, width: number): number {
    const wanted = (span * 110) / Math.max(1, width);
    const steps = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 43200, 86400];
    return steps.find((s) => s >= wanted) ?? 86400 * Math.ceil(wanted / 86400);
}

/** Top steps in lanes; one whose own steps ran side by side gives its place to them. */
function layout(document: Document, duration: number): { bars: Bar[]; lanes: number } {
    const below: number[][] = document.plan.map(() => []);
    const tops: number[] = [];
    document.plan.forEach((node, i) => (node.parent === null ? tops : below[node.parent]!).push(i));
    const spans = (i: number) =>
        document.plan[i]!.runs.map((run) => ({ node: i, start: run.start, end: run.end ?? duration, state: state(document.plan[i]!, duration) as string }));
    const overlap = (list: { start: number; end: number }[]) => {
        const sorted = [...list].sort((a, b) => a.start - b.start);
        return sorted.some((s, k) => k > 0 && s.start < Math.max(...sorted.slice(0, k).map((p) => p.end)) - 1e-9 && s.end > s.start);
    };
    const open = (i: number): number[] => (overlap(below[i]!.flatMap(spans)) ? below[i]!.flatMap(open) : [i]);
    const shown = tops.flatMap(open).flatMap(spans).filter((s) => s.end > s.start);
    shown.sort((a, b) => a.start - b.start || b.end - a.end);
    const ends: number[] = [];
    const bars: Bar[] = [];
    for (const span of shown) {
        let lane = ends.findIndex((end) => end <= span.start + 1e-9);
        if (lane < 0) lane = ends.length;
        ends[lane] = span.end;
        bars.push({ ...span, lane, inner: false });
        for (const child of below[span.node]!.flatMap(spans)) {
            if (child.end > child.start && child.start >= span.start && child.end <= span.end) bars.push({ ...child, lane, inner: true });
        }
    }
    return { bars, lanes: ends.length };
}
