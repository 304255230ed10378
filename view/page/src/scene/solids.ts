// Geometry of pieces, shared between those that are alike.

import * as THREE from "three";
import { RoundedBoxGeometry } from "three/addons/geometries/RoundedBoxGeometry.js";
import type { Document, Solid } from "../document";

export class Solids {
    private readonly known = new Map<string, THREE.BufferGeometry>();

    constructor(private readonly document: Document) {}

    get(solid: Solid): THREE.BufferGeometry {
        const key = JSON.stringify(solid);
        let geometry = this.known.get(key);
        if (!geometry) {
            geometry = this.make(solid);
            this.known.set(key, geometry);
        }
        return geometry;
    }

    private make(solid: Solid): THREE.BufferGeometry {
        if ("cuboid" in solid) {
            const [x, y, z] = solid.cuboid;
            const edge = Math.min(0.004, 0.12 * Math.min(x, y, z));
            return new RoundedBoxGeometry(x, y, z, 2, edge);
        }
        if ("cylinder" in solid) {
            const [r, l] = solid.cylinder;
            const edge = Math.min(0.003, 0.1 * r, 0.2 * l);
            const line: [number, number][] = [[0, -l / 2], [r - edge, -l / 2], [r, -l / 2 + edge], [r, l / 2 - edge], [r - edge, l / 2], [0, l / 2]];
            return lathe(line);
        }
        if ("sphere" in solid) return new THREE.SphereGeometry(solid.sphere, 32, 20);
        if ("capsule" in solid) return new THREE.CapsuleGeometry(solid.capsule[0], solid.capsule[1], 10, 32).rotateX(Math.PI / 2);
        if ("lathe" in solid) return lathe(solid.lathe);
        const [index, scale] = solid.mesh;
        const mesh = this.document.meshes[index]!;
        let geometry = new THREE.BufferGeometry();
        geometry.setAttribute("position", new THREE.Float32BufferAttribute(mesh.positions, 3));
        geometry.setIndex(mesh.indices);
        // Without shared corners every triangle is flat, which suits machined parts better than smeared edges.
        geometry = geometry.toNonIndexed();
        geometry.scale(...scale);
        geometry.computeVertexNormals();
        return geometry;
    }
}

/** Turns a line of radius and height about z; corners stay sharp. */
export function lathe(line: [number, number][], segments = 56): THREE.BufferGeometry {
    const positions: number[] = [];
    const normals: number[] = [];
    const indices: number[] = [];
    for (let k = 0; k + 1 < line.length; k++) {
        const [[r0, z0], [r1, z1]] = [line[k]!, line[k + 1]!];
        const length = Math.hypot(r1 - r0, z1 - z0);
        if (length < 1e-9) continue;
        const smooth = (other: [number, number] | undefined, at: [number, number], sign: number): [number, number] => {
            const own: [number, number] = [(z1 - z0) / length, -(r1 - r0) / length];
            if (!other) return own;
            const [dr, dz] = [sign * (at[0] - other[0]), sign * (at[1] - other[1])];
            const l = Math.hypot(dr, dz);
            if (l < 1e-9) return own;
            const next: [number, number] = [dz / l, -dr / l];
            if (own[0] * next[0] + own[1] * next[1] < 0.85) return own;
            const sum: [number, number] = [own[0] + next[0], own[1] + next[1]];
            const s = Math.hypot(...sum);
            return [sum[0] / s, sum[1] / s];
        };
        const ends = [
            { r: r0, z: z0, n: smooth(line[k - 1], line[k]!, 1) },
            { r: r1, z: z1, n: smooth(line[k + 2], line[k + 1]!, -1) },
        ];
        const first = positions.length / 3;
        for (const { r, z, n } of ends) {
            for (let i = 0; i <= segments; i++) {
                const [c, s] = [Math.cos((2 * Math.PI * i) / segments), Math.sin((2 * Math.PI * i) / segments)];
                positions.push(r * c, r * s, z);
                normals.push(n[0] * c, n[0] * s, n[1]);
            }
        }
        for (let i = 0; i < segments; i++) {
            const [a, b] = [first + i, first + segments + 1 + i];
            indices.push(a, a + 1, b, b, a + 1, b + 1);
        }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
    geometry.setAttribute("normal", new THREE.Float32BufferAttribute(normals, 3));
    geometry.setIndex(indices);
    return geometry;
}
