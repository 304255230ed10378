// Reads the document and puts the page together.

import "uplot/dist/uPlot.min.css";
import { type Document, VERSION } from "./document";
import { value } from "./at";
import { Plan } from "./panel/plan";
import { Plots } from "./panel/plots";
import { Log, Source } from "./panel/text";
import { Things } from "./panel/things";
import { Player } from "./player";
import { Bench } from "./scene/bench";
import { Labels } from "./scene/labels";
import { DARK, LIGHT } from "./scene/look";
import { Stage } from "./scene/stage";
import { clock, element, put, quantity, species } from "./show";
import { Timeline } from "./timeline";
import "./page.css";

const find = (id: string) => window.document.getElementById(id)!;

function start(): void {
    const data = JSON.parse(find("document").textContent!) as Document;
    if (data.version !== VERSION) throw new Error(`this page reads documents of version ${VERSION}, this one is of version ${data.version}`);
    const player = new Player(data);
    const root = window.document.documentElement;
    const wanted = window.matchMedia("(prefers-color-scheme: dark)");
    let dark = wanted.matches;
    put(find("title"), data.workflow || data.lab);
    put(find("lab"), data.workflow ? data.lab : "");
    window.document.title = `${data.workflow || data.lab} – matterix`;
    outcome(data);
    if (data.duration === null) root.classList.add("unplayed");

    const stage = new Stage(find("stage"));
    const bench = new Bench(player, dark ? DARK : LIGHT);
    stage.scene.add(bench.group);
    stage.frame(bench.bounds(), bench.parts());
    const labels = new Labels(player, bench, stage, find("labels"));
    const plots = new Plots(player, find("plots"));
    new Plan(player, find("plan"));
    const source = new Source(player, find("source"));
    new Log(player, find("log"));
    new Things(player, bench, plots, find("things"));
    if (data.duration !== null) new Timeline(player, find("timeline"));

    const dress = () => {
        root.dataset["theme"] = dark ? "dark" : "light";
        stage.theme(dark ? DARK : LIGHT);
        bench.dress(dark ? DARK : LIGHT);
        plots.theme(dark);
        stage.draw(true);
    };
    wanted.addEventListener("change", () => {
        dark = wanted.matches;
        dress();
    });
    dress();

    let hovered: number | null = null;
    const hover = pointer(stage, bench, player, (body) => {
        hovered = body;
        bench.mark(player.selected, hovered);
        stage.draw();
    });
    player.on(["select"], () => {
        bench.mark(player.selected, hovered);
        stage.draw();
    });
    player.on(["time"], () => {
        bench.show();
        stage.draw(true);
        put(find("time"), clock(player.time, player.duration));
        if (!player.playing) hover();
    });
    player.on(["play"], () => {
        find("play").classList.toggle("on", player.playing);
        put(find("speed"), `${player.speed}×`);
    });
    player.tell("play");
    put(find("time"), clock(0, player.duration));
    put(find("duration"), clock(player.duration, player.duration));

    const tab = (name: string) => {
        for (const button of window.document.querySelectorAll<HTMLElement>("[data-tab]")) button.classList.toggle("on", button.dataset["tab"] === name);
        for (const id of ["plan", "source", "log"]) find(id).hidden = id !== name;
        if (name === "source") source.reveal();
    };
    const actions: Record<string, () => void> = {
        play: () => player.play(!player.playing),
        back: () => player.jump(false),
        next: () => player.jump(true),
        slower: () => player.faster(-1),
        faster: () => player.faster(1),
        fit: () => stage.look(null),
        labels: () => {
            labels.on = !labels.on;
            stage.draw();
        },
        theme: () => {
            dark = !dark;
            dress();
        },
        left: () => root.classList.toggle("no-left"),
        right: () => root.classList.toggle("no-right"),
        help: () => find("help").classList.toggle("shown"),
        plan: () => tab("plan"),
        source: () => tab("source"),
        log: () => tab("log"),
    };
    window.document.addEventListener("click", (event) => {
        const button = (event.target as Element).closest<HTMLElement>("[data-do]");
        if (button) actions[button.dataset["do"]!]?.();
        else if (find("help").classList.contains("shown")) actions["help"]!();
    });
    keys(player, actions);
    tab("plan");
    if (data.plan.length === 0) root.classList.add("no-left");

    const loop = (now: number) => {
        player.frame(now);
        if (stage.tick(now)) labels.show(hovered);
        requestAnimationFrame(loop);
    };
    requestAnimationFrame(loop);
    root.classList.add("ready");
}

function outcome(data: Document): void {
    if (data.duration === null) return;
    const missed = data.expectations.filter((e) => !e.passed).length;
    const failed = data.ended !== null && data.ended !== "done";
    const text = failed ? (data.ended === "failed" ? "failed" : "stopped") : missed ? `${missed} of ${data.expectations.length} expectations missed` : data.expectations.length ? "every expectation held" : "to the end";
    const chip = find("outcome");
    put(chip, text);
    chip.classList.add(failed || missed ? "bad" : "good");
}

/** What the mouse does on the bench: names under the pointer, a click selects, a double click goes near. */
function pointer(stage: Stage, bench: Bench, player: Player, changed: (body: number | null) => void): () => void {
    const canvas = stage.renderer.domElement;
    const tip = find("tip");
    let at: { x: number; y: number } | null = null;
    let body: number | null = null;
    let pressed: [number, number] | null = null;
    const under = (x: number, y: number) => {
        const box = canvas.getBoundingClientRect();
        return bench.pick(((x - box.left) / box.width) * 2 - 1, 1 - ((y - box.top) / box.height) * 2, stage.camera);
    };
    const show = () => {
        const { document: data, time } = player;
        const shown = body !== null && body !== bench.largestFlat && at !== null;
        tip.classList.toggle("shown", shown);
        if (!shown) return;
        const thing = data.bodies[body!]!;
        const lines = data.contents
            .filter((c) => c.body === body)
            .flatMap((c) => c.groups.filter(([group]) => group !== "amounts").flatMap(([, list]) => list))
            .map((i) => ({ i, now: value(data, i, time) }))
            .filter(({ now }) => now !== null && now !== 0)
            .slice(0, 6)
            .map(({ i, now }) => element("span", "line", element("span", "", species(data.series[i]!.label)), element("b", "", quantity(now, data.series[i]!.unit))));
        tip.replaceChildren(element("span", "title", thing.name, element("small", "", thing.kind)), ...lines);
        const box = canvas.getBoundingClientRect();
        const [x, y] = [at!.x - box.left, at!.y - box.top];
        tip.style.transform = `translate(${Math.min(x + 14, box.width - tip.offsetWidth - 8)}px, ${Math.min(y + 16, box.height - tip.offsetHeight - 8)}px)`;
    };
    canvas.addEventListener("pointermove", (event) => {
        if (event.buttons) {
            at = null;
            show();
            return;
        }
        at = { x: event.clientX, y: event.clientY };
        const next = under(at.x, at.y)?.body ?? null;
        if (next !== body) {
            body = next;
            changed(body);
        }
        canvas.style.cursor = body === null || body === bench.largestFlat ? "" : "pointer";
        show();
    });
    canvas.addEventListener("pointerleave", () => {
        at = null;
        body = null;
        changed(null);
        show();
    });
    canvas.addEventListener("pointerdown", (event) => (pressed = [event.clientX, event.clientY]));
    canvas.addEventListener("pointerup", (event) => {
        if (!pressed || Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4) return;
        const hit = under(event.clientX, event.clientY)?.body ?? null;
        player.select(hit === bench.largestFlat ? null : hit);
    });
    canvas.addEventListener("dblclick", (event) => {
        const hit = under(event.clientX, event.clientY);
        if (hit?.body === bench.largestFlat && hit) stage.approach(hit.point);
        else if (hit) stage.look(bench.bounds(hit.body));
    });
    return show;
}

function keys(player: Player, actions: Record<string, () => void>): void {
    const bound: Record<string, string> = { " ": "play", k: "play", f: "fit", l: "labels", t: "theme", "?": "help", "1": "plan", "2": "source", "3": "log", "[": "left", "]": "right", "-": "slower", "+": "faster", "=": "faster", p: "back", n: "next" };
    window.addEventListener("keydown", (event) => {
        if (event.ctrlKey || event.metaKey || event.altKey) return;
        const step = player.duration * (event.shiftKey ? 0.05 : 0.005);
        const action = bound[event.key];
        if (action) actions[action]!();
        else if (event.key === "ArrowLeft") player.seek(player.time - step);
        else if (event.key === "ArrowRight") player.seek(player.time + step);
        else if (event.key === "Home") player.seek(0);
        else if (event.key === "End") player.seek(player.duration);
        else if (event.key === "Escape") {
            if (find("help").classList.contains("shown")) actions["help"]!();
            else player.select(null);
        } else return;
        event.preventDefault();
    });
}

try {
    start();
} catch (error) {
    const text = error instanceof Error ? error.message : String(error);
    find("failure").textContent = /webgl/i.test(text) ? "This browser has no WebGL, which the picture is drawn with." : `The page cannot show this: ${text}`;
    window.document.documentElement.classList.add("failed");
    throw error;
}
