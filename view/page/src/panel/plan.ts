// The workflow as a tree: what runs is marked, a click goes to when it began.

import { state } from "../at";
import type { Player } from "../player";
import { clock, element } from "../show";

interface Row {
    box: HTMLLIElement;
    line: HTMLDivElement;
    state: string;
}

export class Plan {
    private readonly rows: Row[] = [];
    private followed: Row | null = null;

    constructor(
        private readonly player: Player,
        root: HTMLElement,
    ) {
        const { plan, duration } = player.document;
        const list = element("ul", "tree");
        const lists: HTMLUListElement[] = [];
        plan.forEach((node, i) => {
            const done = node.runs.filter((run) => run.state !== "skipped");
            const start = done[0]?.start;
            const fold = element("button", "fold");
            fold.tabIndex = -1;
            const times = done.length > 1 ? ` ×${done.length}` : "";
            const when = element("span", "when", start === undefined ? "" : clock(start, duration ?? 0) + times);
            const label = element("span", "label", node.label);
            const line = element("div", "line", fold, element("i", "dot"), label, when);
            line.title = node.label;
            line.tabIndex = duration === null ? -1 : 0;
            const box = element("li", "", line);
            const inner = element("ul");
            lists[i] = inner;
            const parent = node.parent === null ? null : this.rows[node.parent]!;
            if (parent) {
                if (!lists[node.parent!]!.parentElement) {
                    parent.box.append(lists[node.parent!]!);
                    parent.box.classList.add("parent", "closed");
                }
                lists[node.parent!]!.append(box);
            } else list.append(box);
            const toggle = () => box.classList.toggle("closed");
            fold.addEventListener("click", (event) => {
                event.stopPropagation();
                toggle();
            });
            const go = () => {
                // Of several turns the next one, then again the first.
                const next = done.find((run) => run.start > player.time + 1e-9) ?? done[0];
                if (next) player.seek(next.start);
            };
            line.addEventListener("click", go);
            line.addEventListener("keydown", (event) => {
                if (event.key === "Enter") go();
                else if (event.key === "ArrowRight" || event.key === "ArrowLeft") {
                    box.classList.toggle("closed", event.key === "ArrowLeft");
                    event.stopPropagation();
                    event.preventDefault();
                } else if (event.key === "ArrowDown" || event.key === "ArrowUp") {
                    const seen = [...root.querySelectorAll<HTMLElement>(".line")].filter((l) => l.offsetParent);
                    seen[seen.indexOf(line) + (event.key === "ArrowDown" ? 1 : -1)]?.focus();
                    event.preventDefault();
                }
            });
            this.rows.push({ box, line, state: "" });
        });
        // What ran side by side is worth seeing at once.
        plan.forEach((node, i) => {
            if (node.parent === null && node.runs.length > 0 && lists[i]!.children.length > 1 && plan.length < 30) this.rows[i]!.box.classList.remove("closed");
        });
        root.append(plan.length ? list : element("p", "empty", "No workflow."));
        if (duration === null) root.classList.add("still");
        player.on(["time"], () => this.show());
        this.show();
    }

    private show(): void {
        const { plan, duration } = this.player.document;
        if (duration === null) return;
        let current: Row | null = null;
        plan.forEach((node, i) => {
            const row = this.rows[i]!;
            const now = state(node, this.player.time);
            if (now !== row.state) {
                row.state = now;
                row.box.dataset["state"] = now;
            }
            if (now === "running" && row.line.offsetParent) current = row;
        });
        if (current === this.followed) return;
        this.followed?.line.classList.remove("current");
        this.followed = current as Row | null;
        this.followed?.line.classList.add("current");
        this.followed?.line.scrollIntoView({ block: "nearest" });
    }
}
