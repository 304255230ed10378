// The program, with the lines that are being carried out, and the log.

import { state } from "../at";
import type { Player } from "../player";
import { clock, element, file } from "../show";

export class Source {
    private readonly lines: HTMLElement[] = [];
    private lit = "";
    private readonly own: number;

    constructor(
        private readonly player: Player,
        root: HTMLElement,
    ) {
        const { sources, plan } = player.document;
        // The file of the workflow is that of its top steps.
        this.own = plan.find((node) => node.parent === null && node.place)?.place?.[0] ?? 0;
        const source = sources[this.own];
        if (!source?.text) {
            root.append(element("p", "empty", "The text of the program is not known."));
            return;
        }
        root.append(element("p", "file", file(source.name)));
        const code = element("pre", "code");
        for (const text of source.text.replace(/\n$/, "").split("\n")) {
            const line = element("span", "row", ...paint(text));
            code.append(line);
            this.lines.push(line);
        }
        root.append(code);
        player.on(["time"], () => this.show());
        this.show();
    }

    /** Brings the lit lines into view. */
    reveal(): void {
        const first = this.lines.find((line) => line.classList.contains("now"));
        first?.scrollIntoView({ block: "center" });
    }

    private show(): void {
        const { plan, duration } = this.player.document;
        if (duration === null) return;
        const inner = new Set<number>();
        const running = plan.map((node) => state(node, this.player.time) === "running");
        plan.forEach((node, i) => {
            if (!running[i] || node.place?.[0] !== this.own) return;
            inner.add(i);
            // Its own statement lights up, not all that are around it.
            for (let above = node.parent; above !== null; above = plan[above]!.parent) inner.delete(above);
        });
        const lit = new Set([...inner].map((i) => plan[i]!.place![1]));
        const key = [...lit].join();
        if (key === this.lit) return;
        this.lit = key;
        this.lines.forEach((line, i) => line.classList.toggle("now", lit.has(i + 1)));
        if (this.lines[0]?.offsetParent) this.lines[Math.min(...lit) - 1]?.scrollIntoView({ block: "nearest" });
    }
}

/** Comments and texts in quieter ink. */
function paint(line: string): (Node | string)[] {
    const comment = /^((?:[^"/]|"(?:[^"\\]|\\.)*"|\/(?!\/))*)(\/\/.*)$/.exec(line);
    const code = comment ? comment[1]! : line;
    const parts: (Node | string)[] = code.split(/("(?:[^"\\]|\\.)*")/).map((part) => (part.startsWith('"') ? element("span", "string", part) : part));
    if (comment) parts.push(element("span", "comment", comment[2]!));
    parts.push("\n");
    return parts;
}

export class Log {
    private readonly rows: [number, HTMLElement][] = [];

    constructor(
        private readonly player: Player,
        root: HTMLElement,
    ) {
        const { log, expectations, duration, sources, facts } = player.document;
        const place = (p: [number, number] | null) => (p && sources[p[0]] ? `${file(sources[p[0]]!.name)}:${p[1]}` : "");
        const lines = [
            ...log.map((l) => ({ time: l.time, kind: l.level as string, text: l.text, more: "", place: place(l.place) })),
            ...expectations.map((e) => ({ time: e.time, kind: e.passed ? "passed" : "missed", text: `expect ${e.text}`, more: e.found.join("  "), place: place(e.place) })),
        ].sort((a, b) => a.time - b.time);
        for (const line of lines) {
            const text = element("span", "text", line.text, ...(line.more ? [element("small", "", line.more)] : []));
            const box = element("div", `entry ${line.kind}`, element("span", "when", clock(line.time, duration ?? 0)), text);
            box.title = line.place;
            box.addEventListener("click", () => player.seek(line.time));
            root.append(box);
            this.rows.push([line.time, box]);
        }
        if (lines.length === 0) root.append(element("p", "empty", "Nothing was said."));
        if (facts.length) {
            const list = element("dl", "facts");
            for (const [name, value] of facts) list.append(element("dt", "", name), element("dd", "", value));
            root.append(list);
        }
        player.on(["time"], () => this.show());
        this.show();
    }

    private show(): void {
        for (const [time, box] of this.rows) box.classList.toggle("ahead", time > this.player.time);
    }
}
