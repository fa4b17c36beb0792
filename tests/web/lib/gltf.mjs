// A reader of .glb and .gltf that keeps what JSON.parse drops: the order of all members (objects
// become Maps, since JS objects move integer-like keys to the front), and every chunk.
import fs from 'node:fs';
import path from 'node:path';

const number = /-?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][+-]?\d+)?/y;
const string = /"(?:[^"\\]|\\[^])*"/y;
const blank = /[ \t\r\n]*/y;

export function parseJson(text) {
    let at = 0;
    const take = (pattern) => {
        pattern.lastIndex = at;
        const match = pattern.exec(text);
        if (!match)
            throw new SyntaxError(`JSON is broken at character ${at}`);
        at = pattern.lastIndex;
        return match[0];
    };
    const skipBlank = () => take(blank);
    const expect = (word) => {
        if (!text.startsWith(word, at))
            throw new SyntaxError(`JSON: ${word} expected at character ${at}`);
        at += word.length;
    };
    const sequence = (close, item) => {
        at++;
        skipBlank();
        if (text[at] !== close) {
            for (;;) {
                skipBlank();
                item();
                skipBlank();
                if (text[at] !== ',')
                    break;
                at++;
            }
        }
        expect(close);
    };
    const object = () => {
        const members = new Map();
        sequence('}', () => {
            const key = JSON.parse(take(string));
            skipBlank();
            expect(':');
            skipBlank();
            members.set(key, value());
        });
        return members;
    };
    const array = () => {
        const items = [];
        sequence(']', () => items.push(value()));
        return items;
    };
    const words = { t: ['true', true], f: ['false', false], n: ['null', null] };
    const value = () => {
        const c = text[at];
        if (c === '{')
            return object();
        if (c === '[')
            return array();
        if (c === '"')
            return JSON.parse(take(string));
        if (c in words) {
            expect(words[c][0]);
            return words[c][1];
        }
        return Number(take(number));
    };
    skipBlank();
    const root = value();
    skipBlank();
    if (at !== text.length)
        throw new SyntaxError(`JSON: something follows its end at character ${at}`);
    return root;
}

const magic = 0x46546c67, chunkJson = 0x4e4f534a, chunkBin = 0x004e4942;

// { json: Map, bin: Buffer|null, chunks: [{type, data}] (others), isGlb, folder }
export function readGltf(file) {
    const bytes = fs.readFileSync(file);
    const document = { json: null, bin: null, chunks: [], isGlb: false, folder: path.dirname(file) };
    if (bytes.length < 12 || bytes.readUInt32LE(0) !== magic) {
        document.json = parseJson(bytes.toString('utf8').replace(/^\ufeff/, ''));
        return document;
    }
    document.isGlb = true;
    const end = Math.min(bytes.readUInt32LE(8), bytes.length);
    for (let at = 12; at + 8 <= end;) {
        const size = bytes.readUInt32LE(at), type = bytes.readUInt32LE(at + 4);
        const data = bytes.subarray(at + 8, Math.min(at + 8 + size, end));
        if (type === chunkJson && !document.json)
            document.json = parseJson(data.toString('utf8'));
        else if (type === chunkBin && !document.bin)
            document.bin = data;
        else
            document.chunks.push({ type, data });
        at += 8 + size;
    }
    return document;
}

export function members(document, name) {
    const list = document.json.get(name);
    return Array.isArray(list) ? list : [];
}

// The bytes of buffer `index`; null when they cannot be had.
export function bufferBytes(document, index) {
    const buffer = members(document, 'buffers')[index];
    if (!(buffer instanceof Map))
        return null;
    const uri = buffer.get('uri');
    if (uri === undefined)
        return index === 0 && document.isGlb ? document.bin : null;
    if (typeof uri !== 'string')
        return null;
    const data = /^data:[^,]*?(;base64)?,([^]*)$/.exec(uri);
    if (data)
        return data[1] ? Buffer.from(data[2], 'base64') : Buffer.from(decodeURIComponent(data[2]), 'latin1');
    const file = path.resolve(document.folder, decodeURIComponent(uri));
    return fs.existsSync(file) && fs.statSync(file).isFile() ? fs.readFileSync(file) : null;
}

const componentReaders = {
    5120: [1, 'readInt8', 127], 5121: [1, 'readUInt8', 255], 5122: [2, 'readInt16LE', 32767],
    5123: [2, 'readUInt16LE', 65535], 5125: [4, 'readUInt32LE', 1], 5126: [4, 'readFloatLE', 1],
};
export const componentsOf = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };

// Plain (not sparse, not compressed) accessor as rows of numbers, normalised integers as floats.
// Without a bufferView all is 0.
export function accessorRows(document, index) {
    const accessor = members(document, 'accessors')[index];
    const width = componentsOf[accessor.get('type')];
    if (!accessor.has('bufferView'))
        return Array.from({ length: accessor.get('count') }, () => new Array(width).fill(0));
    const view = members(document, 'bufferViews')[accessor.get('bufferView')];
    const bytes = bufferBytes(document, view.get('buffer'));
    const [size, read, full] = componentReaders[accessor.get('componentType')];
    const stride = view.get('byteStride') ?? size * width;
    const first = (view.get('byteOffset') ?? 0) + (accessor.get('byteOffset') ?? 0);
    const scale = accessor.get('normalized') ? 1 / full : 1;
    const rows = [];
    for (let row = 0; row < accessor.get('count'); row++) {
        const at = first + row * stride;
        rows.push(Array.from({ length: width }, (_, i) => bytes[read](at + i * size) * scale));
    }
    return rows;
}
