// A liquid in a cavity: as high as its volume asks for, its surface level however the vessel is held.

import * as THREE from "three";
import type { Cavity } from "../document";

const AROUND = 40;
const LEVELS = 7;
const RINGS = 3;

/** The height of the surface for a volume, m; at most the brim. */
export function height(cavity: Cavity, volume: number): number {
    if ("boxed" in cavity) {
        const [[x, y, z], low] = cavity.boxed;
        return low + Math.min(z, volume / (x * y));
    }
    const line = cavity.round;
    let left = volume;
    for (let k = 0; k + 1 < line.length; k++) {
        const [[r0, z0], [r1, z1]] = [line[k]!, line[k + 1]!];
        const part = (z: number) => {
            const r = z1 > z0 ? r0 + ((r1 - r0) * (z - z0)) / (z1 - z0) : r0;
            return (Math.PI / 3) * (z - z0) * (r0 * r0 + r0 * r + r * r);
        };
        if (part(z1) < left) {
            left -= part(z1);
            continue;
        }
        let [low, high] = [z0, z1];
        for (let i = 0; i < 40; i++) {
            const middle = (low + high) / 2;
            if (part(middle) < left) low = middle;
            else high = middle;
        }
        return high;
    }
    return line.at(-1)![1];
}

export class Liquid {
    readonly mesh: THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>;
    private shown = "";

    constructor(
        private readonly cavity: Cavity,
        material: THREE.MeshStandardMaterial,
    ) {
        this.mesh = new THREE.Mesh(new THREE.BufferGeometry(), material);
        this.mesh.castShadow = height(cavity, Infinity) > 0.04;
        this.mesh.renderOrder = 1;
    }

    /** `up` is the lab's upward direction in the frame of the vessel. */
    fill(volume: number, up: THREE.Vector3): void {
        this.mesh.visible = volume > 0;
        if (volume <= 0) return;
        const level = height(this.cavity, volume);
        const lean = Math.max(0.25, up.z);
        const [sx, sy] = [-up.x / lean, -up.y / lean];
        const key = `${level.toFixed(5)} ${sx.toFixed(3)} ${sy.toFixed(3)}`;
        if (key === this.shown) return;
        this.shown = key;
        this.mesh.geometry.dispose();
        this.mesh.geometry = "boxed" in this.cavity ? boxed(this.cavity.boxed, level, sx, sy) : round(this.cavity.round, level, sx, sy);
    }
}

function boxed([[x, y, z], low]: [[number, number, number], number], level: number, sx: number, sy: number): THREE.BufferGeometry {
    const geometry = new THREE.BoxGeometry(x * 0.995, y * 0.995, 1);
    const at = geometry.getAttribute("position");
    for (let i = 0; i < at.count; i++) {
        const top = Math.min(low + z, Math.max(low, level + sx * at.getX(i) + sy * at.getY(i)));
        at.setZ(i, at.getZ(i) > 0 ? top : low);
    }
    geometry.computeVertexNormals();
    return geometry;
}

function round(line: [number, number][], level: number, sx: number, sy: number): THREE.BufferGeometry {
    const [low, high] = [line[0]![1], line.at(-1)![1]];
    const inner = (z: number) => {
        const k = Math.max(0, Math.min(line.length - 2, line.findLastIndex((p) => p[1] <= z)));
        const [[r0, z0], [r1, z1]] = [line[k]!, line[k + 1]!];
        return (z1 > z0 ? r0 + ((r1 - r0) * Math.min(1, (z - z0) / (z1 - z0))) : r1) * 0.995;
    };
    const positions: number[] = [];
    const indices: number[] = [];
    const stride = AROUND + 1;
    const surface = (r: number, c: number, s: number) => Math.min(high, Math.max(low + 1e-6, level + r * (sx * c + sy * s)));
    const ring = (point: (c: number, s: number) => [number, number, number]) => {
        for (let i = 0; i <= AROUND; i++) positions.push(...point(Math.cos((2 * Math.PI * i) / AROUND), Math.sin((2 * Math.PI * i) / AROUND)));
    };
    const join = (first: number, rows: number) => {
        for (let k = 0; k < rows; k++) {
            for (let i = 0; i < AROUND; i++) {
                const [a, b] = [first + k * stride + i, first + (k + 1) * stride + i];
                indices.push(a, a + 1, b, b, a + 1, b + 1);
            }
        }
    };
    // Bottom, wall and surface have vertices of their own, so that the edges between them stay sharp.
    ring(() => [0, 0, low]);
    for (let k = 0; k <= LEVELS; k++) {
        ring((c, s) => {
            const top = surface(inner(level), c, s);
            // Close to the bottom the wall curves most.
            const z = low + (top - low) * (k / LEVELS) ** 2;
            const r = inner(z);
            return [r * c, r * s, z];
        });
    }
    join(0, LEVELS + 1);
    const first = positions.length / 3;
    for (let k = RINGS; k >= 0; k--) {
        ring((c, s) => {
            const r = (inner(surface(inner(level), c, s)) * k) / RINGS;
            return [r * c, r * s, surface(r, c, s)];
        });
    }
    join(first, RINGS);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
    geometry.setIndex(indices);
    geometry.computeVertexNormals();
    return geometry;
}
