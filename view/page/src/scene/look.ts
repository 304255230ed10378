// Colours and materials.

import * as THREE from "three";
import type { Piece } from "../document";

export interface Theme {
    dark: boolean;
    paper: number;
    grid: number;
    bench: number;
    line: number;
    accent: number;
}

export const LIGHT: Theme = { dark: false, paper: 0xf4f4f2, grid: 0xb9bdc0, bench: 0xe4e1db, line: 0x6d7880, accent: 0x1f7a8c };
export const DARK: Theme = { dark: true, paper: 0x15181b, grid: 0x3a4046, bench: 0x4a4d50, line: 0x9aa5ad, accent: 0x4fb3c6 };

/** Of things without a colour, by their kind. */
const QUIET = [0xd9dee1, 0xb8c4cb, 0xc9cfc6, 0xd6cfc4, 0xa9b6bf, 0xc6c3cf];

export function quiet(kind: string): number {
    let sum = 7;
    for (const c of kind) sum = (sum * 31 + c.codePointAt(0)!) >>> 0;
    return QUIET[sum % QUIET.length]!;
}

/** Glass is seen at its edges, where one looks along the wall. */
function edged(material: THREE.MeshStandardMaterial): THREE.MeshStandardMaterial {
    material.onBeforeCompile = (shader) => {
        shader.fragmentShader = shader.fragmentShader.replace(
            "#include <opaque_fragment>",
            `float along = 1.0 - abs(dot(normalize(vViewPosition), normal));
            diffuseColor.a = clamp(diffuseColor.a + 0.75 * pow(along, 2.6), 0.0, 0.85);
            #include <opaque_fragment>`,
        );
    };
    return material;
}

export function material(piece: Piece, fallback: number, theme: Theme): THREE.MeshStandardMaterial {
    const [r, g, b, a] = piece.color ?? [0, 0, 0, 1];
    const color = piece.color ? new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace) : new THREE.Color(fallback);
    switch (piece.finish) {
        case "glass":
            return edged(
                new THREE.MeshStandardMaterial({
                    color: piece.color ? color : new THREE.Color(theme.dark ? 0xcfe3ea : 0xa9c0c8),
                    roughness: 0.08,
                    envMapIntensity: theme.dark ? 0.7 : 1,
                    transparent: true,
                    opacity: theme.dark ? 0.07 : 0.1,
                    side: THREE.DoubleSide,
                    depthWrite: false,
                }),
            );
        case "hull":
            return new THREE.MeshStandardMaterial({
                color: piece.color ? color : new THREE.Color(theme.dark ? 0x9fb2bc : 0x8fa1ab),
                roughness: 0.5,
                transparent: true,
                opacity: theme.dark ? 0.12 : 0.16,
                // Only the far walls, so that nothing veils what stands inside.
                side: THREE.BackSide,
                depthWrite: false,
            });
        case "metal":
            return new THREE.MeshStandardMaterial({ color: piece.color ? color : 0xc3c8cc, metalness: 0.85, roughness: 0.35 });
        case "matte":
            return new THREE.MeshStandardMaterial({ color, roughness: 0.55, transparent: a < 1, opacity: a });
    }
}

/** A liquid with the colour of light that went through it; what is clear has a breath of blue. */
export function liquid(target: THREE.MeshStandardMaterial, color: [number, number, number] | null, theme: Theme): void {
    const [r, g, b] = color ?? [1, 1, 1];
    // How much of the light is kept back.
    const taken = 1 - Math.min(r, g, b);
    const clear = new THREE.Color(theme.dark ? 0x9cc3d6 : 0x9fc7da);
    target.color.setRGB(r, g, b, THREE.SRGBColorSpace).lerp(clear, Math.max(0, 1 - taken * 6));
    target.opacity = 0.42 + 0.5 * Math.min(1, taken * 1.4);
}

export function newLiquid(): THREE.MeshStandardMaterial {
    return new THREE.MeshStandardMaterial({ roughness: 0.12, transparent: true, side: THREE.FrontSide, depthWrite: true });
}
