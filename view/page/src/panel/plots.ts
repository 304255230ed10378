// Curves over the time of the run, those of one unit together.

import uPlot from "uplot";
import { value } from "../at";
import type { Document, Series } from "../document";
import type { Player } from "../player";
import { clock, element, number, species, unit } from "../show";

const INKS_LIGHT = ["#1f7a8c", "#c2571a", "#5b6f1e", "#8d3b72", "#3d5a99", "#a8832a", "#4a4e52"];
const INKS_DARK = ["#5cc0d2", "#f0935a", "#a9c05a", "#d487bb", "#8aa6e6", "#dcb75e", "#b5bcc2"];
/** Units for which a run is plotted without being asked, and curves in each. */
const FIRST = 3;
const CURVES = 6;

export class Plots {
    private readonly shown = new Set<number>();
    private charts: uPlot[] = [];
    /** The marks of the moment that is shown, one a chart. */
    private heads: HTMLElement[] = [];
    private dark = false;

    constructor(
        private readonly player: Player,
        private readonly root: HTMLElement,
    ) {
        if (player.duration === 0) return;
        for (const i of choice(player.document)) this.shown.add(i);
        player.on(["time"], () => this.move());
        new ResizeObserver(() => this.charts.forEach((plot) => plot.setSize({ width: this.width(), height: plot.height }))).observe(root);
    }

    has(series: number): boolean {
        return this.shown.has(series);
    }

    toggle(series: number): void {
        if (!this.shown.delete(series)) this.shown.add(series);
        this.build();
        this.player.tell("series");
    }

    theme(dark: boolean): void {
        this.dark = dark;
        this.build();
    }

    private width(): number {
        return Math.max(120, this.root.clientWidth);
    }

    private build(): void {
        for (const plot of this.charts) plot.destroy();
        this.charts = [];
        this.root.replaceChildren();
        this.heads = [];
        if (this.player.duration === 0) return;
        const groups = new Map<string, number[]>();
        for (const i of this.shown) {
            const key = this.player.document.series[i]!.unit;
            groups.set(key, [...(groups.get(key) ?? []), i]);
        }
        this.root.append(element("h2", "", "Curves"));
        if (groups.size === 0) this.root.append(element("p", "empty", "Select a thing and click a value to plot it."));
        for (const [symbol, list] of groups) this.chart(symbol, list);
        this.bands();
        this.move();
    }

    private chart(symbol: string, list: number[]): void {
        const { document, duration } = this.player;
        const inks = this.dark ? INKS_DARK : INKS_LIGHT;
        const [ink, rule] = this.dark ? ["#8d979f", "#2b3136"] : ["#7b848b", "#e5e6e4"];
        const data = uPlot.join(
            list.map((i) => {
                const { axis, values } = document.series[i]!;
                return apart(document.axes[axis]!, values);
            }),
        );
        const legend = element("div", "legend");
        list.forEach((i, k) => {
            const item = element("button", "", element("i"), title(document.series[i]!));
            (item.firstChild as HTMLElement).style.background = inks[k % inks.length]!;
            item.title = `${document.series[i]!.name}: click to remove`;
            item.addEventListener("click", () => this.toggle(i));
            legend.append(item);
        });
        const box = element("div", "chart", element("div", "unit", unit(symbol) || "–"), legend);
        this.root.append(box);
        const font = "10.5px " + getComputedStyle(this.root).fontFamily;
        const axis = { stroke: ink, font, ticks: { show: false }, grid: { stroke: rule, width: 1 } };
        const plot: uPlot = new uPlot(
            {
                width: this.width(),
                height: 122,
                legend: { show: false },
                padding: [6, 16, 0, 0],
                scales: { x: { time: false, range: [0, duration] } },
                axes: [
                    { ...axis, size: 24, gap: 6, space: 42, grid: { show: false }, incrs: [0.1, 0.5, 1, 2, 5, 10, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 43200, 86400], values: (_, ticks) => ticks.map((t) => clock(t, 1e9)) },
                    { ...axis, size: 44, gap: 4, space: 26, values: (_, ticks) => ticks.map((t) => number(t)) },
                ],
                series: [{}, ...list.map((i, k) => ({ label: document.series[i]!.name, stroke: inks[k % inks.length]!, width: 1.5, points: { show: false }, spanGaps: true }))],
                cursor: { points: { size: 5 }, drag: { x: false, y: false }, y: false },
            },
            data as uPlot.AlignedData,
            box,
        );
        const head = element("div", "now");
        plot.over.append(head);
        const seek = (event: PointerEvent) => this.player.seek(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x"));
        plot.over.addEventListener("pointerdown", (event) => {
            this.player.play(false);
            plot.over.setPointerCapture(event.pointerId);
            seek(event);
        });
        plot.over.addEventListener("pointermove", (event) => plot.over.hasPointerCapture(event.pointerId) && seek(event));
        this.charts.push(plot);
        this.heads.push(head);
    }

    /** What colour the contents of each vessel had when, where it changed. */
    private bands(): void {
        const { document, duration } = this.player;
        const list = document.contents.filter((c) => {
            const part = c.body !== null && document.bodies[c.body]!.parent !== null;
            return !part && c.color?.some((i) => change(document.axes[document.series[i]!.axis]!, document.series[i]!.values) > 0.02);
        });
        if (list.length === 0) return;
        this.root.append(element("h2", "", "Colours"));
        const steps = 240;
        for (const contents of list.slice(0, CURVES)) {
            const band = element("canvas");
            [band.width, band.height] = [steps, 1];
            const ink = band.getContext("2d");
            for (let k = 0; ink && k < steps; k++) {
                const time = ((k + 0.5) / steps) * duration;
                const [r, g, b] = contents.color!.map((i) => Math.round(255 * Math.min(1, Math.max(0, value(document, i, time) ?? 1))));
                ink.fillStyle = `rgb(${r} ${g} ${b})`;
                ink.fillRect(k, 0, 1, 1);
            }
            const head = element("div", "now");
            const field = element("div", "field", band, head);
            field.addEventListener("pointerdown", (event) => {
                const box = field.getBoundingClientRect();
                this.player.seek(((event.clientX - box.left) / box.width) * duration);
            });
            const name = contents.body === null ? contents.name : document.bodies[contents.body]!.name;
            this.root.append(element("div", "band", element("span", "", name), field));
            this.heads.push(head);
        }
    }

    private move(): void {
        const part = `${(this.player.time / (this.player.duration || 1)) * 100}%`;
        for (const head of this.heads) head.style.left = part;
    }
}

/** Two values of one time, before and after a jump, moved apart by less than can be seen. */
function apart(times: number[], values: (number | null)[]): [number[], (number | null)[]] {
    const span = times.length ? times.at(-1)! - times[0]! : 0;
    const xs: number[] = [];
    for (const t of times) xs.push(xs.length && t <= xs.at(-1)! ? xs.at(-1)! + span * 1e-7 : t);
    return [xs, values];
}

function title(series: Series): string {
    return series.origin === "contents" ? series.name.replace(/\.contents\b/, "").replace(/\[([^\]]+)\]$/, (_, s: string) => ` ${species(s)}`) : series.name;
}

/** What is plotted at first: of each unit what moves most, of the units those that say most of the chemistry. */
function choice({ series, axes, contents, bodies }: Document): number[] {
    const colors = new Set(contents.flatMap((c) => c.color ?? []));
    // What is in parts that are not seen, such as pipettes, comes and goes.
    const passing = new Set(contents.filter((c) => c.body === null).flatMap((c) => c.groups.flatMap(([, list]) => list)));
    const rank = (s: Series) => {
        if (s.origin === "record" || s.origin === "reading") return 0;
        const part = s.body !== null && bodies[s.body]!.parent !== null;
        return s.origin === "contents" ? (part ? 2 : 1) : 3;
    };
    const moving = series.flatMap((s, i) => {
        // Colours have bands of their own, and amounts say again what concentrations say.
        if (colors.has(i) || isComponent(s) || s.name.includes(".amount[") || passing.has(i)) return [];
        const known = s.values.filter((v): v is number => v !== null);
        const most = Math.max(...known.map(Math.abs));
        const size = change(axes[s.axis]!, s.values);
        return known.length > 2 && size > 0.01 * most ? [{ i, size, part: size / most, rank: rank(s), unit: s.unit }] : [];
    });
    const units = new Map<string, typeof moving>();
    for (const one of moving) units.set(one.unit, [...(units.get(one.unit) ?? []), one]);
    const groups = [...units.values()].map((group) => {
        const first = Math.min(...group.map((m) => m.rank));
        const apt = group.filter((m) => m.rank <= Math.max(1, first));
        // A solvent that hardly moves would flatten everything else.
        const lively = apt.filter((m) => m.part > 0.2);
        const best = (lively.length ? lively : apt).sort((a, b) => b.size - a.size);
        return { first, best: best.slice(0, CURVES).map((m) => m.i) };
    });
    groups.sort((a, b) => a.first - b.first || b.best.length - a.best.length);
    // States of devices only where there is no chemistry.
    const said = groups.filter((g) => g.first < 3);
    return (said.length ? said : groups).slice(0, FIRST).flatMap((g) => g.best);
}

/** One number of a recorded tuple such as a colour. */
function isComponent(series: Series): boolean {
    return series.origin === "record" && series.unit === "" && /\.[123]$/.test(series.name);
}

/** How far a series moves: all of what it does little by little, a tenth of its jumps, nothing of the first instant. */
function change(times: number[], values: (number | null)[]): number {
    let sum = 0;
    for (let k = 1; k < values.length; k++) {
        const [a, b] = [values[k - 1] ?? null, values[k] ?? null];
        if (a === null || b === null || times[k]! <= times[0]!) continue;
        sum += Math.abs(b - a) * (times[k]! > times[k - 1]! ? 1 : 0.1);
    }
    return sum;
}
