// Bodies and liquids, where they are at a time, and which of them a pointer is on.

import * as THREE from "three";
import { key, value } from "../at";
import type { Contents, Document, Pose } from "../document";
import type { Player } from "../player";
import { Liquid } from "./liquid";
import { type Theme, liquid, material, newLiquid, quiet } from "./look";
import { Solids } from "./solids";

interface Fill {
    contents: Contents;
    liquid: Liquid;
}

export class Bench {
    readonly group = new THREE.Group();
    readonly bodies: THREE.Group[];
    private readonly document: Document;
    private readonly fills: Fill[] = [];
    private readonly ground: number | null;
    private readonly ray = new THREE.Raycaster();
    private theme: Theme;
    private marked: [number | null, number | null] = [null, null];

    constructor(
        private readonly player: Player,
        theme: Theme,
    ) {
        this.document = player.document;
        this.theme = theme;
        this.ground = this.largest();
        const solids = new Solids(this.document);
        this.bodies = this.document.bodies.map((body, index) => {
            const group = new THREE.Group();
            place(group, body.pose);
            for (const piece of body.pieces) {
                const mesh = new THREE.Mesh(solids.get(piece.solid), new THREE.MeshStandardMaterial());
                place(mesh, piece.pose);
                const clear = piece.finish === "glass" || piece.finish === "hull";
                const geometry = mesh.geometry;
                geometry.computeBoundingSphere();
                // Shadows of wells and tips are not worth what they cost.
                mesh.castShadow = piece.finish !== "hull" && geometry.boundingSphere!.radius > 0.022;
                mesh.receiveShadow = !clear;
                mesh.renderOrder = clear ? 2 : 0;
                mesh.userData = { body: index, piece, hull: piece.finish === "hull" };
                if (piece.finish === "hull" || ("cuboid" in piece.solid && piece.finish === "glass")) {
                    mesh.castShadow = false;
                    if ("cuboid" in piece.solid) mesh.add(outline(piece.solid.cuboid));
                }
                group.add(mesh);
            }
            this.group.add(group);
            return group;
        });
        for (const contents of this.document.contents) {
            const cavity = contents.body === null ? null : this.document.bodies[contents.body]!.cavity;
            if (!cavity || !contents.volume) continue;
            const made = new Liquid(cavity, newLiquid());
            made.mesh.userData = { body: contents.body, liquid: true };
            this.bodies[contents.body!]!.add(made.mesh);
            this.fills.push({ contents, liquid: made });
        }
        this.dress(theme);
        this.show();
    }

    /** Colours of a theme. */
    dress(theme: Theme): void {
        this.theme = theme;
        this.group.traverse((object) => {
            if (object instanceof THREE.LineSegments) (object.material as THREE.LineBasicMaterial).color.set(theme.line);
            const piece = object.userData["piece"];
            if (!(object instanceof THREE.Mesh) || !piece) return;
            const index = object.userData["body"] as number;
            const fallback = index === this.ground ? theme.bench : quiet(this.document.bodies[index]!.kind);
            (object.material as THREE.Material).dispose();
            object.material = material(piece, fallback, theme);
        });
        const marked = this.marked;
        this.marked = [null, null];
        this.mark(...marked);
        this.show();
    }

    /** Puts everything where it is now; says whether something is in another place than before. */
    show(): void {
        const time = this.player.time;
        for (const track of this.document.tracks) {
            const group = this.bodies[track.body];
            if (!group || track.poses.length === 0) continue;
            const { from, to, part } = key(track, time);
            place(group, track.poses[from]!);
            if (part > 0) {
                const [x, y, z, qx, qy, qz, qw] = track.poses[to]!;
                group.position.lerp(new THREE.Vector3(x, y, z), part);
                group.quaternion.slerp(new THREE.Quaternion(qx, qy, qz, qw), part);
            }
        }
        for (const { contents, liquid: body } of this.fills) {
            const [series, size] = contents.volume!;
            const volume = (value(this.document, series, time) ?? 0) * size;
            const back = this.bodies[contents.body!]!.quaternion.clone().invert();
            body.fill(volume, new THREE.Vector3(0, 0, 1).applyQuaternion(back));
            liquid(body.mesh.material, this.color(contents), this.theme);
        }
    }

    /** The colour of what is in a vessel now. */
    color(contents: Contents): [number, number, number] | null {
        if (!contents.color) return null;
        return contents.color.map((i) => Math.min(1, Math.max(0, value(this.document, i, this.player.time) ?? 1))) as [number, number, number];
    }

    /** The body under a point of the picture, -1 to 1, and where; what others stand in only where nothing else is. */
    pick(x: number, y: number, camera: THREE.Camera): { body: number; point: THREE.Vector3 } | null {
        this.ray.setFromCamera(new THREE.Vector2(x, y), camera);
        const hits = this.ray.intersectObject(this.group, true).filter((hit) => hit.object instanceof THREE.Mesh && hit.object.visible);
        const hit = hits.find((h) => !h.object.userData["hull"]) ?? hits[0];
        const body = hit?.object.userData["body"];
        return hit && typeof body === "number" ? { body, point: hit.point } : null;
    }

    /** Lets a body and another one stand out: selected, and under the pointer. */
    mark(selected: number | null, hovered: number | null): void {
        if (selected === this.marked[0] && hovered === this.marked[1]) return;
        for (const index of this.marked) if (index !== null) this.glow(index, 0);
        this.marked = [selected, hovered];
        if (hovered !== null && hovered !== this.ground) this.glow(hovered, 0.12);
        if (selected !== null) this.glow(selected, 0.3);
    }

    private glow(index: number, strength: number): void {
        for (const child of this.bodies[index]?.children ?? []) {
            if (!(child instanceof THREE.Mesh) || !child.userData["piece"]) continue;
            const surface = child.material as THREE.MeshStandardMaterial;
            surface.emissive.set(this.theme.accent);
            surface.emissiveIntensity = strength;
        }
    }

    bounds(index?: number): THREE.Box3 {
        this.group.updateMatrixWorld(true);
        const box = new THREE.Box3();
        const add = (body: THREE.Group) => body.children.forEach((child) => !child.userData["liquid"] && box.expandByObject(child));
        if (index !== undefined) add(this.bodies[index]!);
        else this.bodies.forEach(add);
        return box;
    }

    /** What a picture of the whole bench must show: all but what others stand in. */
    parts(): THREE.Box3[] {
        const inside = this.document.bodies.flatMap((body, i) => (body.pieces.some((p) => p.finish !== "hull") ? [i] : []));
        const all = inside.length ? inside : this.document.bodies.map((_, i) => i);
        return all.map((i) => this.bounds(i)).filter((box) => !box.isEmpty());
    }

    /** What everything else stands on: the largest body that is wide and flat. */
    get largestFlat(): number | null {
        return this.ground;
    }

    private largest(): number | null {
        let best: [number, number] | null = null;
        this.document.bodies.forEach((body, index) => {
            for (const { solid, finish } of body.pieces) {
                if (!("cuboid" in solid) || finish === "hull") continue;
                const [x, y, z] = solid.cuboid;
                if (z < 0.4 * Math.min(x, y) && x * y > 0.2 && x * y > (best?.[1] ?? 0)) best = [index, x * y];
            }
        });
        return best && (best as [number, number])[0];
    }
}

export function place(object: THREE.Object3D, [x, y, z, qx, qy, qz, qw]: Pose): void {
    object.position.set(x, y, z);
    object.quaternion.set(qx, qy, qz, qw);
}

function outline([x, y, z]: [number, number, number]): THREE.LineSegments {
    const lines = new THREE.LineSegments(
        new THREE.EdgesGeometry(new THREE.BoxGeometry(x, y, z)),
        new THREE.LineBasicMaterial({ transparent: true, opacity: 0.4 }),
    );
    lines.raycast = () => {};
    return lines;
}
