// What is in the vessels; of what is selected, everything that is known.

import { value, word } from "../at";
import type { Contents } from "../document";
import type { Player } from "../player";
import type { Bench } from "../scene/bench";
import { element, number, put, quantity, species, unit } from "../show";
import type { Plots } from "./plots";

export class Things {
    private updates: (() => void)[] = [];

    constructor(
        private readonly player: Player,
        private readonly bench: Bench,
        private readonly plots: Plots,
        private readonly root: HTMLElement,
    ) {
        player.on(["select", "series"], () => this.build());
        player.on(["time"], () => this.show());
        this.build();
    }

    private show(): void {
        for (const update of this.updates) update();
    }

    private build(): void {
        this.updates = [];
        this.root.replaceChildren();
        if (this.player.selected === null) this.overview();
        else this.details(this.player.selected);
        this.show();
    }

    private of(body: number): Contents[] {
        // What is in a part that is not seen, such as a pipette, is told of what it is a part of.
        const { bodies, contents } = this.player.document;
        return contents.filter((c) => c.body === body || (c.body === null && c.name.startsWith(`${bodies[body]!.name}.`)));
    }

    /** A spot of the colour of a liquid; empty where there is none. */
    private spot(contents: Contents): HTMLElement {
        const spot = element("i", "spot");
        this.updates.push(() => {
            const listed = contents.groups.some(([, list]) => list.length > 0) ? 1 : 0;
            const volume = contents.volume ? value(this.player.document, contents.volume[0], this.player.time) : listed;
            const color = this.bench.color(contents);
            spot.classList.toggle("none", !volume);
            const ink = color && Math.min(...color) < 0.985 ? `rgb(${color.map((c) => Math.round(c * 255)).join(" ")})` : "";
            if (spot.style.backgroundColor !== ink) spot.style.backgroundColor = ink;
        });
        return spot;
    }

    private live(series: number): HTMLElement {
        const text = element("span", "value");
        const { document } = this.player;
        this.updates.push(() => put(text, quantity(value(document, series, this.player.time), document.series[series]!.unit)));
        return text;
    }

    private temperature(contents: Contents): number | null {
        const { series } = this.player.document;
        return contents.groups.flatMap(([, list]) => list).find((i) => /^(deg[CF]|K)$/.test(series[i]!.unit)) ?? null;
    }

    private overview(): void {
        const { bodies, contents } = this.player.document;
        const rows = element("div", "vessels");
        const grouped = new Set<number>();
        for (const one of contents) {
            if (one.body === null) continue;
            const parent = bodies[one.body]!.parent;
            if (parent !== null) {
                if (!grouped.has(parent)) rows.append(this.plate(parent));
                grouped.add(parent);
                continue;
            }
            const temperature = this.temperature(one);
            const row = element("button", "vessel", this.spot(one), element("span", "name", bodies[one.body]!.name));
            if (one.volume) row.append(this.live(one.volume[0]));
            if (temperature !== null) row.append(this.live(temperature));
            row.addEventListener("click", () => this.player.select(one.body));
            rows.append(row);
        }
        if (rows.childElementCount === 0) rows.append(element("p", "empty", "Click a thing to see what is known of it."));
        this.root.append(element("h2", "", "Contents"), rows);
    }

    /** The wells of a plate, seen from above. */
    private plate(parent: number): HTMLElement {
        const { bodies, contents } = this.player.document;
        const wells = contents.filter((c) => c.body !== null && bodies[c.body]!.parent === parent);
        const [xs, ys] = [wells.map((w) => bodies[w.body!]!.pose[0]), wells.map((w) => bodies[w.body!]!.pose[1])];
        const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
        const gaps = (list: number[]) => {
            const sorted = [...new Set(list.map((v) => v.toFixed(4)))].map(Number).sort((a, b) => a - b);
            return Math.min(...sorted.slice(1).map((v, i) => v - sorted[i]!));
        };
        const pitch = Math.min(gaps(xs), gaps(ys), 1);
        const map = element("div", "map");
        const columns = pitch < 1 ? (right - left) / pitch + 1 : 1;
        const rows = pitch < 1 ? (high - low) / pitch + 1 : 1;
        map.style.aspectRatio = `${columns} / ${rows}`;
        map.style.maxWidth = `${Math.min(264, columns * 22)}px`;
        for (const well of wells) {
            const spot = this.spot(well);
            const [x, y] = bodies[well.body!]!.pose;
            spot.style.left = `${(((x - left) / pitch + 0.5) / columns) * 100 || 50}%`;
            spot.style.top = `${(((high - y) / pitch + 0.5) / rows) * 100 || 50}%`;
            spot.style.width = `${(0.78 / columns) * 100}%`;
            spot.title = bodies[well.body!]!.name;
            spot.addEventListener("click", () => this.player.select(well.body));
            map.append(spot);
        }
        const name = element("button", "name", bodies[parent]!.name);
        name.addEventListener("click", () => this.player.select(parent));
        return element("div", "plate", element("div", "head", name, element("span", "value", wells.length === 1 ? "1 place" : `${wells.length} places`)), map);
    }

    private details(index: number): void {
        const { bodies, words, series } = this.player.document;
        const body = bodies[index]!;
        const close = element("button", "close", "×");
        close.title = "Back (Esc)";
        close.addEventListener("click", () => this.player.select(null));
        const title = element("h2", "", body.name, ...(body.kind ? [element("small", "", body.kind)] : []), close);
        this.root.append(title);
        const facts = element("dl", "facts");
        for (const one of words.filter((w) => w.body === index)) {
            const text = element("dd");
            this.updates.push(() => put(text, word(one, this.player.time)));
            facts.append(element("dt", "", one.name.startsWith(`${body.name}.`) ? one.name.slice(body.name.length + 1) : one.name), text);
        }
        for (const contents of this.of(index)) {
            for (const [group, list] of contents.groups) {
                const first = group === "properties";
                const whose = contents.body === null ? `${contents.name.slice(body.name.length + 1).replace(/\.contents$/, "")}: ${group}` : group;
                if (list.length) this.root.append(element("h3", "", ...(first ? [this.spot(contents)] : []), whose), this.table(list, first));
            }
        }
        const listed = new Set(this.of(index).flatMap((c) => c.groups.flatMap(([, list]) => list)));
        const others = series.flatMap((s, i) => (s.body === index && s.origin !== "contents" && !listed.has(i) ? [i] : []));
        if (others.length || facts.childElementCount) this.root.append(element("h3", "", "state"));
        if (others.length) this.root.append(this.table(others, true));
        if (facts.childElementCount) this.root.append(facts);
        const wells = this.player.document.contents.some((c) => c.body !== null && bodies[c.body]!.parent === index);
        if (wells) this.root.append(this.plate(index));
    }

    /** Names and values, each with a switch that plots it; species by what there is most of. */
    private table(list: number[], plain: boolean): HTMLElement {
        const { document } = this.player;
        const table = element("div", "table");
        const still = this.player.duration === 0;
        const rows = list.map((i) => {
            const { label, name, unit: symbol, origin } = document.series[i]!;
            const shown = element("span", "name", origin === "contents" ? species(label) : label);
            const amount = element("span", "value");
            const row = element("button", "row", shown, amount, element("span", "unit", unit(symbol)));
            row.title = still ? name : `${name}: click to plot`;
            row.classList.toggle("plotted", this.plots.has(i));
            row.disabled = still;
            row.addEventListener("click", () => this.plots.toggle(i));
            this.updates.push(() => put(amount, number(value(document, i, this.player.time))));
            return { i, row };
        });
        if (!plain) {
            const most = (i: number) => Math.max(...document.series[i]!.values.map((v) => v ?? 0));
            rows.sort((a, b) => most(b.i) - most(a.i));
        }
        table.append(...rows.map((r) => r.row));
        return table;
    }
}
