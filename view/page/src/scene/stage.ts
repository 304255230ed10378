// Renderer, camera, light and floor. Draws only when something has changed.

import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { RoomEnvironment } from "three/addons/environments/RoomEnvironment.js";
import type { Theme } from "./look";

export class Stage {
    readonly scene = new THREE.Scene();
    readonly camera = new THREE.PerspectiveCamera(32, 1, 0.01, 200);
    readonly renderer: THREE.WebGLRenderer;
    readonly controls: OrbitControls;
    private readonly sun = new THREE.DirectionalLight(0xffffff, 2.1);
    private readonly sky = new THREE.HemisphereLight(0xffffff, 0x9a948c, 0.35);
    private readonly floor: THREE.Mesh<THREE.PlaneGeometry, THREE.ShaderMaterial>;
    private readonly shade: THREE.Mesh<THREE.PlaneGeometry, THREE.ShadowMaterial>;
    private readonly bounds = new THREE.Box3(new THREE.Vector3(-0.5, -0.5, 0), new THREE.Vector3(0.5, 0.5, 0.5));
    private parts: THREE.Box3[] = [];
    private flight: { from: THREE.Vector3[]; to: THREE.Vector3[]; start: number } | null = null;
    private dirty = true;
    private shadows = true;

    constructor(private readonly place: HTMLElement) {
        this.renderer = new THREE.WebGLRenderer({ antialias: true });
        this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
        this.renderer.toneMapping = THREE.NeutralToneMapping;
        this.renderer.shadowMap.enabled = true;
        this.renderer.shadowMap.type = THREE.PCFShadowMap;
        this.renderer.shadowMap.autoUpdate = false;
        place.append(this.renderer.domElement);

        const light = new THREE.PMREMGenerator(this.renderer);
        this.scene.environment = light.fromScene(new RoomEnvironment(), 0.04).texture;
        light.dispose();
        this.sun.castShadow = true;
        this.sun.shadow.mapSize.set(2048, 2048);
        this.sun.shadow.radius = 5;
        this.sun.shadow.bias = -0.0004;
        this.sun.shadow.normalBias = 0.004;

        this.camera.up.set(0, 0, 1);
        this.controls = new OrbitControls(this.camera, this.renderer.domElement);
        this.controls.enableDamping = true;
        this.controls.dampingFactor = 0.12;
        this.controls.maxPolarAngle = 0.495 * Math.PI;
        this.controls.zoomToCursor = true;
        this.controls.addEventListener("change", () => this.draw());
        this.controls.addEventListener("start", () => (this.flight = null));

        this.floor = new THREE.Mesh(new THREE.PlaneGeometry(1, 1), grid());
        this.shade = new THREE.Mesh(new THREE.PlaneGeometry(1, 1), new THREE.ShadowMaterial({ opacity: 0.2 }));
        this.shade.receiveShadow = true;
        this.scene.add(this.sun, this.sun.target, this.sky, this.floor, this.shade);
        new ResizeObserver(() => this.resize()).observe(place);
        this.resize();
    }

    theme(theme: Theme): void {
        this.scene.background = new THREE.Color(theme.paper);
        this.floor.material.uniforms["ink"]!.value = new THREE.Color(theme.grid);
        this.shade.material.opacity = theme.dark ? 0.45 : 0.2;
        this.scene.environmentIntensity = theme.dark ? 0.38 : 0.55;
        this.sun.intensity = theme.dark ? 1.7 : 2.1;
        this.renderer.toneMappingExposure = theme.dark ? 0.85 : 1;
        this.draw();
    }

    /** Light and floor for what is within these bounds, seen as a whole. */
    frame(bounds: THREE.Box3, parts: THREE.Box3[]): void {
        if (bounds.isEmpty()) return;
        this.parts = parts;
        this.bounds.copy(bounds);
        const middle = bounds.getCenter(new THREE.Vector3());
        const reach = bounds.getSize(new THREE.Vector3()).length() / 2;
        const low = bounds.min.z - 0.0005;
        this.floor.position.set(middle.x, middle.y, low - 0.0005);
        this.floor.scale.setScalar(reach * 12);
        (this.floor.material.uniforms["reach"]!.value as number) = reach;
        (this.floor.material.uniforms["middle"]!.value as THREE.Vector2).set(middle.x, middle.y);
        this.shade.position.set(middle.x, middle.y, low);
        this.shade.scale.setScalar(reach * 6);
        this.sun.position.copy(middle).add(new THREE.Vector3(-0.55, -0.75, 1.6).multiplyScalar(reach * 1.6));
        this.sun.target.position.copy(middle);
        const camera = this.sun.shadow.camera;
        Object.assign(camera, { left: -reach * 1.15, right: reach * 1.15, top: reach * 1.15, bottom: -reach * 1.15, near: reach * 0.2, far: reach * 6 });
        camera.updateProjectionMatrix();
        this.controls.minDistance = reach * 0.04;
        this.controls.maxDistance = reach * 8;
        this.camera.near = reach * 0.01;
        this.camera.far = reach * 40;
        this.look(bounds, true);
    }

    /** Turns to the whole bench, or to a part of it. */
    look(bounds: THREE.Box3 | null, whole = bounds === null): void {
        const parts = whole ? this.parts : [bounds ?? this.bounds];
        const direction = whole
            ? new THREE.Vector3(0.48, -1, 0.62).normalize()
            : this.camera.position.clone().sub(this.controls.target).normalize();
        const { middle, distance } = this.fit(parts, direction);
        const most = this.fit(this.parts, direction).distance;
        const to = [middle.clone().addScaledVector(direction, whole ? distance * 1.08 : Math.min(distance * 2.6, most)), middle];
        if (bounds !== null && whole) {
            this.camera.position.copy(to[0]!);
            this.controls.target.copy(middle);
            this.controls.update();
        } else {
            this.fly(to);
        }
        this.draw();
    }

    /** Goes half the way to a point, and turns about it from then on. */
    approach(point: THREE.Vector3): void {
        const back = this.camera.position.clone().sub(this.controls.target).multiplyScalar(0.5);
        this.fly([point.clone().add(back), point.clone()]);
    }

    private fly(to: THREE.Vector3[]): void {
        this.flight = { from: [this.camera.position.clone(), this.controls.target.clone()], to, start: performance.now() };
        this.draw();
    }

    /** The point to look at, and from how far away, so that all corners are in the picture and fill it evenly. */
    private fit(parts: THREE.Box3[], direction: THREE.Vector3): { middle: THREE.Vector3; distance: number } {
        const side = new THREE.Vector3(0, 0, 1).cross(direction).normalize();
        const up = direction.clone().cross(side);
        const tall = Math.tan((this.camera.fov * Math.PI) / 360);
        const wide = tall * this.camera.aspect;
        const corners = parts.flatMap(({ min, max }) =>
            Array.from({ length: 8 }, (_, i) => new THREE.Vector3(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z)),
        );
        // The eye that just sees all of them, by axis: each corner asks for a distance along either edge of the picture.
        const reach = (axis: THREE.Vector3, slope: number, sign: number) => Math.max(...corners.map((c) => sign * c.dot(axis) + slope * c.dot(direction)));
        const [right, left] = [reach(side, wide, 1), reach(side, wide, -1)];
        const [top, bottom] = [reach(up, tall, 1), reach(up, tall, -1)];
        const eye = Math.max((right + left) / (2 * wide), (top + bottom) / (2 * tall));
        const near = Math.max(...corners.map((c) => c.dot(direction)));
        const far = Math.min(...corners.map((c) => c.dot(direction)));
        const depth = (near + far) / 2;
        const middle = new THREE.Vector3()
            .addScaledVector(side, (right - left) / 2)
            .addScaledVector(up, (top - bottom) / 2)
            .addScaledVector(direction, depth);
        return { middle, distance: Math.max(0.05, eye - depth) };
    }

    /** Asks for a picture; `shadows` where something in it has moved. */
    draw(shadows = false): void {
        this.dirty = true;
        this.shadows ||= shadows;
    }

    /** Draws if need be; says whether it did. */
    tick(now: number): boolean {
        if (this.flight) {
            const part = Math.min(1, (now - this.flight.start) / 450);
            const eased = part * part * (3 - 2 * part);
            this.camera.position.lerpVectors(this.flight.from[0]!, this.flight.to[0]!, eased);
            this.controls.target.lerpVectors(this.flight.from[1]!, this.flight.to[1]!, eased);
            if (part >= 1) this.flight = null;
            this.dirty = true;
        }
        this.controls.update();
        if (!this.dirty) return false;
        this.dirty = false;
        if (this.shadows) this.renderer.shadowMap.needsUpdate = true;
        this.shadows = false;
        this.renderer.render(this.scene, this.camera);
        return true;
    }

    private resize(): void {
        const { clientWidth: width, clientHeight: height } = this.place;
        if (width === 0 || height === 0) return;
        this.renderer.setSize(width, height);
        this.camera.aspect = width / height;
        this.camera.updateProjectionMatrix();
        this.draw(true);
    }
}

/** Lines every 0.1 m and, stronger, every 1 m, that fade with the distance from the bench. */
function grid(): THREE.ShaderMaterial {
    return new THREE.ShaderMaterial({
        transparent: true,
        depthWrite: false,
        uniforms: { ink: { value: new THREE.Color() }, reach: { value: 1 }, middle: { value: new THREE.Vector2() } },
        vertexShader: `
            varying vec2 at;
            void main() {
                vec4 world = modelMatrix * vec4(position, 1.0);
                at = world.xy;
                gl_Position = projectionMatrix * viewMatrix * world;
            }`,
        fragmentShader: `
            uniform vec3 ink;
            uniform float reach;
            uniform vec2 middle;
            varying vec2 at;
            float lines(float pitch, float width) {
                vec2 scaled = at / pitch;
                vec2 step = fwidth(scaled);
                vec2 off = abs(fract(scaled - 0.5) - 0.5) / step;
                float line = 1.0 - min(min(off.x, off.y) / width, 1.0);
                return line * (1.0 - smoothstep(0.15, 0.5, max(step.x, step.y)));
            }
            void main() {
                float far = distance(at, middle) / reach;
                float fade = 1.0 - smoothstep(0.9, 3.6, far);
                float alpha = max(0.3 * lines(0.1, 1.0), 0.8 * lines(1.0, 1.2)) * fade;
                gl_FragColor = vec4(ink, alpha);
                #include <colorspace_fragment>
            }`,
    });
}
