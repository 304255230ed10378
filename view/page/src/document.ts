// The document as `view/src/document.rs` writes it; its comments say what each field means.

export const VERSION = 1;

export type Pose = [number, number, number, number, number, number, number];
export type Place = [source: number, line: number] | null;
export type State = "running" | "done" | "failed" | "skipped";

export interface Document {
    version: number;
    workflow: string;
    lab: string;
    duration: number | null;
    ended: State | null;
    facts: [string, string][];
    bodies: Body[];
    meshes: { positions: number[]; indices: number[] }[];
    tracks: Track[];
    contents: Contents[];
    axes: number[][];
    series: Series[];
    words: Words[];
    plan: Node[];
    log: LogLine[];
    expectations: Expectation[];
    sources: { name: string; text: string }[];
}

export interface Body {
    name: string;
    kind: string;
    parent: number | null;
    pose: Pose;
    pieces: Piece[];
    cavity: Cavity | null;
    frames: { name: string; pose: Pose }[];
}

export interface Piece {
    pose: Pose;
    solid: Solid;
    finish: "matte" | "metal" | "glass" | "hull";
    color: [number, number, number, number] | null;
}

export type Solid =
    | { cuboid: [number, number, number] }
    | { cylinder: [radius: number, length: number] }
    | { sphere: number }
    | { capsule: [radius: number, length: number] }
    | { lathe: [radius: number, height: number][] }
    | { mesh: [index: number, scale: [number, number, number]] };

export type Cavity = { round: [radius: number, height: number][] } | { boxed: [[number, number, number], number] };

export interface Track {
    body: number;
    times: number[];
    poses: Pose[];
    smooth: boolean;
}

export interface Contents {
    name: string;
    body: number | null;
    volume: [series: number, size: number] | null;
    color: [number, number, number] | null;
    groups: [title: string, series: number[]][];
}

export interface Series {
    name: string;
    label: string;
    body: number | null;
    origin: "state" | "contents" | "reading" | "record";
    unit: string;
    axis: number;
    values: (number | null)[];
}

export interface Words {
    name: string;
    body: number | null;
    times: number[];
    words: string[];
}

export interface Node {
    parent: number | null;
    label: string;
    place: Place;
    runs: { start: number; end: number | null; state: State }[];
}

export interface LogLine {
    time: number;
    level: "info" | "warning" | "error";
    text: string;
    place: Place;
}

export interface Expectation {
    time: number;
    text: string;
    passed: boolean;
    found: string[];
    place: Place;
}
