// The Khronos validator on every input and on what was baked from it (bake.mjs): no error or
// warning may appear that the input did not have at the same place. What was refused must be wrong
// by the validator's judgement too, or be on the list of reasons below.
import fs from 'node:fs';
import path from 'node:path';
import { Verdict, inParallel, lacking, needModule, output, skip } from './lib/setup.mjs';
import { accessorRows, bufferBytes, members, readGltf } from './lib/gltf.mjs';

const validator = await needModule('gltf-validator');
const folder = path.join(output, 'baked');
if (!fs.existsSync(path.join(folder, 'results.json')))
    skip('nothing was baked (bake.mjs)');
const { root, runs } = JSON.parse(fs.readFileSync(path.join(folder, 'results.json'), 'utf8'));

// Why a file that the validator accepts may be refused: `applies(document)` is looked up in the
// file, `says` in Cranny's line, so that no other fault hides behind a reason.
const reasons = [
    { name: 'no triangles', says: /triangle/, applies: (document) => !trianglePrimitives(document).length },
    { name: 'no triangle with area', says: /triangle/,
      applies: (document) => !trianglePrimitives(document).some((primitive) => hasArea(document, primitive)) },
    { name: 'unknown extension required', says: /extension/,
      applies: ({ json }) => members({ json }, 'extensionsRequired').some((name) => !supported.includes(name)) },
    { name: 'a decoder left out of this build', says: /build Cranny with/,
      applies: ({ json }) => members({ json }, 'extensionsUsed').some((name) => lacking.includes(name)) },
    { name: 'a later version required', says: /minVersion/,
      applies: ({ json }) => /^2\.[1-9]/.test(json.get('asset').get('minVersion')) },
    { name: 'a buffer without data', says: /\/buffers\/\d+/,
      applies: (document) => members(document, 'buffers').some((buffer, i) => !bufferBytes(document, i)) },
];
const supported = ['KHR_draco_mesh_compression', 'EXT_meshopt_compression', 'KHR_mesh_quantization',
    'KHR_texture_transform', 'EXT_mesh_gpu_instancing', 'KHR_materials_unlit', 'KHR_lights_punctual'];

function trianglePrimitives(document) {
    return members(document, 'meshes').flatMap((mesh) => mesh.get('primitives') ?? []).filter((primitive) =>
        [4, 5, 6].includes(primitive.get('mode') ?? 4) && primitive.get('attributes')?.has('POSITION'));
}

// Only what is simple to read counts as having none: plain triangle lists.
function hasArea(document, primitive) {
    const accessor = (index) => members(document, 'accessors')[index];
    const position = primitive.get('attributes').get('POSITION'), indices = primitive.get('indices');
    const isPlain = [position, indices].every((index) => index === undefined || !accessor(index).has('sparse'));
    if (!isPlain || primitive.has('extensions') || (primitive.get('mode') ?? 4) !== 4)
        return !isPlain || accessor(position).get('count') >= 3 && accessor(position).has('bufferView');
    const points = accessorRows(document, position);
    const corners = indices === undefined ? points.map((_, i) => i) : accessorRows(document, indices).flat();
    for (let t = 0; t + 2 < corners.length; t += 3) {
        const [a, b, c] = [0, 1, 2].map((k) => points[corners[t + k]]);
        const u = a.map((x, k) => b[k] - x), v = a.map((x, k) => c[k] - x);
        if (Math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) > 0)
            return true;
    }
    return false;
}

// Warnings that appending causes, and why there is no way round.
const unavoidable = {
    DATA_URI_GLB: 'only the first buffer of a GLB can be its BIN chunk; where that one has a URI, new data needs one too',
};

function validate(file) {
    return validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
        format: path.extname(file).slice(1),
        maxIssues: 0,
        writeTimestamp: false,
        externalResourceFunction: async (uri) =>
            new Uint8Array(await fs.promises.readFile(path.resolve(path.dirname(file), decodeURIComponent(uri)))),
    }).then((report) => report.issues.messages, (fault) => [{ code: 'UNREADABLE', severity: 0, message: String(fault) }]);
}

const errors = (messages) => messages.filter((message) => message.severity === 0);
const grave = (messages) => messages.filter((message) => message.severity <= 1);

// Meshes and materials that were appended are copies: what the validator says of them it may have
// said of any original, so their index does not count.
function place(message, input) {
    const pointer = message.pointer ?? '';
    const match = /^\/(meshes|materials)\/(\d+)(.*)$/.exec(pointer);
    const isCopy = match && Number(match[2]) >= members(input, match[1]).length;
    return { isCopy, key: `${message.code} ${pointer}`,
             loose: match ? `${message.code} /${match[1]}/*${match[3]}` : null };
}

function newMessages(before, after, input) {
    const places = before.map((message) => place(message, input));
    const exact = new Set(places.map((p) => p.key)), loose = new Set(places.map((p) => p.loose));
    return after.filter((message) => {
        const p = place(message, input);
        return !(p.isCopy ? loose.has(p.loose) : exact.has(p.key));
    });
}

const verdict = new Verdict('validate');
const inputReports = new Map();
function inputReport(run) {
    if (!inputReports.has(run.file))
        inputReports.set(run.file, run.imported ? Promise.resolve([]) : validate(path.join(root, run.file)));
    return inputReports.get(run.file);
}

async function judgeBaked(run) {
    const before = await inputReport(run);
    const after = await validate(path.join(folder, run.baked));
    const input = run.imported ? { json: new Map() } : readGltf(path.join(root, run.file));
    const added = newMessages(grave(before), grave(after), input)
        .filter((message) => message.severity === 0 || !(message.code in unavoidable));
    verdict.check(added.length === 0, `${run.file} (--to ${run.mode}): ${added.length} new: ` +
        added.slice(0, 3).map((m) => `${m.code} ${m.pointer ?? ''} ${m.message}`).join('; '));
    return errors(before).length ? 'baked, though the validator finds faults' : 'baked';
}

async function judgeRefused(run) {
    const found = errors(await inputReport(run));
    if (found.length)
        return verdict.check(true) && 'refused, faulty by the validator';
    let input = null;
    if (!run.imported)
        input = readGltf(path.join(root, run.file));
    const reason = input && reasons.find((r) => r.says.test(run.stderr) && r.applies(input));
    verdict.check(reason, `${run.file} is refused, but the validator accepts it: ${run.stderr.trim()}`);
    return reason ? `refused: ${reason.name}` : 'refused without reason';
}

const outcomes = await inParallel(runs, 2, async (run) => {
    if (run.status === 0)
        return judgeBaked(run);
    return run.status === 3 ? judgeRefused(run) : 'failed (see bake.mjs)';
});

verdict.check(runs.length > 0, 'nothing was run');

// The judgement itself: an error at a new place is seen, the same on a copied mesh is not.
const two = { json: new Map([['meshes', [new Map(), new Map()]]]) };
const at = (pointer) => ({ code: 'X', severity: 0, pointer });
verdict.check(newMessages([at('/meshes/0/a')], [at('/meshes/1/a')], two).length === 1, 'a new error is not seen');
verdict.check(newMessages([at('/meshes/0/a')], [at('/meshes/2/a')], two).length === 0, 'a copied error counts');
verdict.check(newMessages([], [at('/meshes/2/a')], two).length === 1, 'an error of a copy is not seen');

const counts = new Map();
runs.forEach((run, i) => {
    const row = counts.get(outcomes[i]) ?? {};
    row[run.mode] = (row[run.mode] ?? 0) + 1;
    counts.set(outcomes[i], row);
});
console.table(Object.fromEntries([...counts].sort()));
verdict.end();
