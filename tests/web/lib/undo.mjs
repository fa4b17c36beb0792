// Undoes what a bake appends to a glTF document, and says what else differs from the input.
import { members } from './gltf.mjs';

// Root lists that may grow at their end.
const growing = ['accessors', 'bufferViews', 'buffers', 'images', 'samplers', 'textures', 'materials', 'meshes'];

// Where an index may point to an appended copy instead: path pattern and the list it is copied from.
const redirected = [
    [/^\/nodes\/\d+\/mesh$/, 'meshes'],
    [/^\/meshes\/\d+\/primitives\/\d+\/material$/, 'materials'],
    [/^\/meshes\/\d+\/primitives\/\d+\/extensions\/KHR_materials_variants\/mappings\/\d+\/material$/, 'materials'],
];

// Members that may be added, and indices that may be set to something appended, by mode.
const attributes = /^\/meshes\/\d+\/primitives\/\d+\/attributes\//;
const added = {
    occlusion: [new RegExp(`${attributes.source}TEXCOORD_\\d+$`), /^\/materials\/\d+\/occlusionTexture$/,
        /^\/meshes\/\d+\/primitives\/\d+\/material$/],
    color: [new RegExp(`${attributes.source}COLOR_0$`)],
    attribute: [new RegExp(`${attributes.source}_AO$`)],
};
// By any mode: what an instance has besides its mesh's values (docs/format.md).
const instanceExtras = /^\/nodes\/\d+\/extras$/;
const instanceNumbers = [
    new RegExp(`${instanceExtras.source.slice(0, -1)}\\/cranny_ao(_linear)?(_short)?$`),
    /^\/nodes\/\d+\/extensions\/EXT_mesh_gpu_instancing\/attributes\/_AO(_LINEAR)?(_SHORT)?$/,
];
const replaced = { occlusion: [], color: [[added.color[0], 'accessors']], attribute: [] };

export class Undo {
    constructor(input, output, mode) {
        this.input = input;
        this.output = output;
        this.mode = mode;
        this.differences = [];
        this.copies = [];
    }

    say(path, text) {
        this.differences.push(`${path || '/'}: ${text}`);
    }

    same(before, after, path) {
        if (before instanceof Map)
            return after instanceof Map ? this.sameObject(before, after, path) : this.say(path, 'is no object any more');
        if (Array.isArray(before))
            return Array.isArray(after) ? this.sameArray(before, after, path) : this.say(path, 'is no array any more');
        if (before !== after && !this.mayChange(before, after, path))
            this.say(path, `was ${JSON.stringify(before)}, is ${after instanceof Map ? 'an object' : JSON.stringify(after)}`);
    }

    sameObject(before, after, path) {
        for (const [key, value] of before) {
            if (after.has(key))
                this.same(value, after.get(key), `${path}/${key}`);
            else
                this.say(`${path}/${key}`, 'is gone');
        }
        for (const key of after.keys()) {
            if (before.has(key))
                continue;
            if (instanceExtras.test(`${path}/${key}`) && after.get(key) instanceof Map)
                this.sameObject(new Map(), after.get(key), `${path}/${key}`);
            else if (!this.mayAdd(key, `${path}/${key}`))
                this.say(`${path}/${key}`, 'is new');
        }
        const kept = [...after.keys()].filter((key) => before.has(key));
        if (kept.join('\0') !== [...before.keys()].filter((key) => after.has(key)).join('\0'))
            this.say(path, 'has its members in another order');
    }

    sameArray(before, after, path) {
        const mayGrow = growing.includes(path.slice(1)) && after.length >= before.length;
        if (after.length !== before.length && !mayGrow)
            this.say(path, `had ${before.length} items, has ${after.length}`);
        for (let i = 0; i < Math.min(before.length, after.length); i++)
            this.same(before[i], after[i], `${path}/${i}`);
    }

    mayAdd(key, path) {
        const isRoot = path === `/${key}`;
        return isRoot ? growing.includes(key)
            : [...added[this.mode], ...instanceNumbers].some((pattern) => pattern.test(path));
    }

    mayChange(before, after, path) {
        const isIndex = Number.isInteger(before) && Number.isInteger(after);
        if (!isIndex)
            return false;
        if (path === '/buffers/0/byteLength')
            return after > before;
        const appended = (list) => after >= members(this.input, list).length && after < members(this.output, list).length;
        if (replaced[this.mode].some(([pattern, list]) => pattern.test(path) && appended(list)))
            return true;
        const copy = redirected.find(([pattern, list]) => pattern.test(path) && appended(list));
        if (copy)
            this.compareCopy(copy[1], before, after);
        return copy !== undefined;
    }

    // A copy must hold what its original holds, but for the same kinds of additions.
    compareCopy(list, before, after) {
        const name = `${list} ${before} ${after}`;
        if (this.copies.includes(name))
            return;
        this.copies.push(name);
        this.same(members(this.input, list)[before], members(this.output, list)[after], `/${list}/${before}`);
    }

    run() {
        this.same(this.input.json, this.output.json, '');
        return this.differences;
    }
}
