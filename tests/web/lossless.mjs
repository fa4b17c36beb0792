// Removing what a bake appended gives back the input (bake.mjs makes the files): every JSON member
// in its order with an equal value, every buffer and every other chunk byte for byte; and what was
// appended holds one visibility in [0,1] per vertex.
import fs from 'node:fs';
import path from 'node:path';
import { Verdict, output, skip } from './lib/setup.mjs';
import { accessorRows, bufferBytes, members, parseJson, readGltf } from './lib/gltf.mjs';
import { Undo } from './lib/undo.mjs';

const folder = path.join(output, 'baked');
if (!fs.existsSync(path.join(folder, 'results.json')))
    skip('nothing was baked (bake.mjs)');
const { root, runs } = JSON.parse(fs.readFileSync(path.join(folder, 'results.json'), 'utf8'));
const verdict = new Verdict('lossless');

function bufferDifferences(input, result) {
    const found = [];
    members(input, 'buffers').forEach((buffer, i) => {
        const before = bufferBytes(input, i), after = bufferBytes(result, i);
        if (!before)
            return;
        const size = Math.min(before.length, buffer.get('byteLength'));
        if (!after || after.length < size || !before.subarray(0, size).equals(after.subarray(0, size)))
            found.push(`buffer ${i} changed`);
    });
    if (input.bin && !result.bin?.subarray(0, input.bin.length).equals(input.bin) && !members(input, 'buffers').length)
        found.push('the BIN chunk changed');
    if (input.isGlb !== result.isGlb)
        found.push('the container changed');
    if (input.chunks.length !== result.chunks.length)
        found.push(`there were ${input.chunks.length} further chunks, there are ${result.chunks.length}`);
    input.chunks.forEach((chunk, i) => {
        if (result.chunks[i]?.type !== chunk.type || !result.chunks[i].data.equals(chunk.data))
            found.push(`further chunk ${i} changed`);
    });
    return found;
}

// Appended accessors: { vertices they go with: POSITION's count, rows }.
function* appendedValues(input, result, mode) {
    const first = members(input, 'accessors').length;
    const pattern = { occlusion: /^TEXCOORD_\d+$/, attribute: /^_AO$/, color: /^COLOR_0$/ }[mode];
    const seen = new Set();
    for (const mesh of members(result, 'meshes')) {
        for (const primitive of mesh.get('primitives')) {
            for (const [name, accessor] of primitive.get('attributes')) {
                if (!pattern.test(name) || accessor < first || seen.has(accessor))
                    continue;
                seen.add(accessor);
                const position = members(result, 'accessors')[primitive.get('attributes').get('POSITION')];
                yield { name, vertices: position.get('count'), rows: accessorRows(result, accessor) };
            }
        }
    }
}

function checkValues(run, input, result) {
    let count = 0;
    for (const { name, vertices, rows } of appendedValues(input, result, run.mode)) {
        count++;
        const what = `${run.file} (--to ${run.mode}): ${name}`;
        verdict.check(rows.length === vertices, `${what} has ${rows.length} values for ${vertices} vertices`);
        const wrong = run.mode === 'color' ? rows.find((row) => row.some((x) => !(x >= 0)))
            : rows.find((row) => !(row[0] >= 0 && row[0] <= 1));
        verdict.check(!wrong, `${what} holds ${wrong}`);
    }
    return count;
}

function checkRun(run) {
    const input = readGltf(path.join(root, run.file)), result = readGltf(path.join(folder, run.baked));
    const found = [...new Undo(input, result, run.mode).run(), ...bufferDifferences(input, result)];
    verdict.check(found.length === 0, `${run.file} (--to ${run.mode}): ${found.length} differences: ${found.slice(0, 3).join('; ')}`);
    return checkValues(run, input, result);
}

// The comparison must see each way to lose something.
function checkComparison() {
    const text = '{"asset":{"version":"2.0"},"9":1,"extras":{"b":[1,2.5],"a":null},"meshes":[{"primitives":' +
        '[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],"accessors":[{}]}';
    const baked = text.replace('"POSITION":0', '"POSITION":0,"TEXCOORD_0":1').replace('[{}]', '[{},{}]');
    const differs = (from, to) => new Undo({ json: parseJson(text) }, { json: parseJson(baked.replace(from, to)) }, 'occlusion').run().length;
    const copied = [',"nodes":[{"mesh":0', ',{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":2}}]}],"nodes":[{"mesh":1'];
    verdict.check(differs('', '') === 0, 'an addition that is documented counts as a loss');
    verdict.check(differs('],"nodes":[{"mesh":0', `${copied[1]}`) === 0, 'a copied mesh counts as a loss');
    verdict.check(differs('"mesh":0', '"mesh":0,"extras":{"cranny_ao_linear":[1,0,0,0]}') === 0, 'coefficients count as a loss');
    const losses = {
        'foreign extras': ['"mesh":0', '"mesh":0,"extras":{"cranny_ao":1,"c":0}'],
        'a dropped member': [',"a":null', ''],
        'members in another order': ['"b":[1,2.5],"a":null', '"a":null,"b":[1,2.5]'],
        'integer-like keys in another order': ['"asset":{"version":"2.0"},"9":1', '"9":1,"asset":{"version":"2.0"}'],
        'a changed number': ['2.5', '2.25'],
        'a dropped item': ['[1,2.5]', '[1]'],
        'a foreign member': ['"a":null', '"a":null,"c":0'],
        'a changed attribute': ['"POSITION":0', '"POSITION":1'],
        'a copy that lacks something': ['],"nodes":[{"mesh":0', copied[1].replace('"POSITION":0,', '')],
        'an index beyond the copies': ['"mesh":0', '"mesh":7'],
    };
    for (const [what, [from, to]] of Object.entries(losses))
        verdict.check(differs(from, to) > 0, `${what} is not seen`);
    const bytes = (...values) => ({ isGlb: true, chunks: [], bin: Buffer.from(values), json: parseJson('{"buffers":[{"byteLength":3}]}') });
    verdict.check(bufferDifferences(bytes(1, 2, 3), bytes(1, 2, 3, 9)).length === 0, 'a grown buffer counts as a loss');
    verdict.check(bufferDifferences(bytes(1, 2, 3), bytes(1, 2, 4, 9)).length === 1, 'a changed byte is not seen');
}

checkComparison();
const baked = runs.filter((run) => run.status === 0 && !run.imported);
const attributes = baked.reduce((sum, run) => sum + checkRun(run), 0);
verdict.check(baked.length > 0, 'nothing was baked');
verdict.check(attributes > baked.length / 2, `only ${attributes} attributes in ${baked.length} files`);
console.log(`${baked.length} files, ${attributes} appended attributes`);
verdict.end();
