// Names beside what they belong to; where they would lie on each other, the nearer one is kept.

import * as THREE from "three";
import { value } from "../at";
import type { Player } from "../player";
import { element, put, quantity } from "../show";
import type { Bench } from "./bench";
import type { Stage } from "./stage";

interface Label {
    body: number;
    box: HTMLDivElement;
    name: HTMLSpanElement;
    line: HTMLSpanElement;
    /** Volume of what is in it. */
    series: number | null;
    top: THREE.Vector3;
    /** How far it reaches from its origin. */
    extent: THREE.Box3;
}

export class Labels {
    on = true;
    private readonly labels: Label[] = [];

    constructor(
        private readonly player: Player,
        private readonly bench: Bench,
        private readonly stage: Stage,
        private readonly place: HTMLElement,
    ) {
        const { bodies, contents } = player.document;
        bodies.forEach((body, index) => {
            if (body.parent !== null || index === bench.largestFlat || body.pieces.length === 0) return;
            const name = element("span", "name", body.name);
            const line = element("span", "line");
            const box = element("div", "tag", name, line);
            this.place.append(box);
            const series = contents.find((c) => c.body === index && c.volume)?.volume?.[0] ?? null;
            // The top in the frame of the body, so that the label goes with it.
            const bounds = bench.bounds(index);
            const top = new THREE.Vector3(0, 0, bounds.isEmpty() ? 0 : bounds.max.z - bench.bodies[index]!.position.z);
            const extent = bounds.isEmpty() ? bounds : bounds.translate(bench.bodies[index]!.position.clone().negate());
            this.labels.push({ body: index, box, name, line, series, top, extent });
        });
    }

    show(hovered: number | null): void {
        const { clientWidth: width, clientHeight: height } = this.place;
        const { document, time, selected } = this.player;
        const { camera } = this.stage;
        const seen = this.labels.map((label) => {
            const carries = this.carries(label);
            const at = this.bench.bodies[label.body]!.localToWorld(carries ? new THREE.Vector3() : label.top.clone());
            const depth = at.distanceTo(camera.position);
            at.project(camera);
            const first = label.body === selected || label.body === hovered;
            return { label, carries, x: (at.x + 1) * 0.5 * width, y: (1 - at.y) * 0.5 * height, behind: at.z > 1, order: first ? 0 : depth, first };
        });
        seen.sort((a, b) => a.order - b.order);
        const taken: [number, number, number, number][] = [];
        for (const { label, carries, x, y, behind, first } of seen) {
            const volume = label.series === null ? "" : quantity(value(document, label.series, time), document.series[label.series]!.unit);
            put(label.line, volume);
            const wide = 7 * Math.max(document.bodies[label.body]!.name.length, volume.length) + 14;
            const tall = volume ? 34 : 20;
            const above = carries ? y + 16 + tall : y - 6;
            const box: [number, number, number, number] = [x - wide / 2, above - tall, x + wide / 2, above];
            const free = taken.every((t) => box[0] > t[2] || box[2] < t[0] || box[1] > t[3] || box[3] < t[1]);
            const shown = !behind && (first || (this.on && free));
            if (shown) taken.push(box);
            label.box.classList.toggle("shown", shown);
            label.box.classList.toggle("first", first);
            if (shown) label.box.style.transform = `translate(${x.toFixed(1)}px, ${above.toFixed(1)}px) translate(-50%, -100%)`;
        }
    }

    /** Whether something stands on it now, so that its name goes below. */
    private carries({ body, extent }: Label): boolean {
        const below = this.bench.bodies[body]!.position;
        return this.labels.some((other) => {
            const [x, y, z] = this.bench.bodies[other.body]!.position.clone().sub(below).toArray();
            const within = x > extent.min.x && x < extent.max.x && y > extent.min.y && y < extent.max.y;
            return other.body !== body && within && Math.abs(z - extent.max.z) < 0.02;
        });
    }
}
