// In the browser: renders a scene before and after baking with three.js and compares the pixels.
import * as THREE from 'three';
import { DRACOLoader } from 'three/addons/loaders/DRACOLoader.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';

const renderer = new THREE.WebGLRenderer({ antialias: false });
renderer.toneMapping = THREE.NoToneMapping;
const draco = new DRACOLoader().setDecoderPath('/node_modules/three/examples/jsm/libs/draco/gltf/');
const loader = new GLTFLoader().setDRACOLoader(draco).setMeshoptDecoder(MeshoptDecoder);

const gradientWidth = 256; // of the occlusion texture that baking appends

function eachMaterial(root, visit) {
    root.traverse((object) => {
        if (object.isMesh)
            for (const material of [object.material].flat())
                visit(material, object);
    });
}

// Without lights of its own, glass and metal (which shows no ambient light), so that what is seen
// is the light of the test on the surfaces that were baked.
async function load(url) {
    const { scene } = await loader.loadAsync(url);
    scene.traverse((object) => { if (object.isLight) object.visible = false; });
    eachMaterial(scene, (material, mesh) => {
        mesh.visible &&= !material.transparent;
        mesh.frustumCulled = false;
        if (material.isMeshStandardMaterial)
            Object.assign(material, { metalness: 0, roughness: 1, metalnessMap: null, roughnessMap: null });
        material.emissive?.set(0);
    });
    const world = new THREE.Scene();
    world.add(scene);
    world.updateMatrixWorld(true);
    return world;
}

function isBaked(material) {
    return material.aoMap?.image?.width === gradientWidth && material.aoMap.image.height === 1;
}

// The same scene showing, instead of light, the u of the occlusion texture's set: the visibility as
// the file has it. 1 where nothing was baked on purpose; 2 where the file had an own texture.
function expectation(world) {
    const clone = world.clone(true);
    clone.traverse((mesh) => {
        if (!mesh.isMesh)
            return;
        const material = [mesh.material].flat()[0];
        const channel = material.aoMap?.channel;
        const uv = isBaked(material) ? mesh.geometry.getAttribute(channel ? `uv${channel}` : 'uv') : null;
        const count = mesh.geometry.getAttribute('position').count;
        const values = new Float32Array(count).fill(material.aoMap ? 2 : 1);
        for (let i = 0; uv && i < count; i++)
            values[i] = uv.getX(i);
        mesh.geometry = mesh.geometry.clone().setAttribute('expected', new THREE.BufferAttribute(values, 1));
        mesh.material = material.clone();
        mesh.material.onBeforeCompile = (shader) => {
            shader.vertexShader = `attribute float expected;\nvarying float vExpected;\n${shader.vertexShader}`
                .replace('#include <begin_vertex>', '#include <begin_vertex>\nvExpected = expected;');
            shader.fragmentShader = `varying float vExpected;\n${shader.fragmentShader}`
                .replace('#include <dithering_fragment>', 'gl_FragColor = vec4(vec3(vExpected), 1.0);');
        };
        mesh.material.customProgramCacheKey = () => 'expected';
    });
    return clone;
}

function withLights(world, lights) {
    const lit = new THREE.Scene();
    lit.add(...world.children.map((child) => child.clone(true)), ...lights);
    return lit;
}

function render(world, camera, size) {
    const target = new THREE.WebGLRenderTarget(size.width, size.height, { type: THREE.FloatType, colorSpace: THREE.NoColorSpace });
    const pixels = new Float32Array(4 * size.width * size.height);
    renderer.setRenderTarget(target);
    renderer.setClearColor(0x000000, 0);
    renderer.clear();
    renderer.render(world, camera);
    renderer.readRenderTargetPixels(target, 0, 0, size.width, size.height, pixels);
    renderer.setRenderTarget(null);
    target.dispose();
    return pixels;
}

function sun(strength = 2.5) {
    const light = new THREE.DirectionalLight(0xffffff, strength);
    light.position.set(0.4, 1, 0.7);
    return light;
}

function picture(pixels, size) {
    const canvas = Object.assign(document.createElement('canvas'), size);
    const context = canvas.getContext('2d');
    const image = context.createImageData(size.width, size.height);
    const encode = (x) => 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
    for (let y = 0; y < size.height; y++) {
        for (let x = 0; x < size.width; x++) {
            const from = 4 * ((size.height - 1 - y) * size.width + x), to = 4 * (y * size.width + x);
            const sky = pixels[from + 3] === 0;
            for (let c = 0; c < 3; c++)
                image.data[to + c] = sky ? 200 + 15 * c : encode(Math.min(1, Math.max(0, pixels[from + c])));
            image.data[to + 3] = 255;
        }
    }
    context.putImageData(image, 0, 0);
    return canvas.toDataURL('image/png');
}

function cameraFor(view, size) {
    const camera = new THREE.PerspectiveCamera(view.fov ?? 50, size.width / size.height, view.near, view.far);
    camera.position.set(...view.eye);
    camera.lookAt(...view.at);
    camera.updateMatrixWorld(true);
    return camera;
}

// From above at the corner of the bounds, for scans.
function viewOf(world) {
    const box = new THREE.Box3().setFromObject(world);
    const centre = box.getCenter(new THREE.Vector3()), radius = box.getSize(new THREE.Vector3()).length() / 2;
    const eye = centre.clone().add(new THREE.Vector3(0.5, 0.45, 0.9).normalize().multiplyScalar(1.5 * radius));
    return { eye: eye.toArray(), at: centre.toArray(), near: radius / 100, far: radius * 10 };
}

// Ratio of ambient light after to before, where there is any, beside the file's own value.
function compareAmbient(before, after, expected) {
    const ratios = [];
    for (let i = 0; i < before.length; i += 4) {
        if (before[i + 3] === 0 || after[i + 3] === 0 || !(expected[i] <= 1))
            continue;
        const sum = (pixels) => pixels[i] + pixels[i + 1] + pixels[i + 2];
        if (sum(before) > 0.02)
            ratios.push([sum(after) / sum(before), expected[i]]);
    }
    return ratios;
}

function correlation(pairs) {
    const mean = [0, 1].map((k) => pairs.reduce((sum, pair) => sum + pair[k], 0) / pairs.length);
    const moment = (a, b) => pairs.reduce((sum, p) => sum + (p[a] - mean[a]) * (p[b] - mean[b]), 0);
    return moment(0, 1) / Math.sqrt(moment(0, 0) * moment(1, 1));
}

function statistics(pairs) {
    const ratios = pairs.map((pair) => pair[0]).sort((a, b) => a - b);
    const errors = pairs.map((pair) => Math.abs(pair[0] - pair[1])).sort((a, b) => a - b);
    const at = (sorted, share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
    const open = pairs.filter((pair) => pair[1] > 0.98).map((pair) => pair[0]);
    const mean = (values) => values.reduce((sum, x) => sum + x, 0) / values.length;
    return { pixels: pairs.length, mean: mean(ratios), dark: at(ratios, 0.01), median: at(ratios, 0.5),
             bright: at(ratios, 0.99), open: open.length ? mean(open) : null, openPixels: open.length,
             meanError: mean(errors), error999: at(errors, 0.999), correlation: correlation(pairs) };
}

function largestDifference(a, b) {
    let largest = 0;
    for (let i = 0; i < a.length; i++)
        largest = Math.max(largest, Math.abs(Math.min(1, Math.max(0, a[i])) - Math.min(1, Math.max(0, b[i]))));
    return largest;
}

// The ratio at points of the world, as the camera sees them.
function ratiosAt(points, camera, size, before, after) {
    return points.map((point) => {
        const p = new THREE.Vector3(...point).project(camera);
        const x = Math.floor((p.x + 1) / 2 * size.width), y = Math.floor((p.y + 1) / 2 * size.height);
        const i = 4 * (y * size.width + x);
        return after[i] / before[i];
    });
}

// Three.js sorts by the materials' numbers, and with Draco these follow whichever worker was done
// first; where faces coincide, another order is another picture.
function fixDrawOrder(world) {
    let order = 0;
    world.traverse((object) => { object.renderOrder = order++; });
}

window.measure = async ({ before, after, view, points, size, replace }) => {
    const worlds = { before: await load(before), after: await load(after) };
    Object.values(worlds).forEach(fixDrawOrder);
    if (replace)
        eachMaterial(worlds.before, (material) => { material.aoMap = null; });
    const camera = cameraFor(view ?? viewOf(worlds.before), size);
    const shoot = (world, ...lights) => render(withLights(world, lights), camera, size);
    const ambient = (strength = 2.5) => new THREE.AmbientLight(0xffffff, strength);
    const images = {};
    for (const [name, world] of Object.entries(worlds)) {
        images[`${name}-ambient`] = shoot(world, ambient());
        images[`${name}-sun`] = shoot(world, sun());
        images[`${name}-both`] = shoot(world, ambient(1.5), sun(1.4));
    }
    const expected = render(expectation(worlds.after), camera, size);
    const pairs = compareAmbient(images['before-ambient'], images['after-ambient'], expected);
    let lit = 0;
    for (let i = 0; i < images['before-sun'].length; i += 4)
        lit += images['before-sun'][i] > 0.02;
    return { ...statistics(pairs), lit, covered: pairs.length / (size.width * size.height),
             sun: largestDifference(images['before-sun'], images['after-sun']),
             at: ratiosAt(points ?? [], camera, size, images['before-ambient'], images['after-ambient']),
             pictures: Object.fromEntries(Object.entries(images).map(([name, pixels]) => [name, picture(pixels, size)])) };
};
